// Bodies that linear tetrahedra answer too stiffly when nearly incompressible.
//
// Cook's membrane (Cook 1974): the corners (0, 0), (48, 44), (48, 60), (0, 44); the left edge clamped, a dead
// force up on the right one; here one unit thick and in plane strain.
// The bonded block: a unit block between two plates that stick, the upper one comes down by a tenth.
#pragma once

#include <string>
#include <vector>

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

inline constexpr double kCookShearModulus = 80.1938;  // of its finite strain version (Simo and Armero 1992)
inline constexpr double kCookForce = 100;             // on the right edge, unit thickness

// `cells` along each side and one through the thickness; no node leaves its plane z = const.
inline SolverScene cooks_membrane(int cells, bool ten_nodes, const Law& law) {
  BlockShape shape;
  shape.cells = {cells, cells, 1};
  shape.law = law;
  Model model = tetrahedral_block(shape);
  if (ten_nodes) model = with_middle_nodes(std::move(model));
  const std::vector<int> clamped = nodes_on_plane(model, 0, 0.0);
  const std::vector<int> loaded = nodes_on_plane(model, 0, 1.0);
  for (Eigen::Vector3d& position : model.positions) {
    const double height = 44 + (16 - 44) * position.x();
    position = {48 * position.x(), 44 * position.x() + height * position.y(), position.z()};
  }
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

// A unit block of unit shear modulus between plates.
inline SolverScene bonded_block(int cells, bool ten_nodes, double poisson) {
  BlockShape shape;
  shape.cells = {cells, cells, cells};
  shape.law = neo_hooke_of(1, poisson);
  Model model = tetrahedral_block(shape);
  if (ten_nodes) model = with_middle_nodes(std::move(model));
  SolverScene scene{with_fixed_base(std::move(model)), {}};
  LoadCase load = LoadCase::rest(scene.model);
  hold_nodes(load, nodes_on_plane(scene.model, 2, 1.0), {0, 0, -0.1});
  scene.steps = {load};
  return scene;
}

// The force that presses the plates together.
inline double plate_force(const SolverScene& scene, const SceneRun& run) {
  return -sum_over(run.force, nodes_on_plane(scene.model, 2, 1.0)).z();
}

}  // namespace palpate::test
