// Numbers the nodes of a pack and the contact sites; all later stages share these numbers.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "offline/mesh/surface.hpp"
#include "offline/precompute/scene.hpp"

namespace palpate {

// A surface node at which a tool can take hold, and its patch: the nodes that the tool moves together.
struct ContactSite {
  int node = 0;                                      // in the model
  int packed_node = 0;                               // in ContactSites::packed_nodes
  std::vector<int> patch;                            // in ContactSites::contact_nodes, ascending
  std::vector<int> patch_nodes;                      // the same nodes, in the model
  Eigen::Vector3d inward = Eigen::Vector3d::Zero();  // unit normal into the organ
  // Orthonormal axes as columns: the last axis points inward, the first along a surface edge.
  Eigen::Matrix3d frame = Eigen::Matrix3d::Identity();
};

// Part of max_displacement by which a patch must be able to move in every direction. Sites that
// cannot are left out.
inline constexpr double kLeastReachPart = 0.25;

// A site that no response model can serve.
struct LeftOutSite {
  int node = 0;             // in the model
  double out_of_reach = 0;  // |d| that the patch cannot have in some direction: length unit
};

struct ContactSites {
  std::vector<int> packed_nodes;              // model nodes that the pack shows, by ascending label
  std::vector<int> contact_nodes;             // in packed_nodes, ascending: every node of every patch
  std::vector<ContactSite> sites;             // by ascending label
  std::vector<std::array<int, 3>> triangles;  // surface triangles with packed corners, in packed_nodes
  double mean_surface_edge = 0;               // h: length unit
  int sites_at_fixed_nodes = 0;               // sites whose patch leaves out fixed nodes
  std::vector<LeftOutSite> left_out;          // sites of the scene that are not in `sites`

  int model_node(int contact_node) const {
    return packed_nodes[static_cast<size_t>(contact_nodes[static_cast<size_t>(contact_node)])];
  }
};

// Returns the rows of the packed nodes (3 packed nodes) from the rows of all dofs.
Eigen::MatrixXd packed_rows(const ContactSites& sites, const Eigen::MatrixXd& all);

// Says which sites are left out, and how many of the scene's sites are left: "SCENE.toml: 2 of 30 sites ...".
std::string left_out_text(const Scene& scene, const Model& model, const std::vector<LeftOutSite>& left_out,
                          size_t num_left);

// Numbers the sites. A patch has the free surface nodes within tip_radius of the site along the surface.
// Leaves out sites whose patch_reaches() is below kLeastReachPart. Throws std::runtime_error where no site is
// left.
ContactSites find_contact_sites(const Scene& scene, const Model& model);

}  // namespace palpate
