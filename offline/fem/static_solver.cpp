#include "offline/fem/static_solver.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "offline/fem/equilibrium.hpp"
#include "offline/fem/load_path.hpp"
#include "offline/fem/stopwatch.hpp"

namespace palpate {
namespace {

// Armijo's constant: accepted fraction of the energy decrease that the slope predicts.
constexpr double kSufficientDecrease = 1e-4;
// A step that reduces the residual to this fraction is accepted without a test of the energy.
constexpr double kResidualDecrease = 0.9;
constexpr int kMaxBacktracks = 12;
// After an increment with at most this number of factors the next increment is 1.5 times as long.
constexpr int kEasyFactors = 7;
// Whole steps (s = 1) of an increment that may fail both tests of condition 2 (static_solver.hpp).
constexpr int kNonmonotoneSteps = 8;
// Largest accepted ratio of the body's motion to the motion that the tangent at the start or the end
// predicts. Near a limit point a larger ratio shows that the increment passes the limit point.
constexpr double kMaxMotionRatio = 1.5;
// A failing increment shows a limit point if its tangent predicts this multiple of the first motion per time.
constexpr double kLimitPace = 30;
constexpr double kNoPrediction = std::numeric_limits<double>::infinity();  // motion of a projected tangent

bool give_up(StopCause cause, SolveReport& report) {
  report.stopped = cause;
  return false;
}

void set_held_dofs(const LoadCase& load, Eigen::VectorXd& displacement) {
  for (Eigen::Index dof = 0; dof < displacement.size(); ++dof) {
    if (load.held[static_cast<size_t>(dof)]) displacement[dof] = load.displacement[dof];
  }
}

// The increments of follow(), in time from 0 to 1.
struct IncrementControl {
  const SolverSettings& settings;
  double increment = std::min({1.0, settings.first_increment, settings.largest_increment});
  double reached = 0;
  double off_path_time = std::numeric_limits<double>::infinity();  // an increment to this time left the path
  double first_pace = 0;  // predicted motion per time in the first increment

  void advance_to(double time, bool easy) {
    reached = time;
    if (easy) increment *= 1.5;
    increment = std::min({increment, settings.largest_increment, 1.0 - reached});
  }

  bool shows_limit_point(double pace) const {
    const bool soft = pace > kLimitPace * first_pace;
    return settings.keep_to_path && (soft || (off_path_time > reached && std::isfinite(off_path_time)));
  }
};

}  // namespace

StaticSolver::StaticSolver(const Assembly& assembly, LinearSolver linear_solver) : assembly_(&assembly) {
  const Stopwatch watch(seconds_.analysis);
  if (linear_solver == LinearSolver::cholesky) {
    cholesky_.emplace(assembly.analysis(), assembly.threads());
  } else {
    conjugate_gradient_.emplace();
  }
}

ElementState StaticSolver::internal_force(const Eigen::VectorXd& displacement, Eigen::VectorXd& force,
                                          double* energy) {
  const Stopwatch watch(seconds_.assembly);
  return assembly_->internal_force(displacement, force, energy);
}

double StaticSolver::stored_energy(const Eigen::VectorXd& displacement) {
  double energy = 0;
  Eigen::VectorXd force;
  internal_force(displacement, force, &energy);
  return energy;
}

// The state of newton(). The forces belong to `displacement` or to the last trial.
struct StaticSolver::NewtonState {
  StaticSolver& solver;
  const LoadCase& load;
  Eigen::VectorXd& displacement;
  SolveReport& report;
  ElementState elements = {};
  Eigen::VectorXd internal = {}, external = {}, residual_force = {};
  double norm = 0;                    // of the residual at `displacement`
  std::optional<double> energy = {};  // stored energy at `displacement`, once computed
  int nonmonotone_steps = 0;

  // Computes the forces of a trial. False if an element inverts.
  bool evaluate(const Eigen::VectorXd& trial) {
    elements = solver.internal_force(trial, internal);
    report.trouble_element = elements.worst_element;
    report.trouble_jacobian = elements.min_jacobian;
    if (!(elements.min_jacobian > 0)) return false;
    external = external_force(solver.assembly_->model(), load, trial);
    residual_force = out_of_balance(*solver.assembly_, load, internal, external);
    return true;
  }

  // Computes the forces at `displacement` again. Unlike evaluate(), leaves the report as it is.
  void restore() {
    elements = solver.internal_force(displacement, internal);
    external = external_force(solver.assembly_->model(), load, displacement);
    residual_force = out_of_balance(*solver.assembly_, load, internal, external);
  }

  // Moves `displacement` by the first accepted step along `direction`. Returns s; 0 if no step is accepted.
  // `may_rise`: a few whole steps may fail condition 2 (static_solver.hpp).
  double line_search(const Eigen::MatrixXd& direction, bool may_rise) {
    // Slope dPi/ds. The bound 0 forbids a rise of the energy where pressures let the direction point uphill.
    const double slope = std::min(0.0, -residual_force.dot(direction.col(0)));
    double step = 1.0;
    for (int backtrack = 0; backtrack <= kMaxBacktracks; ++backtrack, step *= 0.5) {
      const Eigen::VectorXd move = step * direction.col(0);
      const Eigen::VectorXd trial = displacement + move;
      if (!evaluate(trial)) continue;
      std::optional<double> trial_energy;
      const double trial_norm = residual_force.norm();
      bool falls = trial_norm <= kResidualDecrease * norm;
      if (!falls) {
        if (!energy) energy = solver.stored_energy(displacement);
        trial_energy = solver.stored_energy(trial);
        const double work = load.force.dot(move) +
                            pressure_work(solver.assembly_->model(), load.pressures, displacement, move);
        falls = *trial_energy - work <= *energy + kSufficientDecrease * step * slope;
      }
      const bool nonmonotone = !falls && may_rise && step == 1.0 && nonmonotone_steps < kNonmonotoneSteps &&
                               std::isfinite(trial_norm);
      if (falls || nonmonotone) {
        nonmonotone_steps += nonmonotone;
        displacement = trial;
        energy = trial_energy;
        norm = trial_norm;
        return step;
      }
    }
    return 0;
  }
};

bool StaticSolver::newton(const LoadCase& load, double load_factor, int increment,
                          Eigen::VectorXd& displacement, double start_force_scale,
                          const SolverSettings& settings, SolveReport& report,
                          const std::function<void(const IterationRecord&)>& progress) {
  NewtonState at = {*this, load, displacement, report};
  if (!at.evaluate(displacement)) return give_up(StopCause::inverted, report);
  at.norm = at.residual_force.norm();
  // The factor at hand belongs to the predictor or a nearby state; one back-solve tests its quality.
  bool reuse = settings.reuse_contraction > 0 && factor_fits(load);
  bool projected = false;
  const auto scale_now = [&] {
    return std::max({start_force_scale, force_scale(*assembly_, load, at.internal, at.external),
                     std::numeric_limits<double>::min()});
  };
  const auto is_rounding = [&] { return at.norm <= kRoundings * assembly_->rounding_force(displacement); };
  int fresh_iterations = 0;
  bool stalled = false;  // a whole step with a fresh factor did not reduce the residual
  for (int iteration = 1;; ++iteration) {
    const double scale = scale_now();
    if (!std::isfinite(at.norm)) return give_up(StopCause::not_finite, report);
    if (at.norm <= settings.residual_tolerance * scale || (stalled && is_rounding())) {
      report.residual = std::min(at.norm / scale, settings.residual_tolerance);
      report.min_jacobian = at.elements.min_jacobian;
      report.worst_element = at.elements.worst_element;
      return true;
    }
    if (fresh_iterations >= settings.max_iterations) return give_up(StopCause::iterations, report);

    Eigen::MatrixXd direction = at.residual_force;
    const bool fresh = !reuse;
    bool solved;
    if (fresh) {
      ++fresh_iterations;
      solved = factor_and_solve(load, displacement, direction, projected, report);
    } else {
      single_used_ = single_used_ || factor_precision_ == Precision::single_precision;
      solved = back_solve(direction);
    }
    if (!solved) return give_up(StopCause::no_tangent, report);
    if (iteration == 1) predicted_motion_ += projected ? kNoPrediction : direction.norm();
    const double norm_before = at.norm;
    IterationRecord record = {increment, load_factor, iteration};
    record.projected = projected;
    record.step = at.line_search(direction, fresh && !projected);
    ++report.iterations;
    if (record.step == 0.0) at.restore();
    record.residual = at.norm / scale_now();
    record.min_jacobian = at.elements.min_jacobian;
    report.history.push_back(record);
    if (progress) progress(record);
    if (record.step == 0.0) {  // an old factor gets a second attempt with a fresh factor
      if (fresh && !is_rounding()) return give_up(StopCause::no_descent, report);
      stalled = fresh;
      reuse = false;
      continue;
    }
    stalled = fresh && at.norm > kStall * norm_before;
    reuse = !projected && record.step == 1.0 && at.norm <= settings.reuse_contraction * norm_before;
  }
}

template <typename Attempt>
bool StaticSolver::in_either_precision(SolveReport& report, Attempt&& attempt) {
  const size_t rows_before = report.history.size();
  single_allowed_ = !conjugate_gradient_;
  single_used_ = false;
  bool converged = attempt();
  // Inverted elements and overflow occur in double precision too.
  const bool may_be_rounding = report.stopped == StopCause::no_tangent ||
                               report.stopped == StopCause::no_descent ||
                               report.stopped == StopCause::iterations;
  if (!converged && single_used_ && may_be_rounding) {
    report.history.resize(rows_before);
    single_allowed_ = false;
    forget_factor();
    converged = attempt();
  }
  if (converged) report.stopped = StopCause::none;
  return converged;
}

SolveReport StaticSolver::correct(const LoadCase& load, Eigen::VectorXd& displacement,
                                  const SolverSettings& settings) {
  SolveReport report;
  Eigen::VectorXd trial;
  report.converged = in_either_precision(report, [&] {
    trial = displacement;
    return newton(load, 1.0, 1, trial, 0.0, settings, report, {});
  });
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
  return follow(
      from, [&](double) { return to; }, displacement, settings, progress);
}

bool StaticSolver::take_increment(const LoadCase& load, double load_factor, int increment,
                                  Eigen::VectorXd& displacement, double start_force_scale,
                                  const SolverSettings& settings, SolveReport& report,
                                  const std::function<void(const IterationRecord&)>& progress) {
  predicted_motion_ = 0;
  Eigen::MatrixXd held_motion = Eigen::MatrixXd::Zero(assembly_->num_dofs(), 1);
  for (int dof = 0; dof < assembly_->num_dofs(); ++dof) {
    if (load.held[static_cast<size_t>(dof)]) held_motion(dof, 0) = load.displacement[dof] - displacement[dof];
  }
  if (held_motion.cwiseAbs().maxCoeff() > 0) {
    Eigen::MatrixXd response = -assembly_->tangent_times(displacement, held_motion);
    bool projected = false;
    if (!factor_and_solve(load, displacement, response, projected, report))
      return give_up(StopCause::no_tangent, report);
    displacement += (held_motion + response).col(0);
    predicted_motion_ = projected ? kNoPrediction : (held_motion + response).norm();
  }
  return newton(load, load_factor, increment, displacement, start_force_scale, settings, report, progress);
}

bool StaticSolver::stays_on_path(const LoadCase& before, const LoadCase& load, const Eigen::VectorXd& start,
                                 const Eigen::VectorXd& end, SolveReport& report) {
  const Eigen::VectorXd move = end - start;
  Eigen::VectorXd held_motion = move;
  for (int dof = 0; dof < assembly_->num_dofs(); ++dof) {
    if (!load.held[static_cast<size_t>(dof)]) held_motion[dof] = 0;
  }
  if (held_motion.isZero(0.0)) {
    constexpr double kRounding = 1e-9;
    const double energy = stored_energy(end);
    const double work =
        before.force.dot(move) + pressure_work(assembly_->model(), before.pressures, start, move);
    if (energy - stored_energy(start) < work - kRounding * (energy + std::abs(work))) return false;
  }
  const double motion = move.norm();
  if (motion <= kMaxMotionRatio * predicted_motion_) return true;
  Eigen::MatrixXd response = external_force(assembly_->model(), load, end) -
                             external_force(assembly_->model(), before, end) -
                             assembly_->tangent_times(end, held_motion).col(0);
  bool projected = false;
  if (!factor_and_solve(load, end, response, projected, report) || projected) return false;
  return motion <= kMaxMotionRatio * (held_motion + response.col(0)).norm();
}

SolveReport StaticSolver::follow(const LoadCase& from, const std::function<LoadCase(double)>& loads,
                                 Eigen::VectorXd& displacement, const SolverSettings& settings,
                                 const std::function<void(const IterationRecord&)>& progress) {
  SolveReport report;
  Eigen::VectorXd internal;
  const ElementState state = internal_force(displacement, internal);
  const double start_force_scale =
      force_scale(*assembly_, from, internal, external_force(assembly_->model(), from, displacement));
  report.min_jacobian = state.min_jacobian;
  report.worst_element = state.worst_element;

  const LoadPath path(from, loads, assembly_->model(), displacement, internal);

  IncrementControl control = {settings};
  while (control.reached < 1.0) {
    if (report.increments >= settings.max_increments) {
      report.stopped = StopCause::increments;
      return report;
    }
    const int attempt = report.increments + 1;
    // Extend the last increment instead of leaving a tiny remainder.
    const double end = control.reached + control.increment;
    const double target = end > 1.0 - 1e-9 ? 1.0 : end;
    const LoadCase load = path.at(target);

    Eigen::VectorXd trial;
    int factors_before = 0;
    bool converged = in_either_precision(report, [&] {
      trial = displacement;
      factors_before = report.factorizations;
      return take_increment(load, target, attempt, trial, start_force_scale, settings, report, progress);
    });
    const double pace = predicted_motion_ / (target - control.reached);
    if (control.first_pace == 0) control.first_pace = pace;
    const bool easy = report.factorizations - factors_before <= kEasyFactors;
    if (converged && settings.keep_to_path &&
        !stays_on_path(path.at(control.reached), load, displacement, trial, report)) {
      converged = false;
      control.off_path_time = target;
    }
    if (converged) {
      displacement = trial;
      set_held_dofs(load, displacement);  // exact at the end
      control.advance_to(target, easy);
      report.increments = attempt;
      report.load_factor = target;
    } else {
      ++report.cutbacks;
      control.increment = 0.5 * (target - control.reached);
      if (control.increment < settings.smallest_increment) {
        if (control.shows_limit_point(pace)) report.stopped = StopCause::limit_point;
        return report;
      }
    }
  }
  report.converged = true;
  report.stopped = StopCause::none;
  return report;
}

}  // namespace palpate
