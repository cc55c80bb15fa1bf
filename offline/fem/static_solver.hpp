// Static equilibrium of a nonlinear organ: Newton-Raphson with load increments and backtracking.
//
// Solves Phi(u) = f_ext(u) - P(u) = 0 (Zhong et al. 2005 eq. (6)) for the degrees of freedom that are not
// held. The path from rest decides which equilibrium is meant where there are several, so loads and held
// displacements ramp.
//
// One iteration: K(u) du = f_ext(u) - P(u) by one Cholesky factor, then backtracking u + s du, s = 1, 1/2,
// ... A trial is accepted only if det F > 0 in every element, small strain apart (eq. (1)'s stress is finite
// for det F < 0, so an iteration may converge to an inverted state unless it is forbidden to pass one), and
// if the total potential energy falls enough or the residual does. Either alone fails: the residual must be
// allowed to rise while a slender body turns, and the energy cannot be told from its rounding near the
// solution. Pressures that follow their faces have no potential; in the energy stands the work that they do
// on the way to the trial. Their tangent is not symmetric where a loaded patch has a free rim: the factor is
// of its symmetric part, or where that is indefinite of the body's projected tangent alone, and GMRES does
// the rest. Where K is not positive definite, the step is taken with the element tangents projected to
// positive semi-definite ones: still a descent direction of the energy.
//
// A slender or stiff body that turns is stretched by every whole step, as a step is straight: energy and
// residual both rise, and both merits would cut the steps to nothing. A few whole steps of a true tangent are
// therefore taken as they are.
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
  // Converged when |f_ext - P| over the free dofs is below this fraction of the force at play: |P| over the
  // held ones plus |f_ext| (all 2-norms), at the state or, if it is larger, where the ramp starts; an organ
  // let go has no force of its own. 1e-10 leaves reactions right to about 10 digits; Newton's last iteration
  // usually goes well below it.
  double residual_tolerance = 1e-10;
  // With a factor of their own, before an increment is tried in double precision, and then before it is cut.
  int max_iterations = 30;
  int max_increments =
      100;  // converged ones, as INC of *STEP; what is cut back is bounded by smallest_increment
  double first_increment = 1.0;  // fraction of the ramp
  double smallest_increment = 1e-5;
  double largest_increment = 1.0;
  // The factor of the previous iteration is used again while an iteration shrinks the residual at least to
  // this fraction (modified Newton: such an iteration costs a third of one with a factor of its own). 0 =
  // factor in every iteration.
  double reuse_contraction = 0.2;
  // Whether follow() stays on the path that it is on, and stops where a growing load has no equilibrium near:
  // an increment that moves the body further than the tangents at its ends explain is cut. Else Newton may go
  // over to another equilibrium, which bears the load too. Costs one factor for an increment that is suspect.
  bool keep_to_path = false;
};

// One line of the residual table.
struct IterationRecord {
  int increment = 0;
  double load_factor = 0;  // of the state that is sought
  int iteration = 0;
  double residual = 0;  // relative, as in SolverSettings::residual_tolerance
  double step = 0;      // accepted s; 0 = none was
  double min_jacobian = 1;
  bool projected = false;  // took the positive semi-definite tangent
};

// Wall time by what it was spent on, s.
struct SolveSeconds {
  double analysis = 0;  // ordering and symbolic factor, once
  double assembly = 0;  // internal forces and tangents
  double factor = 0;
  double back_solve = 0;
};

// Why a solve gave up: the last increment that was tried.
enum class StopCause {
  none,
  no_tangent,  // no factor, projected or not
  inverted,    // the increment's first guess inverts an element
  no_descent,  // no part of Newton's step is better than none
  iterations,  // max_iterations
  not_finite,  // the forces overflow
  increments,  // max_increments
  limit_point,  // with keep_to_path: however small the increment, the next equilibrium is far, or there is none
  sharp_turn,  // the path of ArcLength turns by more than it may over the smallest increment
  misled       // the sign of the current stiffness parameter would have the path of ArcLength walked back
};

struct SolveReport {
  bool converged = false;
  double load_factor = 0;  // reached: 1 when converged
  int increments = 0;      // converged
  int cutbacks = 0;
  int iterations = 0;
  int factorizations = 0;
  double residual = 0;      // relative, at the last converged state; at most the tolerance, also where only
                            // rounding is left
  double min_jacobian = 1;  // smallest det F there
  int worst_element = 0;    // index of that element
  StopCause stopped = StopCause::none;
  double trouble_jacobian = 1;           // smallest det F of the last state that was tried, converged or not
  int trouble_element = 0;               // and where
  std::vector<IterationRecord> history;  // of an increment tried in both precisions, the second try
};

// How K du = r is solved.
enum class LinearSolver { cholesky, conjugate_gradient };

class StaticSolver {
 public:
  // `assembly` must outlive the solver and eliminate only dofs that every load case holds at zero.
  explicit StaticSolver(const Assembly& assembly, LinearSolver linear_solver = LinearSolver::cholesky);

  // Follows the LoadPath of a step over its time, from `displacement`, the equilibrium of `from`, to that of
  // loads(1). On failure `displacement` is the last converged state and `report.load_factor` the time it
  // belongs to. `progress` (may be empty) is called after every iteration.
  SolveReport follow(const LoadCase& from, const std::function<LoadCase(double)>& loads,
                     Eigen::VectorXd& displacement, const SolverSettings& settings,
                     const std::function<void(const IterationRecord&)>& progress = {});

  // Along the straight line from `from` to `to`.
  SolveReport ramp(const LoadCase& from, const LoadCase& to, Eigen::VectorXd& displacement,
                   const SolverSettings& settings,
                   const std::function<void(const IterationRecord&)>& progress = {});

  // Newton from a guess that already has the held displacements of `load`: for warm starts near the answer.
  // On failure `displacement` is unchanged.
  SolveReport correct(const LoadCase& load, Eigen::VectorXd& displacement, const SolverSettings& settings);

  // du for given changes of the held dofs at an equilibrium, and of the outer forces on the free ones where
  // there are such: columns of `directions` (num_dofs rows, nonzero at held dofs only) and of `forces` (as
  // many, or none) -> full-length columns with the directions at held dofs and the free dofs following,
  // K_ff du_f = df_f - K_fc du_c. The linearised DD function; exact to 1e-10, or to what the condition of K
  // leaves of 16 digits. Needs K positive definite there and no pressures; false where it is not, or leaves
  // fewer than six. Cost: K once, and two back-solves a column or more where the factor is of another state.
  [[nodiscard]] bool tangent_response(const LoadCase& load, const Eigen::VectorXd& displacement,
                                      const Eigen::MatrixXd& directions, Eigen::MatrixXd& response,
                                      const Eigen::MatrixXd& forces = {});

  // Factors K at `displacement` with the held dofs of `load` taken out. False where it is not positive
  // definite; conjugate gradients find that out in the solve.
  [[nodiscard]] bool factorize_at(const LoadCase& load, const Eigen::VectorXd& displacement, bool project);

  // Solves K_ff x_f = b_f with the factor at hand; rows at held dofs are ignored and come back zero. False
  // where conjugate gradients found K not positive definite.
  [[nodiscard]] bool back_solve(Eigen::MatrixXd& columns);

  // The next solve starts with a factor of its own: its path then does not depend on what was solved before.
  void forget_factor() { factor_valid_ = false; }

  const Assembly& assembly() const { return *assembly_; }

  // Of one factor; 0 with conjugate gradients.
  double factor_operations() const { return cholesky_ ? assembly_->analysis().factor_operations() : 0; }

  // Of all it did since it was made.
  const SolveSeconds& seconds() const { return seconds_; }
  long num_factorizations() const { return num_factorizations_; }

 private:
  bool newton(const LoadCase& load, double load_factor, int increment, Eigen::VectorXd& displacement,
              double start_scale, const SolverSettings& settings, SolveReport& report,
              const std::function<void(const IterationRecord&)>& progress);
  // From one equilibrium to the next. Predictor: the held dofs move and the free ones follow along the
  // tangent at the state before, so that the elements beside a held node are not crushed by its jump. Then
  // Newton. On failure `displacement` means nothing.
  bool take_increment(const LoadCase& load, double load_factor, int increment, Eigen::VectorXd& displacement,
                      double start_scale, const SolverSettings& settings, SolveReport& report,
                      const std::function<void(const IterationRecord&)>& progress);
  // Whether an increment from one equilibrium to another is a piece of one path. It is not where the body has
  // less potential energy at its end under the loads of its start, into which it would have fallen, or where
  // it moved further than the tangents at both ends explain.
  bool stays_on_path(const LoadCase& before, const LoadCase& load, const Eigen::VectorXd& start,
                     const Eigen::VectorXd& end, SolveReport& report);
  // Tries with factors in single precision, where they serve, and if that fails in double: near an unstable
  // equilibrium the rounding of single grows where that of double does not yet.
  template <typename Attempt>
  bool in_either_precision(SolveReport& report, Attempt&& attempt);
  bool factor_fits(const LoadCase& load) const;  // there is a factor, with the held dofs of `load`
  // x of K x = columns over the equations, in place.
  bool solve_equations(Eigen::MatrixXd& columns);
  bool factorize_in(Precision precision, const LoadCase& load, const Eigen::VectorXd& displacement,
                    bool project);
  // As back_solve(), just after factorize_in(): corrects what a factor in single precision leaves, false
  // where it leaves too much.
  bool solve_accurately(Eigen::MatrixXd& columns);
  // Factors K, in single precision where that serves, projected where it is not positive definite, and solves
  // for the free dofs of `columns`.
  bool factor_and_solve(const LoadCase& load, const Eigen::VectorXd& displacement, Eigen::MatrixXd& columns,
                        bool& projected, SolveReport& report);
  // The rows of the equations of full-length columns, 0 where held; and back, 0 where there is no equation.
  Eigen::MatrixXd free_equations(const Eigen::MatrixXd& columns) const;
  void set_equations(const Eigen::MatrixXd& packed, Eigen::MatrixXd& columns) const;
  // K at a state, pressures included, in stiffness_.
  void assemble_tangent(const LoadCase& load, const Eigen::VectorXd& displacement, bool project);
  ElementState internal_force(const Eigen::VectorXd& displacement, Eigen::VectorXd& force,
                              double* energy = nullptr);
  double stored_energy(const Eigen::VectorXd& displacement);

  const Assembly* assembly_;
  Assembly::SparseLower stiffness_;
  std::optional<Cholesky> cholesky_;  // one of the two
  std::optional<ConjugateGradient> conjugate_gradient_;
  SolveSeconds seconds_;
  long num_factorizations_ = 0;
  std::vector<char> factored_held_;  // per equation, of the factor at hand
  double predicted_way_ = 0;  // of the last increment by its first tangent; infinite where that was projected
  bool factor_valid_ = false;
  bool factor_projected_ = false;
  Precision factor_precision_ = Precision::double_precision;
  bool single_serves_ = false;  // no tangent of this attempt was indefinite or too ill-conditioned yet
  bool single_served_ = false;  // a direction of this attempt came from a factor in single precision
};

}  // namespace palpate
