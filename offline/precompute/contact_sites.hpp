// Which nodes a pack knows, and where tools take hold: the numbering that every later stage shares.
#pragma once

#include <array>
#include <vector>

#include "offline/mesh/surface.hpp"
#include "offline/precompute/scene.hpp"

namespace palpate {

// A surface node and the nodes that a tool there moves as one.
struct ContactSite {
  int node = 0;                                      // in the model
  int packed_node = 0;                               // in ContactSites::packed_nodes
  std::vector<int> patch;                            // in ContactSites::contact_nodes, ascending
  std::vector<int> patch_nodes;                      // the same in the model
  Eigen::Vector3d inward = Eigen::Vector3d::Zero();  // unit normal into the organ
  // Axes as columns that turn with the organ: the last one inward, the first along an edge of the surface.
  Eigen::Matrix3d frame = Eigen::Matrix3d::Identity();
};

struct ContactSites {
  std::vector<int> packed_nodes;              // model nodes that the pack shows, by ascending label
  std::vector<int> contact_nodes;             // in packed_nodes, ascending: every node of every patch
  std::vector<ContactSite> sites;             // by ascending label
  std::vector<std::array<int, 3>> triangles;  // surface triangles with all nodes packed, in packed_nodes
  double mean_surface_edge = 0;
  int sites_at_fixed_nodes = 0;  // with a fixed node within tip_radius, which their patch leaves out

  int model_node(int contact_node) const {
    return packed_nodes[static_cast<size_t>(contact_nodes[static_cast<size_t>(contact_node)])];
  }
};

// The rows of packed nodes, of all dofs' rows.
Eigen::MatrixXd packed_rows(const ContactSites& sites, const Eigen::MatrixXd& all);

// A patch is the surface nodes within tip_radius of the site along the surface, without the fixed ones.
ContactSites find_contact_sites(const Scene& scene, const Model& model);

}  // namespace palpate
