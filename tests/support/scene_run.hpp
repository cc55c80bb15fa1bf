// A model with its load steps, and the solver's record of the run. Shared by the solver's hard tests and
// bench/solver, which prints the figures.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <map>
#include <vector>

#include "offline/fem/static_solver.hpp"

namespace palpate::test {

struct SolverScene {
  Model model;
  std::vector<LoadCase> steps;  // one ramp each; the first starts from rest
};

struct SceneRun {
  bool converged = true;  // true if every step converged
  double steps_done = 0;  // with the fraction of the step that failed
  int increments = 0;
  int cutbacks = 0;
  int iterations = 0;
  int factorizations = 0;
  int projected = 0;        // iterations that used the positive semidefinite tangent
  double min_jacobian = 1;  // smallest det F over the converged states
  double seconds = 0;
  Eigen::VectorXd displacement;
  Eigen::VectorXd force;  // external force at every node
  std::vector<IterationRecord> history;
};

inline SceneRun run_scene(const SolverScene& scene, const SolverSettings& settings = {}) {
  const auto start = std::chrono::steady_clock::now();
  const Assembly assembly(scene.model, scene.model.fixed_dofs());
  StaticSolver solver(assembly);
  SceneRun run;
  run.displacement.setZero(scene.model.num_dofs());
  LoadCase before = LoadCase::rest(scene.model);
  for (const LoadCase& load : scene.steps) {
    const SolveReport report = solver.ramp(before, load, run.displacement, settings);
    run.steps_done += report.load_factor;
    run.increments += report.increments;
    run.cutbacks += report.cutbacks;
    run.iterations += report.iterations;
    run.factorizations += report.factorizations;
    run.min_jacobian = std::min(run.min_jacobian, report.min_jacobian);
    for (const IterationRecord& record : report.history) {
      run.projected += record.projected ? 1 : 0;
      run.history.push_back(record);
    }
    run.converged = report.converged;
    if (!report.converged) break;
    before = load;
  }
  assembly.internal_force(run.displacement, run.force);
  run.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return run;
}

// Holds all three displacements of these nodes.
inline void hold_nodes(LoadCase& load, const std::vector<int>& nodes, const Eigen::Vector3d& displacement) {
  for (const int node : nodes) {
    for (int axis = 0; axis < 3; ++axis) load.held[static_cast<std::size_t>(3 * node + axis)] = 1;
    load.displacement.segment<3>(3 * node) = displacement;
  }
}

// A uniform traction with the resultant `total` over the plane face of `nodes`. Consistent nodal forces: a
// third of a triangle's share to each corner, or to each middle node of a six-node triangle.
inline void spread_over_face(LoadCase& load, const Model& model, const std::vector<int>& nodes,
                             const Eigen::Vector3d& total) {
  std::vector<char> on_face(model.positions.size(), 0);
  for (const int node : nodes) on_face[static_cast<std::size_t>(node)] = 1;
  std::map<int, double> share;
  double area = 0;
  for (const Tetrahedron& element : model.elements) {
    std::vector<int> bearers;
    std::vector<Eigen::Vector3d> corners;
    for (const int node : element.corners()) {
      if (on_face[static_cast<std::size_t>(node)])
        corners.push_back(model.positions[static_cast<std::size_t>(node)]);
    }
    if (corners.size() != 3) continue;
    for (const int node : element.num_nodes == 4 ? element.nodes() : element.nodes().subspan(4)) {
      if (on_face[static_cast<std::size_t>(node)]) bearers.push_back(node);
    }
    const double triangle = 0.5 * (corners[1] - corners[0]).cross(corners[2] - corners[0]).norm();
    for (const int node : bearers) share[node] += triangle / 3;
    area += triangle;
  }
  for (const auto& [node, part] : share) load.force.segment<3>(3 * node) += part / area * total;
}

inline Eigen::Vector3d sum_over(const Eigen::VectorXd& nodal, const std::vector<int>& nodes) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const int node : nodes) sum += nodal.segment<3>(3 * node);
  return sum;
}

}  // namespace palpate::test
