#include "offline/pipeline/scene_sites.hpp"

#include <algorithm>
#include <utility>

#include "offline/precompute/site_survey.hpp"

namespace palpate {
namespace {

Scene at_sites(Scene scene, const ContactSites& sites, const std::vector<size_t>& chosen) {
  scene.sites.clear();
  for (const size_t site : chosen) scene.sites.push_back(sites.sites[site].node);
  std::sort(scene.sites.begin(), scene.sites.end());
  return scene;
}

}  // namespace

std::vector<size_t> compared_sites(const Organ& organ, int most) {
  return spread_sites(organ.model, organ.sites, static_cast<size_t>(most));
}

LoadedScene with_sites(const Organ& organ, const std::vector<size_t>& sites) {
  return {at_sites(organ.scene, organ.sites, sites), organ.model};
}

LoadedScene with_at_most_sites(LoadedScene scene, int most) {
  const ContactSites sites = find_contact_sites(scene.scene, scene.model);
  const std::vector<size_t> chosen = spread_sites(scene.model, sites, static_cast<size_t>(most));
  if (chosen.size() < sites.sites.size()) scene.scene = at_sites(std::move(scene.scene), sites, chosen);
  return scene;
}

}  // namespace palpate
