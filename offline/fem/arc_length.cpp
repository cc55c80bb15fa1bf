#include "offline/fem/arc_length.hpp"

#include <algorithm>
#include <cmath>

#include "offline/fem/current_stiffness.hpp"
#include "offline/fem/equilibrium.hpp"
#include "offline/fem/load_path.hpp"
#include "offline/fem/stopwatch.hpp"

namespace palpate {
namespace {

// Least cosine between the tangents at both ends of an increment: a sharper turn may be another branch.
constexpr double kMinTangentCosine = 0.5;
// The next increment keeps its length after this number of iterations.
constexpr double kUsualIterations = 5;
constexpr double kMostGrowth = 1.5;  // largest ratio of successive increments
constexpr int kMaxHalvings = 4;      // of a Newton step that inverts an element
// Accepted residual of a refined solve, relative to |K| |x| + |b|. A small pivot leaves a larger residual.
constexpr double kSolveAccuracy = 1e-12;
constexpr int kCorrections = 4;  // of iterative refinement

// A vector x = (u, l) of displacements and load factor: a point of the path, or a direction.
struct PathVector {
  Eigen::VectorXd displacement;
  double load_factor = 0;
};

struct PathState {
  PathVector x;
  PathVector tangent;  // of unit length, oriented along the path
  PathPoint point;
};

PathVector add_scaled(const PathVector& x, double scale, const PathVector& y) {
  return {x.displacement + scale * y.displacement, x.load_factor + scale * y.load_factor};
}

// Returns the length of the increment from `point`; negative if Bergan's sign opposes `tangent`. The last
// increment began at `before`, had length `last` and took `iterations`. `first_load` is the first dl.
double next_length(const ArcLengthSettings& settings, const PathPoint& before, const PathPoint& point,
                   const PathVector& tangent, double first_load, double last, int iterations) {
  double length = last * std::clamp(std::sqrt(kUsualIterations / std::max(1, iterations)), 0.5, kMostGrowth);
  if (settings.stepping == Stepping::current_stiffness) {
    const double longest = kMostGrowth * last;
    length = bergan_load_increment(point.current_stiffness, first_load) / tangent.load_factor;
    length = is_steady(before.current_stiffness, point.current_stiffness) ? std::copysign(longest, length)
                                                                          : std::min(length, longest);
  }
  return std::min(length, settings.largest_increment);
}

// The points x with normal . x = value. `distance` has a sign and the factor |normal|.
struct Plane {
  PathVector normal;
  double value = 0;

  double distance(const PathVector& point) const {
    return normal.displacement.dot(point.displacement) + normal.load_factor * point.load_factor - value;
  }
};

}  // namespace

// One call of follow(): the loads of the step, the force scale and the stiffness at the last point.
class ArcLength::Path {
 public:
  Path(ArcLength& owner, const LoadCase& from, const LoadCase& to, const Eigen::VectorXd& displacement,
       const Eigen::VectorXd& internal, const ArcLengthSettings& settings, SolveReport& report,
       const std::function<void(const IterationRecord&)>& progress)
      : owner_(owner),
        assembly_(*owner.assembly_),
        model_(assembly_.model()),
        loads_(
            from, [&to](double) { return to; }, model_, displacement, internal),
        settings_(settings),
        report_(report),
        progress_(progress) {
    const LoadCase start = loads_.at(0);
    rate_ = loads_.at(1);
    rate_.displacement -= start.displacement;
    rate_.force -= start.force;
    for (size_t dof = 0; dof < rate_.held.size(); ++dof) {
      if (!rate_.held[dof]) rate_.displacement[static_cast<Eigen::Index>(dof)] = 0;
    }
    for (const auto& [face, pressure] : start.pressures) rate_.pressures[face] -= pressure;
    moves_held_ = !rate_.displacement.isZero(0.0);
    largest_force_ = force_scale(assembly_, start, internal, external_force(model_, start, displacement));
  }

  bool has_end() const { return settings_.end_load_factor || settings_.end_displacement; }

  // Computes the unit tangent on the side of `side_of`, S and pivots at state.x. False if K is singular.
  bool find_tangent(const PathVector& side_of, PathState& state) {
    auto& [at, tangent, point] = state;
    const LoadCase load = loads_.at(at.load_factor);
    if (!factorize(load, at.displacement)) return false;
    tangent.load_factor = 1;
    if (!response(load, at.displacement, tangent.displacement)) return false;
    const Eigen::VectorXd& v = tangent.displacement;
    if (!(weight_ > 0)) {  // the first point
      weight_ = 1 / v.squaredNorm();
      if (!std::isfinite(weight_)) return false;
      first_flexibility_ = flexibility(load, at.displacement, v);
    }
    point.current_stiffness = first_flexibility_ / flexibility(load, at.displacement, v);
    point.negative_pivots = owner_.cholesky_.num_negative_pivots();
    const double side = product(tangent, side_of) < 0 ? -1 : 1;
    tangent = add_scaled({Eigen::VectorXd::Zero(v.size()), 0}, side / std::sqrt(product(tangent, tangent)),
                         tangent);
    return true;
  }

  // Returns the scalar product of the arc length: (dl_a dl_b + du_a . du_b / |v0|^2) / 2.
  double product(const PathVector& a, const PathVector& b) const {
    return 0.5 * (a.load_factor * b.load_factor + weight_ * a.displacement.dot(b.displacement));
  }

  // Returns the plane through a point with the normal `tangent`, in the scalar product of the arc length.
  Plane normal_to(const PathVector& tangent, const PathVector& through) const {
    Plane plane = {{0.5 * weight_ * tangent.displacement, 0.5 * tangent.load_factor}, 0};
    plane.value = plane.distance(through);
    return plane;
  }

  // Returns the end condition that the chord from a to b crosses first, if any.
  std::optional<Plane> end_between(const PathVector& a, const PathVector& b) const {
    std::optional<Plane> first;
    double nearest = 1;
    const auto consider = [&](const Plane& plane) {
      const double distance_a = plane.distance(a);
      const double distance_b = plane.distance(b);
      if (distance_a == 0 || (distance_a < 0) == (distance_b < 0)) return;
      const double fraction = distance_a / (distance_a - distance_b);
      if (first && fraction >= nearest) return;
      first = plane;
      nearest = fraction;
    };
    const Eigen::VectorXd zero = Eigen::VectorXd::Zero(a.displacement.size());
    if (settings_.end_load_factor && a.load_factor < *settings_.end_load_factor)
      consider({{zero, 1}, *settings_.end_load_factor});
    if (settings_.end_displacement)
      consider({{Eigen::VectorXd::Unit(zero.size(), settings_.end_displacement->dof), 0},
                settings_.end_displacement->value});
    return first;
  }

  // Corrects `point` to an equilibrium in its plane by Newton's method. On failure `point` is undefined.
  bool correct(const Plane& plane, int increment, PathVector& point, int& iterations) {
    LoadCase load;
    Eigen::VectorXd internal;
    ElementState state;
    Eigen::VectorXd residual;
    // Moves held dofs to the load factor of the trial and computes the residual. False if an element inverts.
    const auto evaluate = [&](PathVector& trial) {
      load = loads_.at(trial.load_factor);
      for (int dof = 0; dof < assembly_.num_dofs(); ++dof) {
        if (load.held[static_cast<size_t>(dof)]) trial.displacement[dof] = load.displacement[dof];
      }
      {
        const Stopwatch watch(owner_.seconds_.assembly);
        state = assembly_.internal_force(trial.displacement, internal);
      }
      report_.trouble_element = state.worst_element;
      report_.trouble_jacobian = state.min_jacobian;
      if (!(state.min_jacobian > 0)) return false;
      const Eigen::VectorXd external = external_force(model_, load, trial.displacement);
      residual = out_of_balance(assembly_, load, internal, external);
      force_ = std::max(largest_force_, force_scale(assembly_, load, internal, external));
      return true;
    };
    if (!evaluate(point)) return give_up(StopCause::inverted);
    double last_norm = std::numeric_limits<double>::infinity();
    for (iterations = 0;; ++iterations) {
      const double norm = residual.norm();
      if (!std::isfinite(norm)) return give_up(StopCause::not_finite);
      const bool stalled = norm > kStall * last_norm;
      const double rounding = kRoundings * assembly_.rounding_force(point.displacement);
      if (norm <= settings_.residual_tolerance * force_ || (stalled && norm <= rounding)) {
        report_.residual = force_ > 0 ? std::min(norm / force_, settings_.residual_tolerance) : 0;
        report_.min_jacobian = state.min_jacobian;
        report_.worst_element = state.worst_element;
        return true;
      }
      if (iterations == settings_.max_iterations) return give_up(StopCause::iterations);
      PathVector step;
      if (!newton_step(plane, load, point, residual, step)) return give_up(StopCause::no_tangent);
      IterationRecord record = {increment, point.load_factor, iterations + 1, norm / force_, 1, 1, false};
      PathVector trial = add_scaled(point, record.step, step);
      for (int halving = 0; !evaluate(trial); ++halving) {
        if (halving == kMaxHalvings) return give_up(StopCause::no_descent);
        record.step *= 0.5;
        trial = add_scaled(point, record.step, step);
      }
      point = std::move(trial);
      last_norm = record.step == 1 ? norm : std::numeric_limits<double>::infinity();
      record.load_factor = point.load_factor;
      record.residual = residual.norm() / force_;
      record.min_jacobian = state.min_jacobian;
      ++report_.iterations;
      report_.history.push_back(record);
      if (progress_) progress_(record);
    }
  }

  // Moves `next` to the path in `plane`, with its tangent. False also where the path turns sharply.
  bool correct_onto(const Plane& plane, const PathState& at, PathState& next, int& iterations) {
    if (!correct(plane, report_.increments + 1, next.x, iterations)) return false;
    next.point.min_jacobian = report_.min_jacobian;
    if (!find_tangent(add_scaled(next.x, -1, at.x), next)) return give_up(StopCause::no_tangent);
    if (product(at.tangent, next.tangent) >= kMinTangentCosine) return true;
    return give_up(StopCause::sharp_turn);
  }

  // Shortens the increment to the end condition that its chord crosses. False if the chord crosses none.
  bool shorten_to_end(const PathState& at, PathState& next, int& iterations) {
    const std::optional<Plane> end = end_between(at.x, next.x);
    if (!end) return false;
    const PathState beyond = next;
    const double fraction = end->distance(at.x) / (end->distance(at.x) - end->distance(next.x));
    next.x = add_scaled(at.x, fraction, add_scaled(next.x, -1, at.x));
    if (!correct_onto(*end, at, next, iterations)) next = beyond;  // the path turns before the end condition
    return true;
  }

  // Adds the corrected state `next` after `at` to the path.
  void accept(const PathState& at, PathState& next) {
    largest_force_ = force_;
    report_.min_jacobian = next.point.min_jacobian;
    report_.load_factor = next.x.load_factor;
    next.point.increment = ++report_.increments;
    next.point.arc_length = at.point.arc_length + product(at.tangent, add_scaled(next.x, -1, at.x));
    next.point.load_factor = next.x.load_factor;
  }

 private:
  bool give_up(StopCause cause) {
    report_.stopped = cause;
    return false;
  }

  // Solves K du = r + dl q in the plane (arc_length.hpp) for step = (du, dl).
  bool newton_step(const Plane& plane, const LoadCase& load, const PathVector& at,
                   const Eigen::VectorXd& residual, PathVector& step) {
    if (!factorize(load, at.displacement)) return false;
    PathVector tangent = {{}, 1};  // (v, 1)
    step.displacement = residual;
    if (!solve(load, at.displacement, step.displacement) ||
        !response(load, at.displacement, tangent.displacement))
      return false;
    const Eigen::VectorXd& normal = plane.normal.displacement;
    const double slope = normal.dot(tangent.displacement) + plane.normal.load_factor;
    step.load_factor = -(plane.distance(at) + normal.dot(step.displacement)) / slope;
    step.displacement += step.load_factor * tangent.displacement;
    return step.displacement.allFinite();
  }

  // Solves K_ff v_f = q_f - K_fc v_c for the full-length v = du/dl. The loads give v_c at the held dofs.
  bool response(const LoadCase& load, const Eigen::VectorXd& displacement, Eigen::VectorXd& v) {
    v = external_force(model_, rate_, displacement);
    if (moves_held_) v -= stiffness_times(load, displacement, rate_.displacement);
    if (!solve(load, displacement, v)) return false;
    v += rate_.displacement;
    return true;
  }

  // Returns v . K v. Without moving held dofs this is v . q, which costs no product with K.
  double flexibility(const LoadCase& load, const Eigen::VectorXd& displacement, const Eigen::VectorXd& v) {
    if (moves_held_) return v.dot(stiffness_times(load, displacement, v));
    return v.dot(external_force(model_, rate_, displacement));
  }

  Eigen::VectorXd stiffness_times(const LoadCase& load, const Eigen::VectorXd& displacement,
                                  const Eigen::VectorXd& vector) {
    Eigen::VectorXd product = assembly_.tangent_times(displacement, vector);
    subtract_pressure_product(model_, load.pressures, displacement, vector, product);
    return product;
  }

  bool factorize(const LoadCase& load, const Eigen::VectorXd& displacement) {
    {
      const Stopwatch watch(owner_.seconds_.assembly);
      assembly_.tangent(displacement, false, stiffness_);
      subtract_pressure_tangent(assembly_, load.pressures, displacement, stiffness_);
      hold_equations(held_equations(assembly_, load), stiffness_);
    }
    const Stopwatch watch(owner_.seconds_.factor);
    ++report_.factorizations;
    return owner_.cholesky_.factorize_indefinite(stiffness_);
  }

  // Replaces b by K_ff^-1 b; ignores b at held dofs.
  bool solve(const LoadCase& load, const Eigen::VectorXd& displacement, Eigen::VectorXd& b) {
    const Stopwatch watch(owner_.seconds_.back_solve);
    clear_held(assembly_, load, b);
    const std::vector<int>& dofs = assembly_.equation_dofs();
    const auto back_solve = [&](Eigen::VectorXd& v) {
      Eigen::VectorXd packed = v(dofs);
      if (!solve_refined(packed)) return false;
      v.setZero();
      v(dofs) = packed;
      return true;
    };
    if (load.pressures.empty() || b.isZero(0.0)) return back_solve(b);
    return solve_with_pressures(assembly_, load, displacement, back_solve, b);
  }

  // Replaces b by K^-1 b over the equations, with iterative refinement.
  bool solve_refined(Eigen::VectorXd& b) {
    if (b.size() == 0) return true;
    const auto matrix = stiffness_.selfadjointView<Eigen::Lower>();
    const double stiffness_scale = stiffness_.diagonal().cwiseAbs().maxCoeff();
    Eigen::VectorXd residual = b;
    Eigen::VectorXd x = Eigen::VectorXd::Zero(b.size());
    for (int correction = 0; correction <= kCorrections; ++correction) {
      owner_.cholesky_.solve(residual);
      x += residual;
      residual = b - matrix * x;
      if (residual.norm() <= kSolveAccuracy * (stiffness_scale * x.norm() + b.norm())) {
        b = x;
        return b.allFinite();
      }
    }
    return false;
  }

  ArcLength& owner_;
  const Assembly& assembly_;
  const Model& model_;
  LoadPath loads_;
  LoadCase rate_;  // q: derivative of the loads by the load factor
  const ArcLengthSettings& settings_;
  SolveReport& report_;
  const std::function<void(const IterationRecord&)>& progress_;
  SparseLower stiffness_;
  bool moves_held_ = false;
  double weight_ = 0;             // 1 / |v0|^2
  double first_flexibility_ = 0;  // v0 . K0 v0
  double largest_force_ = 0;      // force scale: maximum over the path so far
  double force_ = 0;              // force scale of the path and the current trial
};

ArcLength::ArcLength(const Assembly& assembly)
    : assembly_(&assembly), cholesky_(assembly.analysis(), assembly.threads()) {}

SolveReport ArcLength::follow(const LoadCase& from, const LoadCase& to, Eigen::VectorXd& displacement,
                              const ArcLengthSettings& settings,
                              const std::function<void(const PathPoint&, const Eigen::VectorXd&)>& visit,
                              const std::function<void(const IterationRecord&)>& progress) {
  SolveReport report;
  Eigen::VectorXd internal;
  const ElementState state = assembly_->internal_force(displacement, internal);
  report.min_jacobian = state.min_jacobian;
  report.worst_element = state.worst_element;
  Path path(*this, from, to, displacement, internal, settings, report, progress);

  PathState at = {{displacement, 0}, {}, {}};
  at.point.min_jacobian = state.min_jacobian;
  if (!path.find_tangent({Eigen::VectorXd::Zero(displacement.size()), 1}, at)) {
    report.stopped = StopCause::no_tangent;
    return report;
  }
  visit(at.point, displacement);

  double length = std::min(settings.first_increment, settings.largest_increment);
  double first_load = 0;
  for (bool ended = false; !ended;) {
    if (report.increments == settings.max_increments) {
      report.stopped = StopCause::increments;
      report.converged = !path.has_end();
      return report;
    }
    if (length < 0) {
      report.stopped = StopCause::path_reversed;
      return report;
    }
    PathState next = {add_scaled(at.x, length, at.tangent), {}, {}};
    int iterations = 0;
    if (!path.correct_onto(path.normal_to(at.tangent, next.x), at, next, iterations)) {
      ++report.cutbacks;
      length *= 0.5;
      if (length < settings.smallest_increment) return report;
      continue;
    }
    ended = path.shorten_to_end(at, next, iterations);
    if (report.increments == 0) first_load = length * at.tangent.load_factor;
    path.accept(at, next);
    length = next_length(settings, at.point, next.point, next.tangent, first_load, length, iterations);
    at = std::move(next);
    displacement = at.x.displacement;
    visit(at.point, displacement);
  }
  report.converged = true;
  report.stopped = StopCause::none;
  return report;
}

}  // namespace palpate
