#include "offline/pipeline/scene_sites.hpp"

#include <algorithm>

#include "offline/precompute/site_survey.hpp"

namespace palpate {

std::vector<size_t> compared_sites(const Organ& organ, int most) {
  return spread_sites(organ.model, organ.sites, static_cast<size_t>(most));
}

LoadedScene with_at_most_sites(LoadedScene scene, int most) {
  const ContactSites sites = find_contact_sites(scene.scene, scene.model);
  const std::vector<size_t> chosen = spread_sites(scene.model, sites, static_cast<size_t>(most));
  if (chosen.size() == sites.sites.size()) return scene;
  std::vector<int>& nodes = scene.scene.sites;
  nodes.clear();
  for (const size_t site : chosen) nodes.push_back(sites.sites[site].node);
  std::sort(nodes.begin(), nodes.end());
  return scene;
}

}  // namespace palpate
