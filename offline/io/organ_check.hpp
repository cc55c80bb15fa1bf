// What a stranger asks of a mesh before a build: counts, size, shape of the elements, joints.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <string>
#include <vector>

#include "offline/mesh/model_check.hpp"

namespace palpate {

// Elements that nodes connect.
struct PartCheck {
  int num_nodes = 0;
  int num_elements = 0;
  int first_node = 0;  // label
  Eigen::AlignedBox3d box;
  std::vector<std::string> free_motions;  // rigid motions that the supports leave free; see rigid_motion.hpp
};

struct OrganCheck {
  int num_nodes = 0;
  int num_elements = 0;
  int num_quadratic = 0;  // elements of ten nodes
  Eigen::AlignedBox3d box;
  double volume = 0;

  int num_surface_nodes = 0;
  double mean_edge = 0;      // h, of the surface
  int num_shells = 0;        // connected closed surfaces
  int num_cavities = 0;      // shells that face inwards
  int num_open_edges = 0;    // edges of the surface with other than two triangles: parts touch along an edge
  int num_shared_nodes = 0;  // nodes where triangles meet that no edge at the node joins: parts touch there

  std::vector<PartCheck> parts;       // the largest first
  int num_held_nodes = 0;             // nodes with a held degree of freedom
  std::vector<std::string> faults;    // a line each, with the remedy: a build refuses the mesh
  std::vector<std::string> warnings;  // a line each, with the remedy: answers may be poor

  std::array<int, 18> angles = {};  // dihedral angles of the elements, in bins of 10 degrees
  double least_angle = 180;         // degrees
  double largest_angle = 0;
  int num_slivers = 0;  // elements with an angle below kSliverAngle
  std::vector<int>
      slivers;  // labels of the elements with the smallest angles, at most kMostListed, worst first
};

inline constexpr double kSliverAngle = 5;  // degrees
inline constexpr int kMostListed = 8;

// `held`: the supports, sorted by node. Materials count where the model has them. Cost: O(elements log
// elements).
OrganCheck check_organ(const Model& model, const std::vector<PrescribedDisplacement>& held);

// Returns the origin of a model whose elements have no lines in their file.
ModelOrigin whole_file_origin(const Model& model);

}  // namespace palpate
