// nonlinear_zone: data for nonlinear elements around any contacts, coupled to the linear rest of the organ at
// their boundary. runtime/src/zone has the equations.
//
// The zone of a site with n rings has the elements at its patch's nodes, extended n times by neighbours, and
// completes volume patches. A pack carries:
//   1. elements and nodes of all zones,
//   2. the compliance K^-1 at rest between these nodes; linear_dd has the blocks of contact nodes.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <vector>

#include "offline/precompute/contact_sites.hpp"
#include "offline/precompute/rest_state.hpp"
#include "schemas/pack_layout.hpp"

namespace palpate {

struct ZoneTables {
  int rings = 0;
  bool rounded = false;          // packs store its fields as int16
  std::vector<int> nodes;        // model nodes: contact nodes in their order, other free nodes, fixed nodes
  int num_free = 0;              // the first num_free nodes are free
  std::vector<int> elements;     // in Model::elements: patch by patch, then elements without a shared volume
  std::vector<int> num_outside;  // for each node: elements of the model outside of `elements`
  // Size of the largest zone.
  int most_nodes = 0;
  int most_boundary_nodes = 0;
  int most_elements = 0;
  // C of the free nodes after the contact nodes: a column for each of their dofs, rows of all free nodes.
  Eigen::MatrixXd compliance;
  Eigen::MatrixXd field_compliance;  // the same columns, rows of packed nodes
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

// Finds nodes and elements of zones; leaves all other members empty.
ZoneTables find_zones(const Scene& scene, const Model& model, const ContactSites& sites, int rings);

// Fills compliance and field_compliance.
// Throws std::runtime_error when the stiffness at rest is not positive definite. `progress` gets done and
// total columns.
void compute_zone_compliance(const Assembly& assembly, const ContactSites& sites, const RestState& rest,
                             const std::function<void(int, int)>& progress, ZoneTables& zone);

// A pack's bytes for the compliance.
double zone_bytes(const ZoneTables& zone, const ContactSites& sites);

}  // namespace palpate
