// Nearly incompressible bodies on which linear tetrahedra lock.
//
// - Cook's membrane (Cook 1974): corners (0, 0), (48, 44), (48, 60), (0, 44); left edge clamped, a dead force
//   up on the right edge; unit thickness, plane strain.
// - Bonded block: a block between two sticking plates, compressed by a tenth of its height.
// - Bonded cylinder: the same for a cylinder as high as wide.
// - Indented block: a smooth sticking tool presses a dent of its radius into a block on a plate.
#pragma once

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "offline/mesh/volume_patches.hpp"
#include "tests/support/scene_run.hpp"
#include "tests/support/tetrahedral_block.hpp"

namespace palpate::test {

// NEO HOOKE, W = C10 (I1bar - 3) + (J - 1)^2 / D1, with small-strain moduli mu = 2 C10 and K = 2 / D1.
inline InvariantLaw neo_hooke_of(double shear, double poisson) {
  const double bulk = 2 * shear * (1 + poisson) / (3 * (1 - 2 * poisson));
  InvariantLaw law;
  law.c10 = 0.5 * shear;
  law.volumetric.inverse_d = {0.5 * bulk, 0, 0};
  return law;
}

// The elements of a body: four or ten nodes, with a volume per element or per patch.
enum class Elements { c3d4, c3d4_mean_dilatation, c3d10, c3d10h };

// Converts a block of C3D4 to `elements`. Volume patches follow later, in share_volumes().
inline Model in_nodes_of(Elements elements, Model block) {
  const bool ten_nodes = elements == Elements::c3d10 || elements == Elements::c3d10h;
  return ten_nodes ? with_middle_nodes(std::move(block)) : block;
}

// Call share_volumes() after the last move of a node. Each material is a section.
inline Model share_volumes(Elements elements, Model model, int elements_per_patch = kElementsPerVolumePatch) {
  if (elements == Elements::c3d4 || elements == Elements::c3d10) return model;
  std::vector<int> groups;
  for (const Tetrahedron& element : model.elements) groups.push_back(element.material);
  form_volume_patches(model, groups, elements_per_patch);
  return model;
}

inline constexpr double kCookShearModulus =
    80.1938;  // shear modulus of the finite-strain version (Simo and Armero 1992)
inline constexpr double kCookForce = 100;  // on the right edge, unit thickness

// `cells` along each side, one through the thickness. Every node keeps its z coordinate.
inline SolverScene cooks_membrane(int cells, Elements elements, const Law& law,
                                  int elements_per_patch = kElementsPerVolumePatch) {
  BlockShape shape;
  shape.cells = {cells, cells, 1};
  shape.law = law;
  Model model = in_nodes_of(elements, tetrahedral_block(shape));
  const std::vector<int> clamped = nodes_on_plane(model, 0, 0.0);
  const std::vector<int> loaded = nodes_on_plane(model, 0, 1.0);
  for (Eigen::Vector3d& position : model.positions) {
    const double height = 44 + (16 - 44) * position.x();
    position = {48 * position.x(), 44 * position.x() + height * position.y(), position.z()};
  }
  model = share_volumes(elements, std::move(model), elements_per_patch);
  std::vector<char> is_clamped(model.positions.size(), 0);
  for (const int node : clamped) is_clamped[static_cast<std::size_t>(node)] = 1;
  for (int node = 0; node < model.num_nodes(); ++node) {
    for (const int axis : {0, 1, 2}) {
      if (axis == 2 || is_clamped[static_cast<std::size_t>(node)]) model.fixed.push_back({node, axis, 0.0});
    }
  }
  SolverScene scene{std::move(model), {}};
  LoadCase load = LoadCase::rest(scene.model);
  spread_over_face(load, scene.model, loaded, {0, kCookForce, 0});
  scene.steps = {load};
  return scene;
}

// Rise of the upper right corner: in the middle of the thickness, or the mean over the thickness for linear
// elements.
inline double cooks_tip(const SolverScene& scene, const SceneRun& run) {
  double sum = 0;
  int count = 0;
  for (int node = 0; node < scene.model.num_nodes(); ++node) {
    const Eigen::Vector3d& at = scene.model.positions[static_cast<std::size_t>(node)];
    if ((at.head<2>() - Eigen::Vector2d(48, 60)).norm() > 1e-9 * 60) continue;
    sum += run.displacement[3 * node + 1];
    ++count;
  }
  return sum / count;
}

// Holds the displacement along `axis` for the nodes at coordinate 0 of `axis`.
inline void hold_plane_of_symmetry(LoadCase& load, const Model& model, int axis) {
  for (const int node : nodes_on_plane(model, axis, 0.0))
    load.held[static_cast<std::size_t>(3 * node + axis)] = 1;
}

// A unit block of unit shear modulus between sticking plates. With `eighth`, the same mesh stands for an
// eighth of a block of twice the size, by symmetry.
inline SolverScene bonded_block(int cells, Elements elements, double poisson, bool eighth = false,
                                int elements_per_patch = kElementsPerVolumePatch) {
  BlockShape shape;
  shape.cells = {cells, cells, cells};
  shape.law = neo_hooke_of(1, poisson);
  Model model = share_volumes(elements, in_nodes_of(elements, tetrahedral_block(shape)), elements_per_patch);
  if (!eighth) model = with_fixed_base(std::move(model));
  SolverScene scene{std::move(model), {}};
  LoadCase load = LoadCase::rest(scene.model);
  hold_nodes(load, nodes_on_plane(scene.model, 2, 1.0), {0, 0, -0.1});
  for (int axis = 0; eighth && axis < 3; ++axis) hold_plane_of_symmetry(load, scene.model, axis);
  scene.steps = {load};
  return scene;
}

// An eighth of a cylinder (height 2, radius 1) between sticking plates, from the mid-plane up. The map x
// sqrt(1 - y^2 / 2), y sqrt(1 - x^2 / 2) rounds a block. Edges of ten-node elements follow the circle.
inline SolverScene bonded_cylinder(int cells, Elements elements, double poisson) {
  BlockShape shape;
  shape.cells = {cells, cells, cells};
  shape.law = neo_hooke_of(1, poisson);
  Model model = in_nodes_of(elements, tetrahedral_block(shape));
  for (Eigen::Vector3d& position : model.positions) {
    const double x = position.x();
    const double y = position.y();
    position.head<2>() << x * std::sqrt(1 - 0.5 * y * y), y * std::sqrt(1 - 0.5 * x * x);
  }
  SolverScene scene{share_volumes(elements, std::move(model)), {}};
  LoadCase load = LoadCase::rest(scene.model);
  hold_nodes(load, nodes_on_plane(scene.model, 2, 1.0), {0, 0, -0.1});
  for (const int axis : {0, 1, 2}) hold_plane_of_symmetry(load, scene.model, axis);
  scene.steps = {load};
  return scene;
}

// The force that compresses the block between the plates.
inline double plate_force(const SolverScene& scene, const SceneRun& run) {
  return -sum_over(run.force, nodes_on_plane(scene.model, 2, 1.0)).z();
}

// A quarter of an indentation: the top of a unit block goes down by 0.1 cos^2(pi r / 2) for r < 1. r is the
// distance from a corner. The top sticks to the tool; the planes through the corner are symmetric.
inline SolverScene indented_block(int cells, Elements elements, double poisson,
                                  int elements_per_patch = kElementsPerVolumePatch) {
  BlockShape shape;
  shape.cells = {cells, cells, cells};
  shape.law = neo_hooke_of(1, poisson);
  Model model = share_volumes(elements, in_nodes_of(elements, tetrahedral_block(shape)), elements_per_patch);
  SolverScene scene{with_fixed_base(std::move(model)), {}};
  LoadCase load = LoadCase::rest(scene.model);
  for (const int axis : {0, 1}) hold_plane_of_symmetry(load, scene.model, axis);
  for (const int node : nodes_on_plane(scene.model, 2, 1.0)) {
    const double r = scene.model.positions[static_cast<std::size_t>(node)].head<2>().norm();
    if (r < 1 + 1e-9)
      hold_nodes(load, {node}, {0, 0, -0.1 * std::pow(std::cos(0.5 * std::numbers::pi * r), 2)});
  }
  scene.steps = {load};
  return scene;
}

// Secant stiffness: the work done over half the square of the depth.
inline double indentation_stiffness(const SolverScene& scene, const SceneRun& run) {
  double work = 0;
  Eigen::VectorXd force;
  Assembly(scene.model, scene.model.fixed_dofs()).internal_force(run.displacement, force, &work);
  return work / (0.5 * 0.1 * 0.1);
}

}  // namespace palpate::test
