// Static equilibrium of a nonlinear organ: Newton-Raphson with load increments and backtracking.
//
// Solves Phi(u) = f_ext(u) - P(u) = 0 (Zhong et al. 2005 eq. (6)) for the free dofs, with P the internal
// forces. The path from rest selects the equilibrium, so loads and held displacements ramp.
//
// An iteration solves K(u) du = f_ext(u) - P(u), then tries u + s du, s = 1, 1/2, ... A trial is accepted if:
//   1. det F > 0 in every element (except at small strain), and
//   2. the residual falls by a tenth, or the total potential energy by a small share of its predicted fall.
// Condition 1 excludes inverted states, where eq. (1) still gives finite stress. Condition 2 has two tests:
// the residual must rise while a slender body turns, and rounding hides the energy near the solution.
//
// Follower pressures have no potential; their work during the trial step enters the energy. Their tangent is
// unsymmetric at a free rim of the loaded patch: the solver factors the symmetric part, and GMRES corrects
// the difference. Where the symmetric part is indefinite, the solver factors projected element tangents, with
// negative eigenvalues set to 0. Without pressures, projected tangents give descent directions.
//
// A straight step stretches a slender or stiff body that turns: energy and residual both rise. An increment
// therefore accepts a few whole steps (s = 1) of an unprojected tangent that fail condition 2.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "offline/fem/assembly.hpp"
#include "offline/fem/cholesky.hpp"
#include "offline/fem/conjugate_gradient.hpp"
#include "offline/fem/load_case.hpp"

namespace palpate {

struct SolverSettings {
  // Tolerance of |f_ext - P| over the free dofs, relative to the force scale: |P| over held dofs plus |f_ext|
  // (2-norms). The larger scale of the current state and the ramp's start counts, as a released organ has no
  // force of its own. 1e-10 leaves about 10 digits in the reactions.
  double residual_tolerance = 1e-10;
  // Limit of fresh factors in each attempt of an increment: first in single, then in double precision.
  int max_iterations = 30;
  int max_increments = 100;          // converged increments, as INC of Abaqus' *STEP
  double first_increment = 1.0;      // fraction of the ramp
  double smallest_increment = 1e-5;  // the solve stops instead of a shorter increment
  double largest_increment = 1.0;
  // Modified Newton: the previous factor is reused while an iteration reduces the residual at least to this
  // fraction. 0 = factor in every iteration.
  double reuse_contraction = 0.2;
  // Keeps follow() on its path: an increment is cut where the body moves further than the tangents at both
  // ends predict. The solve then stops at a limit point of the load instead of jumping to another
  // equilibrium. Cost: one more factor for each increment that moves far.
  bool keep_to_path = false;
};

// One row of the residual table.
struct IterationRecord {
  int increment = 0;
  double load_factor = 0;  // load factor of the target state
  int iteration = 0;
  double residual = 0;  // relative, as in SolverSettings::residual_tolerance
  double step = 0;      // accepted s; 0 = none
  double min_jacobian = 1;
  bool projected = false;  // used the projected, positive semi-definite tangent
};

// Wall seconds by kind of work.
struct SolveSeconds {
  double analysis = 0;  // ordering and symbolic factor, once
  double assembly = 0;  // internal forces and tangents
  double factor = 0;
  double back_solve = 0;
};

// Why the last increment of a solve failed.
enum class StopCause {
  none,
  no_tangent,    // no factor, projected or not
  inverted,      // the increment's first guess inverts an element
  no_descent,    // backtracking found no acceptable step
  iterations,    // max_iterations
  not_finite,    // the forces overflow
  increments,    // max_increments
  limit_point,   // with keep_to_path: no near equilibrium after the smallest increment
  sharp_turn,    // ArcLength: the path turns too sharply over the smallest increment
  path_reversed  // ArcLength: the sign of the current stiffness parameter reverses the path
};

struct SolveReport {
  bool converged = false;
  double load_factor = 0;  // 1 when converged
  int increments = 0;      // converged increments
  int cutbacks = 0;
  int iterations = 0;
  int factorizations = 0;
  double residual = 0;      // relative, at the last converged state; at most the tolerance
  double min_jacobian = 1;  // smallest det F of the state
  int worst_element = 0;    // index of the element with min_jacobian
  StopCause stopped = StopCause::none;
  double trouble_jacobian = 1;           // smallest det F of the last trial state, converged or not
  int trouble_element = 0;               // index of the element with trouble_jacobian
  std::vector<IterationRecord> history;  // an increment tried in both precisions keeps its second history
};

// Method for K du = r.
enum class LinearSolver { cholesky, conjugate_gradient };

class StaticSolver {
 public:
  // `assembly` must outlive the solver and eliminate only dofs that every load case holds at zero.
  explicit StaticSolver(const Assembly& assembly, LinearSolver linear_solver = LinearSolver::cholesky);

  // Follows the LoadPath of a step from `displacement`, the equilibrium of `from`, to the equilibrium of
  // loads(1). On failure `displacement` is the last converged state, at `report.load_factor`.
  // `progress` (may be empty) is called after every iteration.
  SolveReport follow(const LoadCase& from, const std::function<LoadCase(double)>& loads,
                     Eigen::VectorXd& displacement, const SolverSettings& settings,
                     const std::function<void(const IterationRecord&)>& progress = {});

  // Ramps the loads linearly from `from` to `to`.
  SolveReport ramp(const LoadCase& from, const LoadCase& to, Eigen::VectorXd& displacement,
                   const SolverSettings& settings,
                   const std::function<void(const IterationRecord&)>& progress = {});

  // Newton from a nearby guess that already has the held displacements of `load`. On failure `displacement`
  // is unchanged.
  SolveReport correct(const LoadCase& load, Eigen::VectorXd& displacement, const SolverSettings& settings);

  // Solves K_ff du_f = df_f - K_fc du_c at an equilibrium: the linearised DD function. `directions` are
  // columns du_c of num_dofs rows, nonzero at held dofs only; `forces` are as many columns df, or empty.
  // Returns columns du exact to 1e-10 or to the condition of K. Returns false under pressures and where K is
  // indefinite or leaves fewer than six digits. Cost: one assembly; two or more back-solves a column with an
  // old factor.
  [[nodiscard]] bool tangent_response(const LoadCase& load, const Eigen::VectorXd& displacement,
                                      const Eigen::MatrixXd& directions, Eigen::MatrixXd& response,
                                      const Eigen::MatrixXd& forces = {});

  // Factors K at `displacement` without the held dofs of `load`. Returns false where K is not positive
  // definite; conjugate gradients detect this only in the solve.
  [[nodiscard]] bool factorize_at(const LoadCase& load, const Eigen::VectorXd& displacement, bool project);

  // Solves K_ff x_f = b_f with the current factor. Ignores rows at held dofs and sets them to 0. Returns
  // false if conjugate gradients fail.
  [[nodiscard]] bool back_solve(Eigen::MatrixXd& columns);

  // Forces a fresh factor in the next solve: its result then does not depend on earlier solves.
  void forget_factor() { factor_valid_ = false; }

  const Assembly& assembly() const { return *assembly_; }

  // Returns the operations of one factor; 0 with conjugate gradients.
  double factor_operations() const { return cholesky_ ? assembly_->analysis().factor_operations() : 0; }

  // Sums over the life of the object.
  const SolveSeconds& seconds() const { return seconds_; }
  long num_factorizations() const { return num_factorizations_; }

 private:
  struct NewtonState;

  bool newton(const LoadCase& load, double load_factor, int increment, Eigen::VectorXd& displacement,
              double start_force_scale, const SolverSettings& settings, SolveReport& report,
              const std::function<void(const IterationRecord&)>& progress);
  // Takes one increment between equilibria. Predictor: held dofs move, and free dofs follow the tangent of
  // the previous state. The predictor keeps elements beside a held node from inversion. Newton corrects. On
  // failure `displacement` is undefined.
  bool take_increment(const LoadCase& load, double load_factor, int increment, Eigen::VectorXd& displacement,
                      double start_force_scale, const SolverSettings& settings, SolveReport& report,
                      const std::function<void(const IterationRecord&)>& progress);
  // Whether an increment stays on one path. The increment left the path where:
  //   1. no held dof moves, and under the loads of the start its end has less energy than its start, or
  //   2. the body moved further than each of the tangents at both ends predicts.
  bool stays_on_path(const LoadCase& before, const LoadCase& load, const Eigen::VectorXd& start,
                     const Eigen::VectorXd& end, SolveReport& report);
  // Calls attempt() with single-precision factors where suitable. Calls attempt() again in double precision
  // if rounding may be the cause of a failure: rounding grows near an unstable equilibrium.
  template <typename Attempt>
  bool in_either_precision(SolveReport& report, Attempt&& attempt);
  bool factor_fits(const LoadCase& load) const;  // whether a factor exists with the held dofs of `load`
  // Solves K x = columns over the equations, in place.
  bool solve_equations(Eigen::MatrixXd& columns);
  bool factorize_in(Precision precision, const LoadCase& load, const Eigen::VectorXd& displacement,
                    bool project);
  // Solves like back_solve() and refines the solution of a single-precision factor. Returns false where the
  // refinement fails.
  bool solve_accurately(Eigen::MatrixXd& columns);
  // Factors K and solves for the free dofs of `columns`. Uses single precision where suitable, and a
  // projected tangent where K is not positive definite.
  bool factor_and_solve(const LoadCase& load, const Eigen::VectorXd& displacement, Eigen::MatrixXd& columns,
                        bool& projected, SolveReport& report);
  // Gathers the rows of the equations, 0 where held, from full-length columns; scatters them, 0 elsewhere.
  Eigen::MatrixXd gather_equations(const Eigen::MatrixXd& columns) const;
  void scatter_equations(const Eigen::MatrixXd& packed, Eigen::MatrixXd& columns) const;
  // Assembles K at a state into stiffness_, pressures included.
  void assemble_tangent(const LoadCase& load, const Eigen::VectorXd& displacement, bool project);
  ElementState internal_force(const Eigen::VectorXd& displacement, Eigen::VectorXd& force,
                              double* energy = nullptr);
  double stored_energy(const Eigen::VectorXd& displacement);

  const Assembly* assembly_;
  Assembly::SparseLower stiffness_;
  std::optional<Cholesky> cholesky_;  // either cholesky_ or conjugate_gradient_ has a value
  std::optional<ConjugateGradient> conjugate_gradient_;
  SolveSeconds seconds_;
  long num_factorizations_ = 0;
  std::vector<char> factored_held_;  // per equation, for the current factor
  double predicted_motion_ = 0;  // motion that the first tangent predicts; infinite for a projected tangent
  bool factor_valid_ = false;
  bool factor_projected_ = false;
  Precision factor_precision_ = Precision::double_precision;
  bool single_allowed_ = false;  // until this attempt meets an indefinite or ill-conditioned tangent
  bool single_used_ = false;     // a direction of this attempt used a single-precision factor
};

}  // namespace palpate
