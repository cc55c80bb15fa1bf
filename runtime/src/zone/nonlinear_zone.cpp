#include "runtime/src/zone/nonlinear_zone.hpp"

#include <math.h>
#include <string.h>

#include <algorithm>

#include "runtime/src/linear/linear_point.hpp"
#include "runtime/src/numerics/product.hpp"
#include "runtime/src/pack/pack_view.hpp"
#include "runtime/src/zone/zone_inclusion.hpp"
#include "runtime/src/zone/zone_motion.hpp"
#include "runtime/src/zone/zone_setback.hpp"
#include "runtime/src/zone/zone_tangent.hpp"

namespace palpate {
namespace {

// Largest error of displacements in a converged group, over the contacts' displacement. A zone's own error is
// about a hundred times as large.
constexpr double kConverged = 1e-4;
// Factor of kConverged if contacts of a refined zone stand still: errors disturb Anderson's acceleration.
constexpr double kStandingStill = 1e-4;
// Tightens the error limit for a step that is not evaluated, because no residual measures its error.
constexpr double kUnmeasured = 0.25;
constexpr double kMostResidualRatio = 0.5;  // a tangent whose step leaves more of the residual is renewed
constexpr double kLargest = 1e60;           // displacement or energy, model units

// Whether a Newton step ends the solve without an evaluation after the step: the estimated error is at most
// `unmeasured`, a length, no element is near inversion, F changes little, and the tangent is good.
bool is_last_step(const ZoneFrame& frame, const ZoneGroup& group, double length, double unmeasured) {
  constexpr double kSafeJacobian = 0.1;
  constexpr double kMostStrain = 0.01;  // change of F in any element
  const double expected = contraction(frame, group);
  const double of_step = kStiffening * length / frame.pack.mean_surface_edge;
  return length * std::max(expected, of_step) <= unmeasured && expected <= kMostResidualRatio &&
         !group.tangent.is_shifted && length * group.steepest <= kMostStrain &&
         group.smallest_jacobian > kSafeJacobian;
}

struct StepResult {
  double length;  // largest component of the full step; negative: the step failed and nothing has moved
  // If false, ZoneWork::forces, GroupExterior::force, ZoneGroup::energy and ZoneSet::turning are from before
  // the step.
  bool is_evaluated;
};

// Takes a Newton step, halved up to kMostCuts times if an element is inverted. `unmeasured`: is_last_step().
StepResult take_step(ZoneFrame& frame, double unmeasured, ZoneGroup& group) {
  const double* step = find_step(frame, group);
  double longest = 0;
  for (uint32_t i = 0; i < group.unknowns; ++i) {
    const double size = fabs(step[i]);
    if (!(size <= kLargest)) return {-1, true};
    longest = std::max(longest, size);
  }
  save_group(frame, group);
  if (is_last_step(frame, group, longest, unmeasured)) {
    add_to_unknowns(frame, group, step, -1);
    follow_pressures(group.batches, frame.work.saved, frame.set.displacement, 1);
    count_move(group, longest);
    return {longest, false};
  }
  double part = 1;
  for (uint32_t cut = 0; cut <= kMostCuts; ++cut, part *= 0.5) {
    add_to_unknowns(frame, group, step, -part);
    if (evaluate_group(frame, group)) {
      if (cut > 0) frame.flags |= PAL_FLAG_UNCONVERGED;
      follow_pressures(group.batches, frame.work.saved, frame.set.displacement, part);
      count_move(group, part * longest);
      return {longest, true};
    }
    restore_group(frame, group);
  }
  evaluate_group(frame, group);
  return {-1, true};
}

// Iterates once after find_residual(), and makes a new tangent if necessary. `is_bounded`: as in ZoneState.
// `is_renewed`: this solve has made a tangent.
StepResult iterate(ZoneFrame& frame, bool is_bounded, double unmeasured, ZoneGroup& group, bool& is_renewed) {
  const auto renew = [&] {
    if (is_renewed && is_bounded) return false;
    is_renewed = true;
    return make_tangent(frame, group);
  };
  const bool is_bad =
      !group.has_tangent || group.tangent.residual_ratio > kMostResidualRatio || is_outdated(frame, group);
  if (is_bad && !renew() && !group.has_tangent) return {-1, true};
  StepResult step = take_step(frame, unmeasured, group);
  if (step.length < 0) {
    find_residual(frame, group);
    if (renew()) step = take_step(frame, unmeasured, group);
  }
  group.has_tangent = step.length >= 0;
  if (group.tangent.is_shifted) frame.flags |= PAL_FLAG_UNCONVERGED;
  return step;
}

// Returns |r_u|^2.
double squared_residual(const ZoneFrame& frame, const ZoneGroup& group) {
  double sum = 0;
  for (uint32_t i = 0; i < group.unknowns; ++i) sum += frame.work.residual[i] * frame.work.residual[i];
  return sum;
}

// Finds the forces and energy of an evaluated group. `residual_before`: |r_u|^2 before the last step, or 0 if
// the step was too small to judge the tangent.
void conclude(ZoneFrame& frame, double residual_before, ZoneGroup& group) {
  find_residual(frame, group);
  if (residual_before > 0)
    group.tangent.residual_ratio = sqrt(squared_residual(frame, group) / residual_before);
  if (group.has_tangent) find_forces(frame, group);
  group.stored = stored_energy(frame, group);
}

// Finds forces and energy after a last step s = K^-1 r that is not evaluated. The energy falls from `stored`,
// E, to E - r . s + s . K s / 2 = E - r . s / 2. find_forces() includes the step.
void conclude_last(ZoneFrame& frame, double stored, ZoneGroup& group) {
  find_forces(frame, group);
  group.stored = stored - 0.5 * product(frame.work.residual, group.tangent.step, group.unknowns);
}

// Replaces an unconverged force F that is much too large, as Newton iterates with nearly inverted elements
// have. From force F0, stiffness K0 and energy E0 of the last equilibrium d0 the function extrapolates
//
//   F' = F0 + K0 (d - d0),    E' = E0 + (F0 + F') / 2 . (d - d0)
//
// and the stiffness K0. The condition is |F|^2 > kMost^2 (|F0|^2 + |F' - F0|^2).
void limit_unconverged_force(const ZoneFrame& frame, ZoneGroup& group) {
  constexpr double kMost = 2;
  const ZoneSet& set = frame.set;
  if (!group.has_balance) return;
  double change[kMostZoneAxes];
  double forces[kMostZoneAxes];
  find_change(set, group, set.balanced.followed, set.followed, change);
  double work = 0;
  double excess = 0;
  for (uint32_t i = 0; i < group.num_axes; ++i) {
    const uint32_t at = contact_axis(set, group, i);
    const double before = set.balanced.force[at];
    double gained = 0;
    for (uint32_t j = 0; j < group.num_axes; ++j)
      gained += set.balanced.stiffness[at][contact_axis(set, group, j)] * change[j];
    forces[i] = before + gained;
    work += (before + 0.5 * gained) * change[i];
    const double unit = length_of(frame, at, 1);
    excess +=
        (set.force[at] * set.force[at] - kMost * kMost * (before * before + gained * gained)) / (unit * unit);
  }
  if (!(excess > 0)) return;
  for (uint32_t i = 0; i < group.num_axes; ++i) {
    const uint32_t at = contact_axis(set, group, i);
    set.force[at] = forces[i];
    memcpy(set.stiffness[at], set.balanced.stiffness[at], sizeof *set.stiffness);
  }
  group.stored = group.stored_in_balance + work;
}

// Updates the forces on all groups after setbacks of some. A group that returned to its first state, not to
// an equilibrium, has no valid force: the function makes a tangent and finds the force.
void settle_groups(ZoneFrame& frame, const Setback* setbacks) {
  find_coupling(frame);
  for (uint32_t g = 0; g < frame.set.num_groups; ++g) {
    ZoneGroup& group = frame.set.groups[g];
    find_exterior_force(frame, group);  // rest_group() drops the correction of all groups
    if (setbacks[g] != Setback::none && !group.has_balance) {
      make_tangent(frame, group);
      conclude(frame, 0, group);
    } else {
      find_residual(frame, group);
    }
  }
}

// Evaluates a group that has no tangent or no stored equilibrium, and makes a missing tangent. A group with
// an inverted element is put at rest first. Returns whether the function tried to make a tangent.
bool begin_group(ZoneFrame& frame, ZoneGroup& group, bool& went_back) {
  if (group.has_tangent && group.has_balance) return false;
  place_held(frame, group);
  // The rigid motion of a patch in a new set may invert an element.
  if (!evaluate_group(frame, group)) {
    rest_group(frame.pack, frame.set, group);
    place_held(frame, group);
    evaluate_group(frame, group);
    went_back = true;
  }
  if (group.has_tangent) return false;
  // The stored stiffness may be of another state, so the new stiffness replaces it.
  if (make_tangent(frame, group) && group.setbacks.is_back && group.has_balance)
    keep_balance(frame.set, group);
  return true;
}

struct SolveResult {
  uint32_t taken;  // iterations
  bool failed;     // no acceptable step was found
  double error;    // estimated error of displacements, length
  bool done;       // the group has converged
};

// Limits of the estimated error of displacements, lengths.
struct ErrorLimits {
  double converged;   // a group below this error has converged
  double stop;        // iterations end below this error
  double unmeasured;  // as for is_last_step()
};

// Takes at least one Newton iteration, if `iterations` > 0. Call move_contacts() and find_coupling() first.
SolveResult solve_group(ZoneFrame& frame, uint32_t iterations, const ErrorLimits& limits, bool is_bounded,
                        bool is_renewed, ZoneGroup& group) {
  SolveResult solved = {};
  const auto is_done = [&](double limit) {
    return solved.taken > 0 && !solved.failed && solved.error <= limit;
  };
  while (solved.taken < iterations && !is_done(limits.stop) && !solved.failed) {
    find_residual(frame, group);
    const double before = squared_residual(frame, group);
    const double stored = stored_energy(frame, group);
    const StepResult step = iterate(frame, is_bounded, limits.unmeasured, group, is_renewed);
    solved.failed = step.length < 0;
    if (step.is_evaluated)
      conclude(frame, step.length > limits.converged ? before : 0, group);
    else
      conclude_last(frame, stored, group);
    solved.error = step.length * contraction(frame, group);
    ++solved.taken;
  }
  solved.done = is_done(limits.converged);
  return solved;
}

// Returns failed groups to an earlier state, a setback, and stores the equilibrium of converged groups.
// Returns whether any group had a setback. `size`: as for find_setback().
bool keep_or_go_back(ZoneFrame& frame, const double* wanted, double size, const SolveResult* solved) {
  ZoneSet& set = frame.set;
  Setback setbacks[kMostZoneContacts] = {};
  bool has_any_setback = false;
  for (uint32_t g = 0; g < set.num_groups; ++g) {
    ZoneGroup& group = set.groups[g];
    group.setbacks.stalled =
        !solved[g].done && group.tangent.residual_ratio > kMostResidualRatio ? group.setbacks.stalled + 1 : 0;
    setbacks[g] = find_setback(frame, wanted, size, solved[g].failed, solved[g].done, group);
    has_any_setback = has_any_setback || setbacks[g] != Setback::none;
  }
  for (uint32_t g = 0; g < set.num_groups; ++g) {
    ZoneGroup& group = set.groups[g];
    if (setbacks[g] != Setback::none) {
      go_back(frame, setbacks[g], group);
      continue;
    }
    keep_trend(frame, group);
    if (!solved[g].done) {
      limit_unconverged_force(frame, group);
      continue;
    }
    group.setbacks.failures = 0;
    if (has_any_setback) continue;  // this equilibrium depends on states that other groups have left
    group.setbacks.longest_step = std::min(kLongestStep, 2 * group.setbacks.longest_step);
    keep_balance(set, group);
  }
  if (has_any_setback) {
    frame.flags |= PAL_FLAG_UNCONVERGED;
    settle_groups(frame, setbacks);
  }
  return has_any_setback;
}

}  // namespace

ZoneAnswer solve_zone(const pal_pack& pack, const double* displacements, uint32_t iterations,
                      bool are_forces_given, ZoneState& state) {
  ZoneSet& set = state.active;
  take_inclusion(pack, state);
  ZoneFrame frame = frame_of(pack, state);
  frame.flags = set.flags;
  state.strained = true;
  double largest_move = 0;
  double size = 1e-6 * pack.max_displacement;
  for (uint32_t i = 0; i < set.num_axes; ++i) {
    set.force[i] -= set.coupled_force[i];
    set.coupled_force[i] = 0;
    const double move = length_of(frame, i, displacements[i] - set.followed[i]);
    largest_move = std::max(largest_move, move);
    size = std::max({size, length_of(frame, i, displacements[i]), move});
  }
  const bool is_still = largest_move <= kStill * pack.mean_surface_edge;
  ErrorLimits limits = {};
  limits.converged = kConverged * size;
  limits.stop =
      (!are_forces_given && set.correction.is_refined && is_still ? kStandingStill : 1) * limits.converged;
  // The caller compares given forces with contact forces, so the last step is evaluated.
  limits.unmeasured = are_forces_given ? 0 : kUnmeasured * limits.stop;
  bool is_renewed[kMostZoneContacts] = {};
  for (uint32_t g = 0; g < set.num_groups; ++g) {
    is_renewed[g] = begin_group(frame, set.groups[g], state.went_back);
    set.groups[g].setbacks.is_back = false;
    count_solve(frame, set.groups[g]);
    move_contacts(frame, set.groups[g], displacements);
  }
  find_coupling(frame);
  SolveResult solved[kMostZoneContacts] = {};
  ZoneAnswer answer = {};
  bool converged = set.num_groups > 0;
  if (!converged) answer.iterations = iterations;  // no iteration helps a refused set
  for (uint32_t g = 0; g < set.num_groups; ++g) {
    solved[g] = solve_group(frame, iterations, limits, state.is_bounded, is_renewed[g], set.groups[g]);
    answer.iterations = std::max(answer.iterations, solved[g].taken);
    answer.left = std::max(answer.left, solved[g].error);
    converged = converged && solved[g].done;
  }
  if (!converged) frame.flags |= PAL_FLAG_UNCONVERGED;
  answer.went_back = keep_or_go_back(frame, displacements, size, solved);
  state.went_back = state.went_back || answer.went_back;
  find_coupled_force(frame);
  for (uint32_t i = 0; i < set.num_axes; ++i) set.force[i] += set.coupled_force[i];
  answer.energy = set.correction.energy + coupled_energy(frame);
  for (uint32_t g = 0; g < set.num_groups; ++g) answer.energy += set.groups[g].stored;
  if (!(fabs(answer.energy) <= kLargest)) answer.energy = 0;
  answer.flags = frame.flags;
  return answer;
}

void rest_zone(const pal_pack& pack, ZoneState& state) {
  if (!state.strained) return;
  state.strained = false;
  ZoneSet& set = state.active;
  for (uint32_t g = 0; g < set.num_groups; ++g) {
    rest_group(pack, set, set.groups[g]);
    set.groups[g].setbacks.retry_distance = 0;
  }
}

void fill_zone_field(const pal_pack& pack, const ZoneState& state, FieldState& field) {
  const ZoneSet& set = state.active;
  field.num_held = field.num_moved = field.num_corners = field.num_own = 0;
  for (uint32_t i = 0; i < set.num_nodes; ++i) {
    const uint32_t packed = node_at(pack, set, i).packed_node;
    if (packed == pack::kNoNode) continue;
    for (uint32_t axis = 0; axis < 3; ++axis)
      field.own[3 * field.num_own + axis] =
          static_cast<pal_real>(set.displacement[3 * i + axis] * pack.metres);
    field.own_nodes[field.num_own++] = packed;
  }
  double change[kMostZoneAxes];
  find_axes_change(set.num_contacts, set.num_axes, set.correction.followed_then, set.followed, change);
  for (uint32_t i = 0; i < set.num_axes; ++i)
    field.followed[i] = static_cast<pal_real>(change[i] * (i < 3 * set.num_contacts ? pack.metres : 1.0));
  field.num_followed = set.num_axes;
  field.response = set.correction.field;
  if (set.correction.is_refined) field.refined_field = set.correction.field;
}

}  // namespace palpate
