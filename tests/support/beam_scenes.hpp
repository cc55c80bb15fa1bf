// A slender bar of unit section, clamped at one end, bent and twisted through large rotations.
//
//      z ^
//        |=====================  tip face, x = length
//        +---> x     (the axis is y = z = 0)
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <vector>

#include "tests/support/scene_run.hpp"
#include "tests/support/tetrahedral_block.hpp"

namespace palpate::test {

// Second moment of area of the unit section.
inline constexpr double kSecondMoment = 1.0 / 12.0;

// Eq. (1) with this Young's modulus and Poisson's ratio at small strain.
inline CompressibleNeoHookean neo_hookean_of(double young, double poisson) {
  const double mu = young / (2 * (1 + poisson));
  return {mu, 2 * mu * poisson / (1 - 2 * poisson)};
}

struct Beam {
  double length = 20;
  int cells_along = 20;
  int cells_across = 2;
  bool ten_nodes = true;
  Law law = neo_hookean_of(1, 0);

  Model model() const {
    BlockShape shape;
    shape.cells = {cells_along, cells_across, cells_across};
    shape.size = {length, 1, 1};
    shape.law = law;
    Model model = tetrahedral_block(shape);
    for (Eigen::Vector3d& position : model.positions) position -= Eigen::Vector3d(0, 0.5, 0.5);
    if (ten_nodes) model = with_middle_nodes(std::move(model));
    for (const int node : nodes_on_plane(model, 0, 0.0)) {
      for (int axis = 0; axis < 3; ++axis) model.fixed.push_back({node, axis, 0.0});
    }
    return model;
  }
  std::vector<int> tip(const Model& model) const { return nodes_on_plane(model, 0, length); }
};

// A dead force, spread over the tip face.
inline SolverScene loaded_beam(const Beam& beam, const Eigen::Vector3d& force) {
  SolverScene scene{beam.model(), {}};
  LoadCase load = LoadCase::rest(scene.model);
  spread_over_face(load, scene.model, beam.tip(scene.model), force);
  scene.steps = {load};
  return scene;
}

// The tip face moves rigidly to `motion(fraction)`, in `steps` straight increments.
template <typename Motion>
SolverScene guided_beam(const Beam& beam, int steps, Motion&& motion) {
  SolverScene scene{beam.model(), {}};
  const std::vector<int> tip = beam.tip(scene.model);
  for (int step = 1; step <= steps; ++step) {
    const Eigen::Isometry3d moved = motion(static_cast<double>(step) / steps);
    LoadCase load = LoadCase::rest(scene.model);
    for (const int node : tip) {
      const Eigen::Vector3d& at = scene.model.positions[static_cast<std::size_t>(node)];
      hold_nodes(load, {node}, moved * at - at);
    }
    scene.steps.push_back(load);
  }
  return scene;
}

// Pure bending to one curvature k, M = EI k: the tip face turns about y to the end of the arc
//   x = sin(a) / k,   z = (1 - cos a) / k.
// The axis lengthens a little. Eq. (1) with lambda = 0 gives a fibre the stress E (e - e^2 / 2 + ...) at
// strain e. The axial force vanishes for e = e_0 + k z with e_0 = k^2 <z^2> / 2 = k^2 / 24.
inline SolverScene bent_to_an_arc(const Beam& beam, double angle, int steps) {
  return guided_beam(beam, steps, [&](double fraction) {
    const double a = fraction * angle;
    const double stretch = 1 + std::pow(a / beam.length, 2) / 24;
    Eigen::Isometry3d moved = Eigen::Isometry3d::Identity();
    moved.translate(stretch * beam.length * Eigen::Vector3d(std::sin(a) / a, 0, (1 - std::cos(a)) / a));
    moved.rotate(Eigen::AngleAxisd(-a, Eigen::Vector3d::UnitY()));
    moved.translate(Eigen::Vector3d(-beam.length, 0, 0));
    return moved;
  });
}

// The tip face turns about the beam's axis and does not translate.
inline SolverScene twisted_beam(const Beam& beam, double angle, int steps) {
  return guided_beam(beam, steps, [&](double fraction) {
    Eigen::Isometry3d moved = Eigen::Isometry3d::Identity();
    moved.rotate(Eigen::AngleAxisd(fraction * angle, Eigen::Vector3d::UnitX()));
    return moved;
  });
}

// Position and rotation of the tip face in the x-z plane, and the moment about its centre.
struct TipState {
  Eigen::Vector3d centre;  // mean of the face's nodes, current configuration
  double angle = 0;        // radians, from x toward z, of the best-fit rotation
  Eigen::Vector3d moment;  // of the external forces on the face
};

inline TipState tip_state(const Beam& beam, const SolverScene& scene, const SceneRun& run) {
  const std::vector<int> tip = beam.tip(scene.model);
  const Eigen::Vector3d reference(beam.length, 0, 0);
  TipState state;
  state.centre = reference + sum_over(run.displacement, tip) / static_cast<double>(tip.size());
  state.moment.setZero();
  double along = 0;
  double across = 0;
  for (const int node : tip) {
    const Eigen::Vector3d& at = scene.model.positions[static_cast<std::size_t>(node)];
    const Eigen::Vector3d arm = at + run.displacement.segment<3>(3 * node) - state.centre;
    const Eigen::Vector3d force = run.force.segment<3>(3 * node);
    state.moment += arm.cross(force);
    along += arm.z() * at.z();
    across -= arm.x() * at.z();
  }
  state.angle = std::atan2(across, along);
  return state;
}

}  // namespace palpate::test
