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

// What is left of an error at most, of what the contacts are moved by: a hundredth of what a zone is wrong by anyway.
constexpr double kConverged = 1e-4;
// A frame whose contacts stand still in a refined zone iterates until kConverged times this is reached, if its iterations
// suffice. The errors that a frame leaves are noise for the lane's acceleration.
constexpr double kAtRest = 1e-4;
// Nothing measures the error after a step that is not evaluated, so that error is kept below this part of the accepted one.
constexpr double kUnmeasured = 0.25;
constexpr double kMostLeft =
    0.5;  // by a step of a tangent, of an error: it is made anew where it leaves more
constexpr double kLargest = 1e60;  // displacement, model units

// Whether a step ends a solve, so that the group need not be evaluated after it: it leaves at most the length
// `unmeasured`, no element is near inversion, and the tangent is not in doubt.
bool is_last_step(const ZoneFrame& frame, const ZoneGroup& group, double length, double unmeasured) {
  constexpr double kSafeJacobian = 0.1;
  constexpr double kMostStrain = 0.01;  // change of F in any element
  const double expected = contraction(frame, group);
  const double of_step = kStiffening * length / frame.pack.mean_surface_edge;
  return length * std::max(expected, of_step) <= unmeasured && expected <= kMostLeft &&
         !group.tangent.is_shifted && length * group.steepest <= kMostStrain &&
         group.smallest_jacobian > kSafeJacobian;
}

// What a Newton step has come to.
struct Stepped {
  double length;  // of the largest component; negative where there was no way: nothing has moved then
  // Else ZoneWork::forces, ZoneGroup::energy and ZoneSet::turning are those before the step.
  bool is_evaluated;
};

// A Newton step, or as much of it as leaves all elements upright. `unmeasured`: as for is_last_step().
Stepped take_step(ZoneFrame& frame, double unmeasured, ZoneGroup& group) {
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

// One iteration, after find_residual(). `is_bounded`: ZoneState's. `unmeasured`: as for is_last_step().
Stepped iterate(ZoneFrame& frame, bool is_bounded, double unmeasured, ZoneGroup& group, bool& is_renewed) {
  const auto renew = [&] {
    if (is_renewed && is_bounded) return false;
    is_renewed = true;
    return make_tangent(frame, group);
  };
  const bool is_bad = !group.has_tangent || group.tangent.left > kMostLeft || is_outdated(frame, group);
  if (is_bad && !renew() && !group.has_tangent) return {-1, true};
  Stepped step = take_step(frame, unmeasured, group);
  if (step.length < 0) {
    find_residual(frame, group);
    if (renew()) step = take_step(frame, unmeasured, group);
  }
  group.has_tangent = step.length >= 0;
  if (group.tangent.is_shifted) frame.flags |= PAL_FLAG_UNCONVERGED;
  return step;
}

// Of the unknowns, squared.
double size_of_residual(const ZoneFrame& frame, const ZoneGroup& group) {
  double sum = 0;
  for (uint32_t i = 0; i < group.unknowns; ++i) sum += frame.work.residual[i] * frame.work.residual[i];
  return sum;
}

// Finds the group's forces and stored energy at its current displacements. `residual_before`: the squared
// residual before the step; 0: too small to judge the tangent by.
void conclude(ZoneFrame& frame, double residual_before, ZoneGroup& group) {
  find_residual(frame, group);
  if (residual_before > 0) group.tangent.left = sqrt(size_of_residual(frame, group) / residual_before);
  if (group.has_tangent) find_forces(frame, group);
  group.stored = stored_energy(frame, group);
}

// The same after a last step s, by the residual r and the energy E before it and the tangent K: E - r . s + s . K s / 2 =
// E - r . s / 2. find_forces() goes to the end of the step by itself. `stored`: E.
void conclude_last(ZoneFrame& frame, double stored, ZoneGroup& group) {
  find_forces(frame, group);
  group.stored = stored - 0.5 * product(frame.work.residual, group.tangent.step, group.unknowns);
}

// On its way to a balance Newton passes states in which elements are all but inverted, and bear many times what they come
// to. Where forces are much larger than those of the last balance, at d0, and what its stiffness adds to them,
//
//   F' = F0 + K0 (d - d0),    |F|^2 > kMost^2 (|F0|^2 + |F' - F0|^2) >= kMost^2 / 2 |F'|^2,
//
// F' and K0 are answered, and the energy that goes with them, E0 + (F0 + F') / 2 . (d - d0). In fast motions of one contact
// |F| was never as large; where three crush tissue it was up to several hundred times.
void answer_on_the_way(const ZoneFrame& frame, ZoneGroup& group) {
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

// What acts on all groups once some have gone back: a set that has just begun has no balance yet, only a place.
void settle_groups(ZoneFrame& frame, const Setback* setbacks) {
  find_coupling(frame);
  for (uint32_t g = 0; g < frame.set.num_groups; ++g) {
    ZoneGroup& group = frame.set.groups[g];
    find_exterior_force(frame, group);  // a group at rest drops the correction of all
    if (setbacks[g] != Setback::none && !group.has_balance) {
      make_tangent(frame, group);
      conclude(frame, 0, group);
    } else {
      find_residual(frame, group);
    }
  }
}

// A group that has no tangent or no balance gets a tangent where it is, or at rest where it cannot stay. Returns whether
// that tangent is new.
bool begin_group(ZoneFrame& frame, ZoneGroup& group, bool& went_back) {
  if (group.has_tangent && group.has_balance) return false;
  place_held(frame, group);
  // A patch that was turned otherwise may not fit.
  if (!evaluate_group(frame, group)) {
    rest_group(frame.pack, frame.set, group);
    place_held(frame, group);
    evaluate_group(frame, group);
    went_back = true;
  }
  if (group.has_tangent) return false;
  // What it was taken back with was the stiffness of another place.
  if (make_tangent(frame, group) && group.setbacks.is_back && group.has_balance)
    keep_balance(frame.set, group);
  return true;
}

// What the solve of a group came to.
struct Solved {
  uint32_t taken;  // iterations
  bool failed;     // there was no way on
  double left;     // of the error of displacements: length
  bool done;       // it is in balance
};

// Lengths of errors of displacements.
struct Goal {
  double converged;   // a group with a smaller error has converged
  double left;        // iterations go on beyond it
  double unmeasured;  // as for is_last_step()
};

// Newton iterations of a group whose contacts have moved, at least one.
Solved solve_group(ZoneFrame& frame, uint32_t iterations, const Goal& goal, bool is_bounded, bool is_renewed,
                   ZoneGroup& group) {
  Solved solved = {};
  const auto is_done = [&](double error) {
    return solved.taken > 0 && !solved.failed && solved.left <= error;
  };
  while (solved.taken < iterations && !is_done(goal.left) && !solved.failed) {
    find_residual(frame, group);
    const double before = size_of_residual(frame, group);
    const double stored = stored_energy(frame, group);
    const Stepped step = iterate(frame, is_bounded, goal.unmeasured, group, is_renewed);
    solved.failed = step.length < 0;
    if (step.is_evaluated)
      conclude(frame, step.length > goal.converged ? before : 0, group);
    else
      conclude_last(frame, stored, group);
    solved.left = step.length * contraction(frame, group);
    ++solved.taken;
  }
  solved.done = is_done(goal.converged);
  return solved;
}

// Goes back where groups found no way on, and keeps the balance of the others. Returns whether any group has gone back.
bool keep_or_go_back(ZoneFrame& frame, const double* wanted, double size, const Solved* solved) {
  ZoneSet& set = frame.set;
  Setback setbacks[kMostZoneContacts] = {};
  bool goes_any_back = false;
  for (uint32_t g = 0; g < set.num_groups; ++g) {
    ZoneGroup& group = set.groups[g];
    group.setbacks.astray = !solved[g].done && group.tangent.left > kMostLeft ? group.setbacks.astray + 1 : 0;
    setbacks[g] = find_setback(frame, wanted, size, solved[g].failed, solved[g].done, group);
    goes_any_back = goes_any_back || setbacks[g] != Setback::none;
  }
  for (uint32_t g = 0; g < set.num_groups; ++g) {
    ZoneGroup& group = set.groups[g];
    if (setbacks[g] != Setback::none) {
      go_back(frame, setbacks[g], group);
      continue;
    }
    keep_trend(frame, group);
    if (!solved[g].done) {
      answer_on_the_way(frame, group);
      continue;
    }
    group.setbacks.failures = 0;
    if (goes_any_back) continue;  // it is one with what is lost
    group.setbacks.longest_step = std::min(kLongestStep, 2 * group.setbacks.longest_step);
    keep_balance(set, group);
  }
  if (goes_any_back) {
    frame.flags |= PAL_FLAG_UNCONVERGED;
    settle_groups(frame, setbacks);
  }
  return goes_any_back;
}

}  // namespace

ZoneAnswer solve_zone(const pal_pack& pack, const double* displacements, uint32_t iterations,
                      bool are_forces_given, ZoneState& state) {
  ZoneSet& set = state.active;
  take_inclusion(pack, state);
  ZoneFrame frame = frame_of(pack, state);
  frame.flags = set.flags;
  state.strained = true;
  double farthest = 0;
  double size = 1e-6 * pack.max_displacement;
  for (uint32_t i = 0; i < set.num_axes; ++i) {
    set.force[i] -= set.coupled_force[i];
    set.coupled_force[i] = 0;
    const double move = length_of(frame, i, displacements[i] - set.followed[i]);
    farthest = std::max(farthest, move);
    size = std::max({size, length_of(frame, i, displacements[i]), move});
  }
  const bool is_still = farthest <= kStill * pack.mean_surface_edge;
  Goal goal = {};
  goal.converged = kConverged * size;
  goal.left = (!are_forces_given && set.correction.is_refined && is_still ? kAtRest : 1) * goal.converged;
  // Given forces are compared with the contacts' forces, so the last step is evaluated.
  goal.unmeasured = are_forces_given ? 0 : kUnmeasured * goal.left;
  bool is_renewed[kMostZoneContacts] = {};
  for (uint32_t g = 0; g < set.num_groups; ++g) {
    is_renewed[g] = begin_group(frame, set.groups[g], state.went_back);
    set.groups[g].setbacks.is_back = false;
    count_solve(frame, set.groups[g]);
    move_contacts(frame, set.groups[g], displacements);
  }
  find_coupling(frame);
  Solved solved[kMostZoneContacts] = {};
  ZoneAnswer answer = {};
  bool converged = set.num_groups > 0;
  if (!converged) answer.iterations = iterations;  // a set that is refused has no use for more
  for (uint32_t g = 0; g < set.num_groups; ++g) {
    solved[g] = solve_group(frame, iterations, goal, state.is_bounded, is_renewed[g], set.groups[g]);
    answer.iterations = std::max(answer.iterations, solved[g].taken);
    answer.left = std::max(answer.left, solved[g].left);
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
    set.groups[g].setbacks.elsewhere = 0;
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
