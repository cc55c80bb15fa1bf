// The linear equations of StaticSolver: tangents, factors and solves, in single and double precision.
#include <cmath>
#include <limits>
#include <utility>

#include "offline/fem/equilibrium.hpp"
#include "offline/fem/static_solver.hpp"
#include "offline/fem/stopwatch.hpp"

namespace palpate {

void StaticSolver::assemble_tangent(const LoadCase& load, const Eigen::VectorXd& displacement, bool project) {
  const Stopwatch watch(seconds_.assembly);
  assembly_->tangent(displacement, project, stiffness_);
  // The pressures' tangent has eigenvalues of either sign and would undo the projection.
  if (!project) subtract_pressure_tangent(*assembly_, load.pressures, displacement, stiffness_);
}

bool StaticSolver::factorize_at(const LoadCase& load, const Eigen::VectorXd& displacement, bool project) {
  return factorize_in(Precision::double_precision, load, displacement, project);
}

bool StaticSolver::factorize_in(Precision precision, const LoadCase& load,
                                const Eigen::VectorXd& displacement, bool project) {
  factor_valid_ = false;  // invalid also if an allocation below throws
  ++num_factorizations_;
  factor_precision_ = precision;
  factor_projected_ = project;
  assemble_tangent(load, displacement, project);
  factored_held_ = held_equations(*assembly_, load);
  hold_equations(factored_held_, stiffness_);
  const Stopwatch watch(seconds_.factor);
  if (cholesky_) {
    factor_valid_ = cholesky_->factorize(stiffness_, precision);
  } else {
    conjugate_gradient_->prepare(stiffness_);
    factor_valid_ = true;
  }
  return factor_valid_;
}

bool StaticSolver::factor_fits(const LoadCase& load) const {
  // Conjugate gradients gain nothing from an old matrix.
  if (!factor_valid_ || factor_projected_ || conjugate_gradient_) return false;
  return factored_held_ == held_equations(*assembly_, load);
}

bool StaticSolver::solve_equations(Eigen::MatrixXd& columns) {
  const Stopwatch watch(seconds_.back_solve);
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
    for (const Precision precision : {Precision::single_precision, Precision::double_precision}) {
      const bool single = precision == Precision::single_precision;
      if (single && (project || !single_allowed_)) continue;
      // A failure in single precision indicates an ill-conditioned tangent or an unstable equilibrium. The
      // rest of the increment uses double precision.
      single_allowed_ = single;
      ++report.factorizations;
      if (!factorize_in(precision, load, displacement, project)) continue;
      if (!load.pressures.empty()) {
        const auto precondition = [&](Eigen::VectorXd& v) {
          Eigen::MatrixXd column = v;
          if (!back_solve(column)) return false;
          v = column.col(0);
          return true;
        };
        Eigen::VectorXd column = columns.col(0);
        if (solve_with_pressures(*assembly_, load, displacement, precondition, column)) {
          single_used_ = single_used_ || single;
          columns = column;
          projected = false;
          return true;
        }
      }
      Eigen::MatrixXd solution = columns;
      if (solve_accurately(solution)) {
        single_used_ = single_used_ || single;
        columns = std::move(solution);
        return true;
      }
    }
  }
  return false;
}

bool StaticSolver::solve_accurately(Eigen::MatrixXd& columns) {
  if (factor_precision_ == Precision::double_precision) return back_solve(columns);
  // Accepted relative residual of a solve with a single-precision factor; Newton's next residual is seldom
  // smaller. One correction usually suffices; a factor that needs more than two costs more than it saves.
  constexpr double kAccuracy = 1e-4;
  constexpr int kCorrections = 2;
  const Eigen::MatrixXd right_hand_sides = gather_equations(columns);
  Eigen::MatrixXd residual = right_hand_sides;
  Eigen::MatrixXd solution = Eigen::MatrixXd::Zero(right_hand_sides.rows(), right_hand_sides.cols());
  for (int correction = 0; correction <= kCorrections; ++correction) {
    if (!solve_equations(residual)) return false;
    solution += residual;
    residual = right_hand_sides - stiffness_.selfadjointView<Eigen::Lower>() * solution;
    if (residual.norm() <= kAccuracy * right_hand_sides.norm()) {
      scatter_equations(solution, columns);
      return true;
    }
  }
  return false;
}

Eigen::MatrixXd StaticSolver::gather_equations(const Eigen::MatrixXd& columns) const {
  Eigen::MatrixXd packed = columns(assembly_->equation_dofs(), Eigen::all);
  for (Eigen::Index equation = 0; equation < packed.rows(); ++equation) {
    if (factored_held_[static_cast<size_t>(equation)]) packed.row(equation).setZero();
  }
  return packed;
}

void StaticSolver::scatter_equations(const Eigen::MatrixXd& packed, Eigen::MatrixXd& columns) const {
  columns.setZero();
  columns(assembly_->equation_dofs(), Eigen::all) = packed;
}

bool StaticSolver::back_solve(Eigen::MatrixXd& columns) {
  Eigen::MatrixXd packed = gather_equations(columns);
  if (!solve_equations(packed)) return false;
  scatter_equations(packed, columns);
  return true;
}

bool StaticSolver::tangent_response(const LoadCase& load, const Eigen::VectorXd& displacement,
                                    const Eigen::MatrixXd& directions, Eigen::MatrixXd& response,
                                    const Eigen::MatrixXd& forces) {
  constexpr double kTolerance = 1e-10;
  constexpr double kContraction = 0.3;  // a slower contraction costs more than a fresh factor
  // With the exact factor the second correction is rounding, about eps times the condition of K. Above this
  // bound the solution has too few digits.
  constexpr double kRounding = 1e-6;
  constexpr int kMaxSweeps = 40;
  if (!load.pressures.empty()) return false;
  // Iterative refinement: the factor belongs to a nearby state, so 1 - K_0^-1 K is small.
  bool exact = false;
  if (!factor_fits(load)) {
    if (!factorize_at(load, displacement, false)) return false;
    exact = true;
  }
  const std::vector<int>& dofs = assembly_->equation_dofs();
  assemble_tangent(load, displacement, false);
  Eigen::MatrixXd packed = directions(dofs, Eigen::all);
  double scale = 0;
  double last_norm = std::numeric_limits<double>::infinity();
  for (int sweep = 0; sweep < kMaxSweeps; ++sweep) {
    Eigen::MatrixXd correction = -(stiffness_.selfadjointView<Eigen::Lower>() * packed);
    if (forces.size() > 0) correction += forces(dofs, Eigen::all);
    for (size_t equation = 0; equation < dofs.size(); ++equation) {
      if (factored_held_[equation]) correction.row(static_cast<Eigen::Index>(equation)).setZero();
    }
    if (!solve_equations(correction)) return false;
    const double norm = correction.norm();
    if (!std::isfinite(norm)) return false;
    if (sweep == 0) scale = std::max(norm, directions.norm());
    if (!exact && norm > kContraction * last_norm) {
      if (!factorize_at(load, displacement, false)) return false;
      assemble_tangent(load, displacement, false);
      exact = true;
      last_norm = std::numeric_limits<double>::infinity();
      continue;
    }
    packed += correction;
    const bool only_rounding = exact && norm > kContraction * last_norm && norm <= kRounding * scale;
    if (norm <= kTolerance * scale || only_rounding) {
      response = directions;
      response(dofs, Eigen::all) = packed;
      return true;
    }
    last_norm = norm;
  }
  return false;
}

}  // namespace palpate
