// nonlinear_zone: nonlinear elements around any contacts. runtime/src/zone has the equations.
//
// The zone of a site with n rings has the elements at its patch's nodes, extended n times by neighbours, and
// completes volume patches. A pack carries the whole organ (organ_tree.hpp), and the sizes of the zones.
#pragma once

#include <vector>

#include "offline/precompute/contact_sites.hpp"

namespace palpate {

struct ZoneTables {
  int rings = 0;
  // Sizes of all zones together; the nodes include all contact nodes.
  int num_nodes = 0;
  int num_elements = 0;
  // Size of the largest zone.
  int most_nodes = 0;
  int most_boundary_nodes = 0;
  int most_elements = 0;
};

// Finds the elements of zones.
class ZoneFinder {
 public:
  explicit ZoneFinder(const Model& model);
  // Ascending. Thread-safe.
  std::vector<int> elements_about(const ContactSite& site, int rings) const;
  const std::vector<int>& elements_of(int node) const { return by_node_[static_cast<size_t>(node)]; }

 private:
  const Model* model_;
  std::vector<std::vector<int>> by_node_;
  std::vector<std::vector<int>> by_patch_;
};

ZoneTables find_zones(const Model& model, const ContactSites& sites, int rings);

}  // namespace palpate
