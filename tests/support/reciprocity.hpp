// What two nodes of a deformed body feel of each other's small motions.
#pragma once

#include <stdexcept>

#include "tests/support/scene_run.hpp"

namespace palpate::test {

// Forces over displacements, held where they are for small motions of the two nodes, a column for each axis
// moved.
struct ReciprocalForces {
  Eigen::Matrix3d at_a_due_to_b;
  Eigen::Matrix3d at_b_due_to_a;
  Eigen::Matrix3d at_a_due_to_a;
};

// About the state that `run` ended in. The nodes are free in the scene.
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
