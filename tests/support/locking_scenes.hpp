// Bodies that linear tetrahedra answer too stiffly when nearly incompressible.
//
// Cook's membrane (Cook 1974): the corners (0, 0), (48, 44), (48, 60), (0, 44); the left edge clamped, a dead force
// up on the right one; here one unit thick and in plane strain. The bonded block: a block between two plates that
// stick, pressed together by a tenth of its height. The bonded cylinder: one as high as wide. The indented block: a
// smooth tool that sticks pushes a dent of its radius into the top of a block on a plate.
#pragma once

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "offline/mesh/volume_patches.hpp"
#include "tests/support/scene_run.hpp"
#include "tests/support/tetrahedral_block.hpp"

namespace palpate::test {

// NEO HOOKE, W = C10 (I1bar - 3) + (J - 1)^2 / D1, with the moduli mu = 2 C10 and K = 2 / D1 at rest.
inline InvariantLaw neo_hooke_of(double shear, double poisson) {
  const double bulk = 2 * shear * (1 + poisson) / (3 * (1 - 2 * poisson));
  InvariantLaw law;
  law.c10 = 0.5 * shear;
  law.volumetric.inverse_d = {0.5 * bulk, 0, 0};
  return law;
}

// What a body is made of: elements of four or ten nodes, with volumes of their own or shared.
enum class Elements { c3d4, c3d4_mean_dilatation, c3d10, c3d10h };

// A block of C3D4 in these; its middle nodes, where it has them, are made at once, patches by share_volumes().
inline Model in_nodes_of(Elements elements, Model block) {
  const bool ten_nodes = elements == Elements::c3d10 || elements == Elements::c3d10h;
  return ten_nodes ? with_middle_nodes(std::move(block)) : block;
}

// Once every node is in its place. A material is a section.
inline Model share_volumes(Elements elements, Model model, int elements_per_patch = kElementsPerVolumePatch) {
  if (elements == Elements::c3d4 || elements == Elements::c3d10) return model;
  std::vector<int> groups;
  for (const Tetrahedron& element : model.elements) groups.push_back(element.material);
  form_volume_patches(model, groups, elements_per_patch);
  return model;
}

inline constexpr double kCookShearModulus = 80.1938;  // of its finite strain version (Simo and Armero 1992)
inline constexpr double kCookForce = 100;             // on the right edge, unit thickness

// `cells` along each side and one through the thickness; no node leaves its plane z = const.
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

// How far the upper right corner of the membrane rises, in the middle of the thickness or, of linear
// elements, in its mean.
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

// Holds the motion along `axis` of the nodes that stand at 0 of it.
inline void hold_plane_of_symmetry(LoadCase& load, const Model& model, int axis) {
  for (const int node : nodes_on_plane(model, axis, 0.0))
    load.held[static_cast<std::size_t>(3 * node + axis)] = 1;
}

// A unit block of unit shear modulus between plates that stick; or, with planes of symmetry, an eighth of one of twice
// the size, from the middle up.
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

// An eighth of a cylinder of height 2 and radius 1 between plates that stick, from the middle up: the block with its
// square cross-section made round, x sqrt(1 - y^2 / 2), y sqrt(1 - x^2 / 2). Sides of ten-node elements follow the
// circle.
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

// The force that presses the plates together.
inline double plate_force(const SolverScene& scene, const SceneRun& run) {
  return -sum_over(run.force, nodes_on_plane(scene.model, 2, 1.0)).z();
}

// The top of a unit block on a fixed base goes down by 0.1 cos^2(pi r / 2) within the unit radius r of a corner, stuck
// to the tool; the planes through that corner are of symmetry.
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

// The work done on the indented block over half the square of its depth: its secant stiffness.
inline double indentation_stiffness(const SolverScene& scene, const SceneRun& run) {
  double work = 0;
  Eigen::VectorXd force;
  Assembly(scene.model, scene.model.fixed_dofs()).internal_force(run.displacement, force, &work);
  return work / (0.5 * 0.1 * 0.1);
}

}  // namespace palpate::test
