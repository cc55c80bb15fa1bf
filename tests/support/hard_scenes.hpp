// Blocks that are hard to solve, and a patch on a real organ's surface pushed inwards.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "offline/mesh/surface.hpp"
#include "tests/support/scene_run.hpp"
#include "tests/support/tetrahedral_block.hpp"

namespace palpate::test {

// A unit block on a fixed base; the top moves rigidly.
inline SolverScene moved_top(Model block, const Eigen::Vector3d& motion) {
  SolverScene scene{with_fixed_base(std::move(block)), {}};
  LoadCase load = LoadCase::rest(scene.model);
  hold_nodes(load, nodes_on_plane(scene.model, 2, 1.0), motion);
  scene.steps = {load};
  return scene;
}

// A unit block of 6 x 6 x 6 cells. The elements of the inner 2 x 2 x 2 cells are `ratio` times stiffer.
inline Model block_with_inclusion(double ratio) {
  constexpr std::size_t kCells = 6;
  const CompressibleNeoHookean tissue = {1, 4};
  BlockShape shape;
  shape.cells = {kCells, kCells, kCells};
  shape.law = tissue;
  Model model = tetrahedral_block(shape);
  model.materials.push_back({"INCLUSION", CompressibleNeoHookean{ratio * tissue.mu, ratio * tissue.lambda}});
  const auto inner = [](std::size_t cell) { return cell == 2 || cell == 3; };
  for (std::size_t element = 0; element < model.elements.size(); ++element) {
    const std::size_t cell = element / 6;  // six tetrahedra each, x fastest
    if (inner(cell % kCells) && inner(cell / kCells % kCells) && inner(cell / kCells / kCells))
      model.elements[element].material = 1;
  }
  return model;
}

// How rigidly the nodes of one material move: |x - best rigid motion of X| over their extent, 2-norms.
inline double distance_from_rigid(const Model& model, int material, const Eigen::VectorXd& displacement) {
  std::vector<int> nodes;
  for (const Tetrahedron& element : model.elements) {
    if (element.material == material)
      nodes.insert(nodes.end(), element.nodes().begin(), element.nodes().end());
  }
  std::sort(nodes.begin(), nodes.end());
  nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
  Eigen::Matrix3Xd rest(3, nodes.size());
  Eigen::Matrix3Xd moved(3, nodes.size());
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const Eigen::Index column = static_cast<Eigen::Index>(i);
    rest.col(column) = model.positions[static_cast<std::size_t>(nodes[i])];
    moved.col(column) = rest.col(column) + displacement.segment<3>(3 * nodes[i]);
  }
  const Eigen::Matrix4d motion = Eigen::umeyama(rest, moved, false);
  const Eigen::Matrix3Xd fitted =
      (motion.topLeftCorner<3, 3>() * rest).colwise() + motion.topRightCorner<3, 1>();
  return (moved - fitted).norm() / (rest.colwise() - rest.rowwise().mean()).norm();
}

// The smallest angle between two faces of any element, in degrees.
inline double smallest_dihedral_angle(const Model& model) {
  double largest_cosine = -1;
  for (const Tetrahedron& element : model.elements) {
    const auto at = [&](int corner) {
      return model.positions[static_cast<std::size_t>(element.corners()[static_cast<std::size_t>(corner)])];
    };
    for (const auto& [i, j] : kTetrahedronEdges) {
      const int k = i != 0 && j != 0 ? 0 : (i != 1 && j != 1 ? 1 : 2);
      const int l = 6 - i - j - k;
      const Eigen::Vector3d edge = at(j) - at(i);
      const Eigen::Vector3d one = edge.cross(at(k) - at(i));
      const Eigen::Vector3d other = edge.cross(at(l) - at(i));
      largest_cosine = std::max(largest_cosine, one.dot(other) / (one.norm() * other.norm()));
    }
  }
  return std::acos(largest_cosine) * 180 / std::numbers::pi;
}

// A unit block of 6 x 6 x 6 cells with 27 flat elements, inside and beside the base. Every second inner node
// along each axis moves toward the opposite face of one of its elements. The height above that face falls to
// the fraction `flatness`. No two moved nodes share an element.
inline Model block_with_slivers(double flatness) {
  constexpr int kCells = 6;
  BlockShape shape;
  shape.cells = {kCells, kCells, kCells};
  shape.jitter = 0;
  shape.law = CompressibleNeoHookean{1, 4};
  Model model = tetrahedral_block(shape);
  std::vector<char> done(model.positions.size(), 0);
  for (const Tetrahedron& element : model.elements) {
    for (const int node : element.nodes()) {
      const int i = node % (kCells + 1);
      const int j = node / (kCells + 1) % (kCells + 1);
      const int k = node / (kCells + 1) / (kCells + 1);
      if (i % 2 == 0 || j % 2 == 0 || k % 2 == 0 || done[static_cast<std::size_t>(node)]) continue;
      done[static_cast<std::size_t>(node)] = 1;
      Eigen::Vector3d& apex = model.positions[static_cast<std::size_t>(node)];
      Eigen::Vector3d centre = -apex;
      for (const int other : element.nodes()) centre += model.positions[static_cast<std::size_t>(other)];
      apex = centre / 3 + flatness * (apex - centre / 3);
    }
  }
  return model;
}

// Pushes the patch of `site` inwards along the patch's mean normal by `depth` mean edges. The patch holds the
// surface nodes within 1.2 mean edges, measured along the surface.
inline SolverScene pushed_patch(const Model& organ, int site, double depth) {
  SolverScene scene{organ, {}};
  const Surface surface = extract_surface(organ);
  const std::vector<int> patch = nodes_within(surface, site, 1.2 * surface.mean_edge);
  const std::vector<Eigen::Vector3d> normals = outward_normals(organ, surface);
  Eigen::Vector3d outward = Eigen::Vector3d::Zero();
  for (const int node : patch) outward += normals[static_cast<std::size_t>(node)];
  LoadCase load = LoadCase::rest(organ);
  hold_nodes(load, patch, -depth * surface.mean_edge * outward.normalized());
  scene.steps = {load};
  return scene;
}

}  // namespace palpate::test
