// Mutual stiffness of two nodes of a deformed body, for tests of reciprocity (Betti).
#pragma once

#include <stdexcept>

#include "tests/support/scene_run.hpp"

namespace palpate::test {

// Force on each held node over the other node's displacement; one column for each axis moved.
struct ReciprocalForces {
  Eigen::Matrix3d at_a_due_to_b;
  Eigen::Matrix3d at_b_due_to_a;
  Eigen::Matrix3d at_a_due_to_a;
};

// Linearises about the final state of `run`. The scene leaves both nodes free.
inline ReciprocalForces reciprocal_forces(const SolverScene& scene, const SceneRun& run, int a, int b) {
  LoadCase load = scene.steps.back();
  for (const int node : {a, b}) hold_nodes(load, {node}, run.displacement.segment<3>(3 * node));
  Eigen::MatrixXd directions = Eigen::MatrixXd::Zero(scene.model.num_dofs(), 6);
  directions.block<3, 3>(3 * a, 0).setIdentity();
  directions.block<3, 3>(3 * b, 3).setIdentity();
  const Assembly assembly(scene.model, scene.model.fixed_dofs());
  StaticSolver solver(assembly);
  Eigen::MatrixXd response;
  if (!solver.tangent_response(load, run.displacement, directions, response))
    throw std::runtime_error("the tangent is not positive definite");
  const Eigen::MatrixXd force = assembly.tangent_times(run.displacement, response);
  return {force.block<3, 3>(3 * a, 3), force.block<3, 3>(3 * b, 0), force.block<3, 3>(3 * a, 0)};
}

}  // namespace palpate::test
