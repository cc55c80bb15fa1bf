// nonlinear_zone: nonlinear elements around any contacts. runtime/src/zone has the equations.
//
// Ring 1 of a zone has the elements at the patch nodes, ring n + 1 the elements at the nodes of ring n. A
// zone completes volume patches. A pack carries the whole organ (organ_tree.hpp) and the sizes of zones.
#pragma once

#include <vector>

#include "offline/precompute/contact_sites.hpp"

namespace palpate {

struct ZoneTables {
  int rings = 0;
  // Sizes of all zones together; the nodes include all contact nodes.
  int num_nodes = 0;
  int num_elements = 0;
  // Largest numbers in the zone of any site.
  int most_nodes = 0;
  int most_boundary_nodes = 0;
  int most_elements = 0;
};

// Finds the elements of zones.
class ZoneFinder {
 public:
  explicit ZoneFinder(const Model& model);
  // Returns the elements of a site's zone, ascending. Thread-safe.
  std::vector<int> elements_about(const ContactSite& site, int rings) const;
  const std::vector<int>& elements_of(int node) const { return by_node_[static_cast<size_t>(node)]; }

 private:
  const Model* model_;
  std::vector<std::vector<int>> by_node_;   // elements of each node
  std::vector<std::vector<int>> by_patch_;  // elements of each volume patch
};

// Counts the nodes and elements of all zones.
ZoneTables find_zones(const Model& model, const ContactSites& sites, int rings);

}  // namespace palpate
