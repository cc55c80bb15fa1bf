// The wanted edge length h at each place of a solid:
//
//   h(p) = min(S, s_i + g max(0, |p - P_i| - r_i)) over the refined places i,   on the surface
//   h(p) = min(k S, h_surface(p) + g d)                                         at depth d below it
//
// S: --size. P_i, r_i, s_i: a place, its radius and its size. Edges grow with depth, for a touch deforms the
// tissue near the tool most.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "offline/io/mesh_data.hpp"
#include "offline/mesh/box_tree.hpp"

namespace palpate {

inline constexpr double kGrowth = 0.4;      // g: growth of an edge per length; neighbours differ by a third
inline constexpr double kCoreFactor = 2.5;  // k: the largest edges at the core, in --size

struct RefinedPlace {
  std::vector<Eigen::Vector3d> points;  // about a set: one in each cell of a grid of `size`
  double radius = 0;
  double size = 0;
  BoxTree tree;  // of the points
};

class SizeField {
 public:
  // `refinements`: the texts of --refine, "x,y,z,r: size" or "SET: size". Throws std::runtime_error that
  // begins with --refine and quotes the text.
  SizeField(double size, const std::vector<std::string>& refinements, const MeshData& mesh);

  double size() const { return size_; }
  double at_surface(const Eigen::Vector3d& point) const;
  double inside(const Eigen::Vector3d& point, double depth) const;

  // Estimates the number of tetrahedra from the surface's area and the volume in it, as layers from the
  // surface inward. Good within a factor of two on smooth surfaces; folds and steps take more.
  double num_elements(double area, double volume) const;

 private:
  double size_;
  std::vector<RefinedPlace> places_;
};

}  // namespace palpate
