#include "offline/precompute/rest_state.hpp"

#include <fmt/core.h>

#include <stdexcept>

#include "offline/fem/step_loads.hpp"

namespace palpate {
namespace {

// Returns the nodal forces b of this acceleration: num_dofs.
Eigen::VectorXd gravity_forces(const Model& model, const Eigen::Vector3d& acceleration) {
  Step step;
  for (size_t element = 0; element < model.elements.size(); ++element)
    step.gravity.push_back({static_cast<int>(element), acceleration, kRamp});
  return StepLoads(model, step).at(1).force;
}

}  // namespace

LoadCase RestState::load_case(const Model& model) const {
  LoadCase load = LoadCase::rest(model);
  if (!is_mesh()) load.force = force;
  return load;
}

RestState find_rest(const Assembly& assembly, const Scene& scene) {
  RestState rest;
  if (!scene.gravity) return rest;
  const Model& model = assembly.model();
  rest.force = gravity_forces(model, *scene.gravity);
  rest.displacement.setZero(model.num_dofs());
  StaticSolver solver(assembly);
  const SolveReport report =
      solver.ramp(LoadCase::rest(model), rest.load_case(model), rest.displacement, SolverSettings());
  if (!report.converged) {
    throw std::runtime_error(
        fmt::format("{}: the organ finds no equilibrium under gravity (the solver reached {:.0f} % of it); "
                    "reduce gravity.acceleration, or hold more of the organ",
                    scene.file.string(), 100 * report.load_factor));
  }
  Eigen::VectorXd internal;
  assembly.internal_force(rest.displacement, internal, &rest.energy);
  rest.energy -= rest.force.dot(rest.displacement);
  if (!scene.gravity_may_turn) return rest;
  rest.per_gravity.resize(model.num_dofs(), 3);
  for (int axis = 0; axis < 3; ++axis)
    rest.per_gravity.col(axis) = gravity_forces(model, Eigen::Vector3d::Unit(axis));
  if (!solver.factorize_at(rest.load_case(model), rest.displacement, false) ||
      !solver.back_solve(rest.per_gravity)) {
    throw std::runtime_error(scene.file.string() +
                             ": the organ's rest under gravity is not stable; reduce gravity.acceleration");
  }
  return rest;
}

}  // namespace palpate
