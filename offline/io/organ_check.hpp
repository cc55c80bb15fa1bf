// What a stranger asks of a mesh before a build: counts, size, shape of the elements, joints.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <vector>

#include "offline/mesh/model.hpp"

namespace palpate {

struct OrganCheck {
  int num_nodes = 0;
  int num_elements = 0;
  int num_quadratic = 0;  // elements of ten nodes
  int num_surface_nodes = 0;
  int num_components = 0;  // parts that no face joins
  Eigen::AlignedBox3d box;
  double volume = 0;
  double mean_edge = 0;             // h, of the surface
  std::array<int, 18> angles = {};  // dihedral angles of the elements, in bins of 10 degrees
  double least_angle = 180;         // degrees
  double largest_angle = 0;
  std::vector<int>
      slivers;          // labels of the elements with the smallest angles, at most kMostListed, worst first
  int num_slivers = 0;  // elements with an angle below kSliverAngle
  int num_open_edges = 0;  // edges of the surface with other than two triangles: a fold, or parts that touch
};

inline constexpr double kSliverAngle = 5;  // degrees
inline constexpr int kMostListed = 8;

// Cost: O(elements log elements).
OrganCheck check_organ(const Model& model);

}  // namespace palpate
