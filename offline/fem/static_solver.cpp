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

bool StaticSolver::newton(const LoadCase& load, double load_factor, int increment,
                          Eigen::VectorXd& displacement, double start_force_scale,
                          const SolverSettings& settings, SolveReport& report,
                          const std::function<void(const IterationRecord&)>& progress) {
  Eigen::VectorXd internal;
  ElementState state = internal_force(displacement, internal);
  const auto give_up = [&](StopCause cause) {
    report.stopped = cause;
    return false;
  };
  const auto note_trouble = [&] {
    report.trouble_element = state.worst_element;
    report.trouble_jacobian = state.min_jacobian;
  };
  note_trouble();
  if (!(state.min_jacobian > 0)) return give_up(StopCause::inverted);
  Eigen::VectorXd external = external_force(assembly_->model(), load, displacement);
  Eigen::VectorXd residual_force = out_of_balance(*assembly_, load, internal, external);
  double norm = residual_force.norm();
  // The factor at hand belongs to the predictor or a nearby state; one back-solve tests its quality.
  bool reuse = settings.reuse_contraction > 0 && factor_fits(load);
  bool projected = false;

  const auto scale_now = [&] {
    return std::max({start_force_scale, force_scale(*assembly_, load, internal, external),
                     std::numeric_limits<double>::min()});
  };
  const auto is_rounding = [&](double force) {
    return force <= kRoundings * assembly_->rounding_force(displacement);
  };
  std::optional<double> energy;  // stored energy at `displacement`, once computed
  int nonmonotone_steps = 0;
  int fresh_iterations = 0;
  bool stalled = false;  // a whole step with a fresh factor did not reduce the residual
  for (int iteration = 1;; ++iteration) {
    const double scale = scale_now();
    if (!std::isfinite(norm)) return give_up(StopCause::not_finite);
    if (norm <= settings.residual_tolerance * scale || (stalled && is_rounding(norm))) {
      report.residual = std::min(norm / scale, settings.residual_tolerance);
      report.min_jacobian = state.min_jacobian;
      report.worst_element = state.worst_element;
      return true;
    }
    if (fresh_iterations >= settings.max_iterations) return give_up(StopCause::iterations);

    Eigen::MatrixXd direction = residual_force;
    if (reuse) {
      single_used_ = single_used_ || factor_precision_ == Precision::single_precision;
      if (!back_solve(direction)) return give_up(StopCause::no_tangent);
    } else {
      ++fresh_iterations;
      if (!factor_and_solve(load, displacement, direction, projected, report))
        return give_up(StopCause::no_tangent);
    }
    if (iteration == 1) predicted_motion_ += projected ? kNoPrediction : direction.norm();
    // Slope dPi/ds. The bound 0 forbids a rise of the energy where pressures let the direction point uphill.
    const double slope = std::min(0.0, -residual_force.dot(direction.col(0)));

    IterationRecord record;
    record.increment = increment;
    record.load_factor = load_factor;
    record.iteration = iteration;
    record.projected = projected;
    const double norm_before = norm;
    const bool fresh = !reuse;
    double step = 1.0;
    std::optional<double> trial_energy;
    for (int backtrack = 0; backtrack <= kMaxBacktracks; ++backtrack, step *= 0.5) {
      const Eigen::VectorXd move = step * direction.col(0);
      const Eigen::VectorXd trial = displacement + move;
      trial_energy.reset();
      state = internal_force(trial, internal);
      note_trouble();
      if (!(state.min_jacobian > 0)) continue;
      external = external_force(assembly_->model(), load, trial);
      residual_force = out_of_balance(*assembly_, load, internal, external);
      const double trial_norm = residual_force.norm();
      bool falls = trial_norm <= kResidualDecrease * norm_before;
      if (!falls) {
        if (!energy) energy = stored_energy(displacement);
        trial_energy = stored_energy(trial);
        const double work =
            load.force.dot(move) + pressure_work(assembly_->model(), load.pressures, displacement, move);
        falls = *trial_energy - work <= *energy + kSufficientDecrease * step * slope;
      }
      const bool nonmonotone = !falls && fresh && !projected && step == 1.0 &&
                               nonmonotone_steps < kNonmonotoneSteps && std::isfinite(trial_norm);
      if (falls || nonmonotone) {
        nonmonotone_steps += nonmonotone;
        displacement = trial;
        energy = trial_energy;
        norm = trial_norm;
        record.step = step;
        break;
      }
    }
    ++report.iterations;
    if (record.step == 0.0) {
      // No trial was accepted: restore the state. An old factor gets a second attempt with a fresh factor.
      state = internal_force(displacement, internal);
      external = external_force(assembly_->model(), load, displacement);
      residual_force = out_of_balance(*assembly_, load, internal, external);
    }
    record.residual = norm / scale_now();
    record.min_jacobian = state.min_jacobian;
    report.history.push_back(record);
    if (progress) progress(record);
    if (record.step == 0.0) {
      if (fresh && !is_rounding(norm)) return give_up(StopCause::no_descent);
      stalled = fresh;
      reuse = false;
      continue;
    }
    stalled = fresh && norm > kStall * norm_before;
    reuse = !projected && record.step == 1.0 && norm <= settings.reuse_contraction * norm_before;
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
    if (!factor_and_solve(load, displacement, response, projected, report)) {
      report.stopped = StopCause::no_tangent;
      return false;
    }
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
  const int num_dofs = assembly_->num_dofs();
  Eigen::VectorXd internal;
  const ElementState state = internal_force(displacement, internal);
  const double start_force_scale =
      force_scale(*assembly_, from, internal, external_force(assembly_->model(), from, displacement));
  report.min_jacobian = state.min_jacobian;
  report.worst_element = state.worst_element;

  const LoadPath path(from, loads, assembly_->model(), displacement, internal);

  double reached = 0;
  double off_path_time = std::numeric_limits<double>::infinity();  // an increment to this time left the path
  double first_pace = 0;  // predicted motion per time in the first increment
  double increment = std::min({1.0, settings.first_increment, settings.largest_increment});
  while (reached < 1.0) {
    if (report.increments >= settings.max_increments) {
      report.stopped = StopCause::increments;
      return report;
    }
    const int attempt = report.increments + 1;
    // Extend the last increment instead of leaving a tiny remainder.
    const double target = reached + increment > 1.0 - 1e-9 ? 1.0 : reached + increment;
    const LoadCase load = path.at(target);

    Eigen::VectorXd trial;
    int factors_before = 0;
    bool converged = in_either_precision(report, [&] {
      trial = displacement;
      factors_before = report.factorizations;
      return take_increment(load, target, attempt, trial, start_force_scale, settings, report, progress);
    });
    const double pace = predicted_motion_ / (target - reached);
    if (first_pace == 0) first_pace = pace;
    const bool easy = report.factorizations - factors_before <= kEasyFactors;
    if (converged && settings.keep_to_path &&
        !stays_on_path(path.at(reached), load, displacement, trial, report)) {
      converged = false;
      off_path_time = target;
    }
    if (converged) {
      displacement = trial;
      for (int dof = 0; dof < num_dofs; ++dof) {
        if (load.held[static_cast<size_t>(dof)])
          displacement[dof] = load.displacement[dof];  // exact at the end
      }
      reached = target;
      report.increments = attempt;
      report.load_factor = reached;
      if (easy) increment *= 1.5;
      increment = std::min({increment, settings.largest_increment, 1.0 - reached});
    } else {
      ++report.cutbacks;
      increment = 0.5 * (target - reached);
      if (increment < settings.smallest_increment) {
        const bool soft = pace > kLimitPace * first_pace;
        if (settings.keep_to_path && (soft || (off_path_time > reached && std::isfinite(off_path_time))))
          report.stopped = StopCause::limit_point;
        return report;
      }
    }
  }
  report.converged = true;
  report.stopped = StopCause::none;
  return report;
}

}  // namespace palpate
