// nonlinear_zone: what the runtime needs to put nonlinear elements around any contacts and the linear rest of the organ
// onto their boundary (runtime/src/zone_set.hpp has the equations).
//
// The zone of a site with n rings is the elements at the nodes of its patch, the elements at their nodes, and so on n
// times. Carried are the elements and nodes of all sites' zones, and the compliance K^-1 at rest between those nodes,
// of which the rows and columns of contact nodes are linear_dd's.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

#include "offline/precompute/contact_sites.hpp"
#include "offline/precompute/rest_state.hpp"

namespace palpate {

struct ZoneTables {
  int rings = 0;
  std::vector<int>
      nodes;  // model nodes: contact nodes in their order, others that are free along some axis, fixed ones
  int num_free = 0;              // of them the first
  std::vector<int> elements;     // in Model::elements, ascending
  std::vector<int> num_outside;  // of each node: elements of the model that are not among these
  // Largest zone of a site.
  int most_nodes = 0;
  int most_boundary_nodes = 0;
  int most_elements = 0;
  // C of the free nodes after the contact nodes: a column for each of their dofs, rows of all free nodes.
  Eigen::MatrixXd compliance;
  Eigen::MatrixXd field_compliance;  // the same columns, rows of packed nodes
};

// Why no zone can be carried, naming the material; "" where one can.
std::string why_no_zone(const Model& model);

// Which nodes and elements; the compliance is left empty.
ZoneTables find_zones(const Model& model, const ContactSites& sites, int rings);

// Throws std::runtime_error when the stiffness at rest is not positive definite. `progress` gets done, total columns.
void compute_zone_compliance(const Assembly& assembly, const ContactSites& sites, const RestState& rest,
                             const std::function<void(int, int)>& progress, ZoneTables& zone);

// Bytes of a pack that the compliance takes.
double zone_bytes(const ZoneTables& zone, const ContactSites& sites);

}  // namespace palpate
