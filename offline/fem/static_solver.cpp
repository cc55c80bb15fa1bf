#include "offline/fem/static_solver.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace palpate {
namespace {

// Armijo's constant: the energy must fall by this part of what the slope promises. Any small number serves.
constexpr double kSufficientDecrease = 1e-4;
// A residual that shrinks to this part of itself is progress whatever the energy's rounding says.
constexpr double kResidualDecrease = 0.9;
constexpr int kMaxBacktracks = 12;
// A residual within so many times the rounding of P is rounding too, once Newton stops reducing it.
constexpr double kRoundings = 4;
constexpr double kStall = 0.3;
// An increment that converged within this many iterations is followed by one half as large again.
constexpr int kEasyIterations = 6;

Assembly::SparseLower rest_stiffness(const Assembly& assembly) {
  Assembly::SparseLower stiffness;
  assembly.tangent(Eigen::VectorXd::Zero(assembly.num_dofs()), false, stiffness);
  return stiffness;
}

}  // namespace

LoadCase LoadCase::rest(const Model& model) {
  LoadCase load;
  load.held = model.fixed_dofs();
  load.displacement.setZero(model.num_dofs());
  load.force.setZero(model.num_dofs());
  return load;
}

StaticSolver::StaticSolver(const Assembly& assembly, LinearSolver linear_solver)
    : assembly_(&assembly), stiffness_(rest_stiffness(assembly)) {
  if (linear_solver == LinearSolver::cholesky) {
    cholesky_.emplace(stiffness_);
  } else {
    conjugate_gradient_.emplace();
  }
}

double StaticSolver::force_scale(const LoadCase& load, const Eigen::VectorXd& internal) const {
  double held = 0;
  double applied = 0;
  for (int dof = 0; dof < assembly_->num_dofs(); ++dof) {
    if (load.held[static_cast<size_t>(dof)]) {
      held += internal[dof] * internal[dof];
    } else if (assembly_->dof_equations()[static_cast<size_t>(dof)] >= 0) {
      applied += load.force[dof] * load.force[dof];
    }
  }
  return std::sqrt(held) + std::sqrt(applied);
}

void StaticSolver::residual(const LoadCase& load, const Eigen::VectorXd& internal,
                            Eigen::VectorXd& out) const {
  out = load.force - internal;
  for (int dof = 0; dof < assembly_->num_dofs(); ++dof) {
    if (load.held[static_cast<size_t>(dof)] || assembly_->dof_equations()[static_cast<size_t>(dof)] < 0)
      out[dof] = 0;
  }
}

bool StaticSolver::factorize_at(const LoadCase& load, const Eigen::VectorXd& displacement, bool project) {
  assembly_->tangent(displacement, project, stiffness_);
  const std::vector<int>& dofs = assembly_->equation_dofs();
  factored_held_.resize(dofs.size());
  for (size_t equation = 0; equation < dofs.size(); ++equation) {
    factored_held_[equation] = load.held[static_cast<size_t>(dofs[equation])];
  }
  // A held dof becomes the equation x = 0: its row and column are cleared, its diagonal stays as the scale.
  for (int column = 0; column < stiffness_.outerSize(); ++column) {
    const bool column_held = factored_held_[static_cast<size_t>(column)] != 0;
    for (Assembly::SparseLower::InnerIterator it(stiffness_, column); it; ++it) {
      if (it.row() != column && (column_held || factored_held_[static_cast<size_t>(it.row())]))
        it.valueRef() = 0;
    }
  }
  if (cholesky_) {
    factor_valid_ = cholesky_->factorize(stiffness_);
  } else {
    conjugate_gradient_->prepare(stiffness_);
    factor_valid_ = true;
  }
  return factor_valid_;
}

bool StaticSolver::factor_fits(const LoadCase& load) const {
  // An old matrix saves conjugate gradients nothing.
  if (!factor_valid_ || conjugate_gradient_) return false;
  const std::vector<int>& dofs = assembly_->equation_dofs();
  for (size_t equation = 0; equation < dofs.size(); ++equation) {
    if (factored_held_[equation] != load.held[static_cast<size_t>(dofs[equation])]) return false;
  }
  return true;
}

bool StaticSolver::solve_equations(Eigen::MatrixXd& columns) {
  if (cholesky_) {
    cholesky_->solve(columns);
    return true;
  }
  for (Eigen::Index column = 0; column < columns.cols(); ++column) {
    if (!conjugate_gradient_->solve(columns.col(column))) return false;
  }
  return true;
}

bool StaticSolver::factor_and_solve(const LoadCase& load, const Eigen::VectorXd& displacement,
                                    Eigen::MatrixXd& columns, bool& projected, SolveReport& report) {
  for (const bool project : {false, true}) {
    projected = project;
    ++report.factorizations;
    if (!factorize_at(load, displacement, project)) continue;
    Eigen::MatrixXd solution = columns;
    if (!back_solve(solution)) continue;
    columns = std::move(solution);
    return true;
  }
  return false;
}

bool StaticSolver::back_solve(Eigen::MatrixXd& columns) {
  const std::vector<int>& dofs = assembly_->equation_dofs();
  Eigen::MatrixXd packed(static_cast<Eigen::Index>(dofs.size()), columns.cols());
  for (size_t equation = 0; equation < dofs.size(); ++equation) {
    const Eigen::Index row = static_cast<Eigen::Index>(equation);
    if (factored_held_[equation]) {
      packed.row(row).setZero();
    } else {
      packed.row(row) = columns.row(dofs[equation]);
    }
  }
  if (!solve_equations(packed)) return false;
  columns.setZero();
  for (size_t equation = 0; equation < dofs.size(); ++equation) {
    columns.row(dofs[equation]) = packed.row(static_cast<Eigen::Index>(equation));
  }
  return true;
}

bool StaticSolver::newton(const LoadCase& load, double load_factor, int increment,
                          Eigen::VectorXd& displacement, double start_scale, const SolverSettings& settings,
                          SolveReport& report, const std::function<void(const IterationRecord&)>& progress) {
  Eigen::VectorXd internal;
  Eigen::VectorXd residual_force;
  double energy = 0;
  ElementState state = assembly_->internal_force(displacement, internal, &energy);
  if (!(state.min_jacobian > 0)) return false;
  residual(load, internal, residual_force);
  double norm = residual_force.norm();
  energy -= load.force.dot(displacement);
  bool reuse =
      factor_fits(load);  // of the predictor, or of a neighbour: one back-solve tells whether it serves
  bool projected = false;

  const auto scale_of = [&](const Eigen::VectorXd& force) {
    return std::max({start_scale, force_scale(load, force), std::numeric_limits<double>::min()});
  };
  const auto is_rounding = [&](double force) {
    return force <= kRoundings * assembly_->rounding_force(displacement);
  };
  bool stalled = false;  // a whole step with a fresh factor left the residual as it was
  for (int iteration = 1;; ++iteration) {
    const double scale = scale_of(internal);
    if (!std::isfinite(norm)) return false;
    if (norm <= settings.residual_tolerance * scale || (stalled && is_rounding(norm))) {
      report.residual = norm / scale;
      report.min_jacobian = state.min_jacobian;
      report.worst_element = state.worst_element;
      return true;
    }
    if (iteration > settings.max_iterations) return false;

    Eigen::MatrixXd direction = residual_force;
    if (reuse) {
      if (!back_solve(direction)) return false;
    } else if (!factor_and_solve(load, displacement, direction, projected, report)) {
      return false;
    }
    const double slope = -residual_force.dot(direction.col(0));  // dPi/ds

    IterationRecord record;
    record.increment = increment;
    record.load_factor = load_factor;
    record.iteration = iteration;
    record.projected = projected;
    const double norm_before = norm;
    const bool fresh = !reuse;
    double step = 1.0;
    for (int backtrack = 0; backtrack <= kMaxBacktracks; ++backtrack, step *= 0.5) {
      const Eigen::VectorXd trial = displacement + step * direction.col(0);
      double trial_energy = 0;
      state = assembly_->internal_force(trial, internal, &trial_energy);
      trial_energy -= load.force.dot(trial);
      if (!(trial_energy < std::numeric_limits<double>::infinity())) continue;
      residual(load, internal, residual_force);
      const double trial_norm = residual_force.norm();
      if (trial_energy <= energy + kSufficientDecrease * step * slope ||
          trial_norm <= kResidualDecrease * norm_before) {
        displacement = trial;
        energy = trial_energy;
        norm = trial_norm;
        record.step = step;
        break;
      }
    }
    ++report.iterations;
    if (record.step == 0.0) {
      // No trial was accepted: put the state back, and if the factor was an old one, try again with a fresh
      // one.
      state = assembly_->internal_force(displacement, internal);
      residual(load, internal, residual_force);
    }
    record.residual = norm / scale_of(internal);
    record.min_jacobian = state.min_jacobian;
    report.history.push_back(record);
    if (progress) progress(record);
    if (record.step == 0.0) {
      if (fresh && !is_rounding(norm)) return false;
      stalled = fresh;
      reuse = false;
      continue;
    }
    stalled = fresh && norm > kStall * norm_before;
    reuse = !projected && record.step == 1.0 && norm <= settings.reuse_contraction * norm_before;
  }
}

SolveReport StaticSolver::correct(const LoadCase& load, Eigen::VectorXd& displacement,
                                  const SolverSettings& settings) {
  SolveReport report;
  Eigen::VectorXd trial = displacement;
  report.converged = newton(load, 1.0, 1, trial, 0.0, settings, report, {});
  if (report.converged) {
    report.increments = 1;
    report.load_factor = 1.0;
    displacement = trial;
  }
  return report;
}

SolveReport StaticSolver::ramp(const LoadCase& from, const LoadCase& to, Eigen::VectorXd& displacement,
                               const SolverSettings& settings,
                               const std::function<void(const IterationRecord&)>& progress) {
  SolveReport report;
  const int num_dofs = assembly_->num_dofs();
  // Where the ramp starts: what is held there, and the force that the outside applies at the dofs `to` leaves
  // free.
  Eigen::VectorXd start_force;
  const ElementState state = assembly_->internal_force(displacement, start_force);
  const double start_scale = force_scale(from, start_force);
  const Eigen::VectorXd start_displacement = displacement;
  for (int dof = 0; dof < num_dofs; ++dof) {
    if (!from.held[static_cast<size_t>(dof)]) start_force[dof] = from.force[dof];
  }
  report.min_jacobian = state.min_jacobian;
  report.worst_element = state.worst_element;

  const auto load_at = [&](double factor) {
    LoadCase load;
    load.held = to.held;
    load.displacement = start_displacement + factor * (to.displacement - start_displacement);
    load.force = start_force + factor * (to.force - start_force);
    if (factor == 1.0) {  // to the bit, which a sum with the start is not
      load.displacement = to.displacement;
      load.force = to.force;
    }
    for (int dof = 0; dof < num_dofs; ++dof) {
      if (to.held[static_cast<size_t>(dof)]) load.force[dof] = 0;
    }
    return load;
  };

  double reached = 0;
  double increment = std::min({1.0, settings.first_increment, settings.largest_increment});
  while (reached < 1.0) {
    if (report.increments >= settings.max_increments) return report;
    const int attempt = report.increments + 1;
    // A last increment that would leave a sliver is made whole.
    const double target = reached + increment > 1.0 - 1e-9 ? 1.0 : reached + increment;
    const LoadCase load = load_at(target);

    // Predictor: the held dofs move and the free ones follow along the tangent at the state before, so that
    // the elements beside a held node are not crushed by its jump.
    Eigen::VectorXd trial = displacement;
    Eigen::MatrixXd jump = Eigen::MatrixXd::Zero(num_dofs, 1);
    for (int dof = 0; dof < num_dofs; ++dof) {
      if (load.held[static_cast<size_t>(dof)]) jump(dof, 0) = load.displacement[dof] - displacement[dof];
    }
    bool converged = false;
    bool factored = true;
    if (jump.cwiseAbs().maxCoeff() > 0) {
      Eigen::MatrixXd follow = -assembly_->tangent_times(displacement, jump);
      bool projected = false;
      factored = factor_and_solve(load, displacement, follow, projected, report);
      if (factored) trial += (jump + follow).col(0);
    }
    const int iterations_before = report.iterations;
    if (factored) converged = newton(load, target, attempt, trial, start_scale, settings, report, progress);
    if (converged) {
      displacement = trial;
      for (int dof = 0; dof < num_dofs; ++dof) {
        if (load.held[static_cast<size_t>(dof)])
          displacement[dof] = load.displacement[dof];  // exact at the end
      }
      reached = target;
      report.increments = attempt;
      report.load_factor = reached;
      if (report.iterations - iterations_before <= kEasyIterations) increment *= 1.5;
      increment = std::min({increment, settings.largest_increment, 1.0 - reached});
    } else {
      ++report.cutbacks;
      increment = 0.5 * (target - reached);
      if (increment < settings.smallest_increment) return report;
    }
  }
  report.converged = true;
  return report;
}

bool StaticSolver::tangent_response(const LoadCase& load, const Eigen::VectorXd& displacement,
                                    const Eigen::MatrixXd& directions, Eigen::MatrixXd& response) {
  constexpr double kTolerance = 1e-10;
  constexpr double kContraction = 0.3;  // slower than this, a fresh factor is cheaper
  // With the exact factor the second correction is rounding: of 1e-16 times the condition of K. Above this
  // the answer would not have the digits that a fit needs.
  constexpr double kRounding = 1e-6;
  constexpr int kMaxSweeps = 40;
  // Iterative refinement: the factor at hand belongs to a state nearby, so 1 - K_0^-1 K is small.
  bool exact = false;
  if (!factor_fits(load)) {
    if (!factorize_at(load, displacement, false)) return false;
    exact = true;
  }
  const std::vector<int>& dofs = assembly_->equation_dofs();
  assembly_->tangent(displacement, false, stiffness_);
  Eigen::MatrixXd packed = directions(dofs, Eigen::all);
  double first = 0;
  double before = std::numeric_limits<double>::infinity();
  for (int sweep = 0; sweep < kMaxSweeps; ++sweep) {
    Eigen::MatrixXd correction = -(stiffness_.selfadjointView<Eigen::Lower>() * packed);
    for (size_t equation = 0; equation < dofs.size(); ++equation) {
      if (factored_held_[equation]) correction.row(static_cast<Eigen::Index>(equation)).setZero();
    }
    if (!solve_equations(correction)) return false;
    const double norm = correction.norm();
    if (!std::isfinite(norm)) return false;
    if (sweep == 0) first = std::max(norm, directions.norm());
    if (!exact && norm > kContraction * before) {
      if (!factorize_at(load, displacement, false)) return false;
      assembly_->tangent(displacement, false, stiffness_);
      exact = true;
      before = std::numeric_limits<double>::infinity();
      continue;
    }
    packed += correction;
    const bool only_rounding = exact && norm > kContraction * before && norm <= kRounding * first;
    if (norm <= kTolerance * first || only_rounding) {
      response = directions;
      response(dofs, Eigen::all) = packed;
      return true;
    }
    before = norm;
  }
  return false;
}

}  // namespace palpate
