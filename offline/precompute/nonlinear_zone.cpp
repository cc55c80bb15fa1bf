#include "offline/precompute/nonlinear_zone.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <utility>

namespace palpate {
ZoneFinder::ZoneFinder(const Model& model)
    : model_(&model), by_node_(static_cast<size_t>(model.num_nodes())) {
  for (size_t e = 0; e < model.elements.size(); ++e) {
    for (const int node : model.elements[e].nodes())
      by_node_[static_cast<size_t>(node)].push_back(static_cast<int>(e));
    const int patch = model.elements[e].volume_patch;
    if (patch < 0) continue;
    by_patch_.resize(std::max(by_patch_.size(), static_cast<size_t>(patch) + 1));
    by_patch_[static_cast<size_t>(patch)].push_back(static_cast<int>(e));
  }
}

std::vector<int> ZoneFinder::elements_about(const ContactSite& site, int rings) const {
  std::set<int> elements;
  std::set<int> nodes(site.patch_nodes.begin(), site.patch_nodes.end());
  std::vector<int> outermost = site.patch_nodes;
  for (int ring = 0; ring < rings; ++ring) {
    std::vector<int> found;
    for (const int at : outermost) {
      for (const int e : elements_of(at)) {
        if (!elements.insert(e).second) continue;
        for (const int node : model_->elements[static_cast<size_t>(e)].nodes()) {
          if (nodes.insert(node).second) found.push_back(node);
        }
      }
    }
    outermost = std::move(found);
  }
  std::set<int> patches;
  for (const int e : elements) {
    const int patch = model_->elements[static_cast<size_t>(e)].volume_patch;
    if (patch >= 0) patches.insert(patch);
  }
  for (const int patch : patches) {
    const std::vector<int>& of_patch = by_patch_[static_cast<size_t>(patch)];
    elements.insert(of_patch.begin(), of_patch.end());
  }
  return {elements.begin(), elements.end()};
}

ZoneTables find_zones(const Model& model, const ContactSites& sites, int rings) {
  const ZoneFinder finder(model);
  std::vector<char> is_node(static_cast<size_t>(model.num_nodes()));  // 1: node of any zone
  std::vector<char> is_element(model.elements.size());
  for (size_t c = 0; c < sites.contact_nodes.size(); ++c)
    is_node[static_cast<size_t>(sites.model_node(static_cast<int>(c)))] = 1;
  ZoneTables zone;
  zone.rings = rings;
  for (const ContactSite& site : sites.sites) {
    const std::vector<int> elements = finder.elements_about(site, rings);
    std::map<int, size_t> inside;  // number of the zone's elements at each node of the zone
    for (const int e : elements) {
      is_element[static_cast<size_t>(e)] = 1;
      for (const int node : model.elements[static_cast<size_t>(e)].nodes()) {
        is_node[static_cast<size_t>(node)] = 1;
        ++inside[node];
      }
    }
    const auto num_boundary = std::ranges::count_if(
        inside, [&](const auto& node) { return node.second < finder.elements_of(node.first).size(); });
    zone.most_nodes = std::max(zone.most_nodes, static_cast<int>(inside.size()));
    zone.most_boundary_nodes = std::max(zone.most_boundary_nodes, static_cast<int>(num_boundary));
    zone.most_elements = std::max(zone.most_elements, static_cast<int>(elements.size()));
  }
  zone.num_nodes = static_cast<int>(std::ranges::count(is_node, 1));
  zone.num_elements = static_cast<int>(std::ranges::count(is_element, 1));
  return zone;
}

}  // namespace palpate
