#include "runtime/src/nonlinear_zone.hpp"

#include <math.h>
#include <string.h>

#include <algorithm>

#include "runtime/src/pack_view.hpp"
#include "runtime/src/zone_exterior.hpp"
#include "runtime/src/zone_inclusion.hpp"
#include "runtime/src/zone_tangent.hpp"

namespace palpate {
namespace {

// What is left of an error at most, of what the contacts are moved by: a hundredth of what a zone is wrong by anyway.
constexpr double kConverged = 1e-4;
// As kConverged, of what other groups have moved the boundary by in this frame; felt there is of a move, where no
// node is shared, some part.
constexpr double kMostUncoupled = 5e-4;
constexpr double kOfOthers = 0.1;
constexpr double kMostLeft =
    0.5;  // by a step of a tangent, of an error: it is made anew where it leaves more
constexpr uint32_t kMostCuts = 6;
constexpr double kLargest = 1e60;      // displacement, model units
constexpr uint32_t kMostAstray = 4;    // solves in a row
constexpr uint32_t kMostFailures = 8;  // since it was in balance: it begins anew at rest

// The patches of the group's contacts as they are to be: u = d + (R - 1) r, r the arm at rest.
void place_held(ZoneFrame& frame, const ZoneGroup& group) {
  ZoneSet& set = frame.set;
  const uint32_t first = first_boundary(group) + group.num_boundary;
  Rotation rotations[kMostZoneContacts];
  for (uint32_t slot = 0; slot < group.num_contacts && group.num_axes > 3 * group.num_contacts; ++slot)
    rotations[slot] = patch_rotation(set, group.contacts[slot]);
  for (uint32_t i = first; i < first + group.num_held; ++i) {
    double* to = set.displacement + size_t{3} * i;
    memcpy(to, frame.pack.zone_nodes[set.nodes[i]].displacement, 3 * sizeof *to);
    for (uint32_t m = set.first_master[i]; m < set.first_master[i + 1]; ++m) {
      ZoneMaster& master = set.masters[m];
      const uint32_t slot = (master.unknown - group.unknowns) / 3;
      const double* d = set.followed + 3 * group.contacts[slot];
      for (int axis = 0; axis < 3; ++axis) to[axis] += master.share * d[axis];
      if (master.turn == kNoUnknown) continue;
      double arm[3];
      rest_arm(frame.pack, set, group.contacts[slot], set.nodes[i], arm);
      rotate(rotations[slot], arm, master.arm);
      for (int axis = 0; axis < 3; ++axis) to[axis] += master.share * (master.arm[axis] - arm[axis]);
    }
  }
}

// Of an axis, what stands for the length that it moves the tissue by.
double length_of(const ZoneFrame& frame, uint32_t axis, double change) {
  const double arm = std::max(frame.pack.tip_radius, frame.pack.mean_surface_edge);
  return fabs(change) * (axis < 3 * frame.set.num_contacts ? 1.0 : arm);
}

double norm(const double v[3]) {
  return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

// How far the patch of a contact goes at most as the point that it turns about does: |R - 1| is the length of its turn.
double length_of_place(const ZoneSet& set, uint32_t contact) {
  double way[3];
  for (int i = 0; i < 3; ++i) way[i] = set.places[contact][i] - set.points[contact][i];
  return norm(way) * norm(set.followed + 3 * (set.num_contacts + contact));
}

// The spin of a patch since it was turned as before.
void find_spin(const ZoneSet& set, uint32_t contact, const double* before, double spin[3]) {
  double was[4];
  double is[4];
  quaternion_of(before + 3 * (set.num_contacts + contact), was);
  quaternion_of(set.followed + 3 * (set.num_contacts + contact), is);
  turn_between(was, is, spin);
}

// Adds factor times [unknowns] to their displacements.
void add_to_unknowns(const ZoneFrame& frame, const ZoneGroup& group, const double* change, double factor) {
  double* u = frame.set.displacement + size_t{3} * group.first_node;
  for (uint32_t i = 0; i < 3 * (group.num_interior + group.num_boundary); ++i) u[i] += factor * change[i];
}

void save(const ZoneFrame& frame, const ZoneGroup& group) {
  const size_t first = size_t{3} * group.first_node;
  memcpy(frame.state.saved + first, frame.set.displacement + first,
         size_t{3} * group.num_nodes * sizeof(double));
}

void restore(ZoneFrame& frame, const ZoneGroup& group) {
  const size_t first = size_t{3} * group.first_node;
  memcpy(frame.set.displacement + first, frame.state.saved + first,
         size_t{3} * group.num_nodes * sizeof(double));
}

void count_move(ZoneFrame& frame, ZoneGroup& group, double length) {
  group.moved += length;
  group.moved_since += length;
  for (uint32_t g = 0; g < frame.set.num_groups; ++g) {
    if (&frame.set.groups[g] != &group) frame.set.groups[g].others_moved += length;
  }
}

// Takes the contacts towards where they are to be, the rest along as it followed last. As far as all elements stay
// upright.
void move_contacts(ZoneFrame& frame, ZoneGroup& group, const double* wanted) {
  ZoneSet& set = frame.set;
  save(frame, group);
  const bool turns = group.num_axes > 3 * group.num_contacts;
  double before[kMostZoneAxes];
  double points[kMostZoneContacts][3];
  memcpy(before, set.followed, set.num_axes * sizeof *before);
  memcpy(points, set.points, set.num_contacts * sizeof *points);
  double longest = 0;
  for (uint32_t i = 0; i < group.num_axes; ++i) {
    const uint32_t at = contact_axis(set, group, i);
    longest = std::max(longest, length_of(frame, at, wanted[at] - before[at]));
  }
  for (uint32_t slot = 0; slot < group.num_contacts && turns; ++slot)
    longest = std::max(longest, length_of_place(set, group.contacts[slot]));
  const double limit = group.longest_step * frame.pack.mean_surface_edge;
  double part = longest > limit ? limit / longest : 1.0;
  for (uint32_t cut = 0; cut <= kMostCuts; ++cut, part *= 0.5) {
    for (uint32_t i = 0; i < group.num_axes; ++i) {
      const uint32_t at = contact_axis(set, group, i);
      const double step = part * (wanted[at] - before[at]);
      set.followed[at] = before[at] + step;
      if (group.has_tangent && i < 3 * group.num_contacts)
        add_to_unknowns(frame, group, sensitivity(group, i), -step);
    }
    for (uint32_t slot = 0; slot < group.num_contacts && turns; ++slot) {
      const uint32_t contact = group.contacts[slot];
      double spin[3];
      find_spin(set, contact, before, spin);
      for (uint32_t axis = 0; axis < 3; ++axis) {
        set.points[contact][axis] =
            points[contact][axis] + part * (set.places[contact][axis] - points[contact][axis]);
        if (group.has_tangent)
          add_to_unknowns(frame, group, sensitivity(group, 3 * (group.num_contacts + slot) + axis),
                          -spin[axis]);
      }
    }
    place_held(frame, group);
    if (evaluate_elements(frame, group)) {
      follow_pressures(group.batches, frame.state.saved, set.displacement, 0);
      count_move(frame, group, part * longest);
      if (part < 1) frame.flags |= PAL_FLAG_UNCONVERGED;
      return;
    }
    restore(frame, group);
    memcpy(set.followed, before, set.num_axes * sizeof *before);
    memcpy(set.points, points, set.num_contacts * sizeof *points);
    if (turns) place_held(frame, group);  // for the arms
  }
  evaluate_elements(frame, group);
  frame.flags |= PAL_FLAG_UNCONVERGED;
}

// A Newton step, or as much of it as leaves all elements upright. Its length, of the largest component; negative where
// there was no way: nothing has moved then.
double take_step(ZoneFrame& frame, ZoneGroup& group) {
  const double* step = find_step(frame, group);
  double longest = 0;
  for (uint32_t i = 0; i < group.unknowns; ++i) {
    const double size = fabs(step[i]);
    if (!(size <= kLargest)) return -1;
    longest = std::max(longest, size);
  }
  save(frame, group);
  double part = 1;
  for (uint32_t cut = 0; cut <= kMostCuts; ++cut, part *= 0.5) {
    add_to_unknowns(frame, group, step, -part);
    if (evaluate_elements(frame, group)) {
      if (cut > 0) frame.flags |= PAL_FLAG_UNCONVERGED;
      follow_pressures(group.batches, frame.state.saved, frame.set.displacement, part);
      count_move(frame, group, part * longest);
      return longest;
    }
    restore(frame, group);
  }
  evaluate_elements(frame, group);
  return -1;
}

// One iteration, after find_residual(). The length of its step; negative where there was no way on.
double iterate(ZoneFrame& frame, ZoneGroup& group) {
  if ((!group.has_tangent || contraction(frame, group) > kMostLeft) && !make_tangent(frame, group)) return -1;
  double step = take_step(frame, group);
  if (step < 0) {
    find_residual(frame, group);
    step = make_tangent(frame, group) ? take_step(frame, group) : -1;
  }
  group.has_tangent = step >= 0;
  if (group.is_shifted) frame.flags |= PAL_FLAG_UNCONVERGED;
  return step;
}

// Of the unknowns, squared.
double size_of_residual(const ZoneFrame& frame, const ZoneGroup& group) {
  double sum = 0;
  for (uint32_t i = 0; i < group.unknowns; ++i) sum += frame.state.residual[i] * frame.state.residual[i];
  return sum;
}

// Whether a node of the group is much farther from rest than any contact has a right to move it: Newton has found a
// way to where the linear organ outside says nothing any more.
bool is_lost(const ZoneFrame& frame, const ZoneGroup& group, double size) {
  constexpr double kFarthest = 4;  // of the largest displacement of a contact, and a mean edge
  const double limit = kFarthest * (size + frame.pack.mean_surface_edge);
  for (uint32_t i = group.first_node; i < group.first_node + group.num_interior + group.num_boundary; ++i) {
    const double* rest = frame.pack.zone_nodes[frame.set.nodes[i]].displacement;
    for (uint32_t axis = 0; axis < 3; ++axis) {
      if (!(fabs(frame.set.displacement[3 * i + axis] - rest[axis]) <= limit)) return true;
    }
  }
  return false;
}

// Tractions, forces and loads of where the group has got to, and what it stores. Before the step the residual was so
// large.
void conclude(ZoneFrame& frame, double residual_before, ZoneGroup& group) {
  find_pull(frame, group);
  find_residual(frame, group);
  group.left = residual_before > 0 ? sqrt(size_of_residual(frame, group) / residual_before) : 0;
  find_traction(frame, group);
  if (group.has_tangent) find_forces(frame, group);
  weigh_exterior(frame.pack, frame.state.rings, frame.set);
  group.stored = stored_energy(frame, group);
}

// There was no way on: from the last balance the contacts follow in shorter steps.
void go_back(ZoneFrame& frame, ZoneGroup& group) {
  constexpr double kShorter = 0.25;
  constexpr double kShortestStep = 1e-3;
  if (++group.failures > kMostFailures) {
    rest_group(frame.pack, frame.set, group);
  } else {
    group.longest_step = std::max(kShortestStep, kShorter * group.longest_step);
    group.astray = 0;
    go_back_to_balance(frame.set, group);
  }
  place_held(frame, group);
  evaluate_elements(frame, group);
}

// What acts on all groups once some have gone back: a set that has just begun has no balance yet, only a place.
void settle_groups(ZoneFrame& frame, const bool* went_back) {
  weigh_exterior(frame.pack, frame.state.rings, frame.set);
  for (uint32_t g = 0; g < frame.set.num_groups; ++g) {
    ZoneGroup& group = frame.set.groups[g];
    find_coupling(frame, group);
    if (went_back[g] && !group.has_balance) {
      make_tangent(frame, group);
      conclude(frame, 0, group);
      continue;
    }
    find_pull(frame, group);
    find_residual(frame, group);
    find_traction(frame, group);
  }
}

}  // namespace

ZoneAnswer solve_zone(const pal_pack& pack, const double* displacements, uint32_t iterations,
                      ZoneState& state) {
  ZoneSet& set = state.answering;
  take_inclusion(pack, state);
  ZoneFrame frame = {pack, state, set, set.flags};
  state.strained = true;
  double size = 1e-6 * pack.max_displacement;
  for (uint32_t i = 0; i < set.num_axes; ++i) {
    size = std::max(size, length_of(frame, i, displacements[i]));
    size = std::max(size, length_of(frame, i, displacements[i] - set.followed[i]));
  }
  weigh_exterior(pack, state.rings, set);
  for (uint32_t g = 0; g < set.num_groups; ++g) {
    ZoneGroup& group = set.groups[g];
    if (!group.has_tangent) {
      // A patch that was turned otherwise may not fit.
      place_held(frame, group);
      if (!evaluate_elements(frame, group)) {
        rest_group(pack, set, group);
        weigh_exterior(pack, state.rings, set);
        place_held(frame, group);
        evaluate_elements(frame, group);
        state.went_back = true;
      }
      make_tangent(frame, group);
    }
    move_contacts(frame, group, displacements);
    if (set.num_groups == 1) continue;
    find_pull(frame, group);
    find_residual(frame, group);
    find_traction(frame, group);
  }
  bool converged = false;
  bool failed[kMostZoneContacts] = {};
  bool done[kMostZoneContacts] = {};
  const auto is_coupled = [&](const ZoneGroup& group) {
    return kOfOthers * group.others_moved <= kMostUncoupled * size;
  };
  uint32_t taken = 0;
  for (; taken < iterations && !converged; ++taken) {
    for (uint32_t g = 0; g < set.num_groups; ++g) {
      ZoneGroup& group = set.groups[g];
      if (failed[g] || (done[g] && is_coupled(group))) continue;
      if (taken == 0 || !is_coupled(group)) find_coupling(frame, group);
      find_pull(frame, group);
      find_residual(frame, group);
      const double before = size_of_residual(frame, group);
      const double step = iterate(frame, group);
      failed[g] = step < 0;
      conclude(frame, before, group);
      done[g] = !failed[g] && step * contraction(frame, group) <= kConverged * size;
    }
    converged = set.num_groups > 0;
    for (uint32_t g = 0; g < set.num_groups; ++g)
      converged = converged && done[g] && is_coupled(set.groups[g]);
  }
  if (!converged) frame.flags |= PAL_FLAG_UNCONVERGED;
  bool is_stuck[kMostZoneContacts];
  bool is_any_stuck = false;
  for (uint32_t g = 0; g < set.num_groups; ++g) {
    ZoneGroup& group = set.groups[g];
    group.astray = !done[g] && group.left > kMostLeft ? group.astray + 1 : 0;
    is_stuck[g] =
        failed[g] || group.astray > kMostAstray || (frame.flags != set.flags && is_lost(frame, group, size));
    is_any_stuck = is_any_stuck || is_stuck[g];
  }
  for (uint32_t g = 0; g < set.num_groups; ++g) {
    ZoneGroup& group = set.groups[g];
    if (is_stuck[g]) {
      go_back(frame, group);
    } else if (done[g] && is_coupled(group)) {
      group.failures = 0;
      group.longest_step = std::min(kLongestStep, 2 * group.longest_step);
      if (!is_any_stuck) keep_balance(set, group);  // else it is one with what is lost
    }
  }
  if (is_any_stuck) settle_groups(frame, is_stuck);
  ZoneAnswer answer = {0, taken, is_any_stuck, 0};
  for (uint32_t g = 0; g < set.num_groups; ++g) {
    answer.energy += set.groups[g].stored;
    advance_tangent(frame, set.groups[g]);
  }
  state.went_back = state.went_back || is_any_stuck;
  if (!(fabs(answer.energy) <= kLargest)) answer.energy = 0;
  answer.flags = frame.flags;
  return answer;
}

void rest_zone(const pal_pack& pack, ZoneState& state) {
  if (!state.strained) return;
  state.strained = false;
  ZoneSet& set = state.answering;
  for (uint32_t g = 0; g < set.num_groups; ++g) rest_group(pack, set, set.groups[g]);
}

void fill_zone_field(const pal_pack& pack, const ZoneState& state, FieldState& field) {
  const ZoneSet& set = state.answering;
  field.num_held = 0;
  field.num_moved = 0;
  field.num_corners = 0;
  field.num_own = 0;
  fill_exterior_state(pack, state, field);
  for (uint32_t g = 0; g < set.num_groups; ++g) {
    const ZoneGroup& group = set.groups[g];
    for (uint32_t b = 0; b < group.num_boundary; ++b) {
      const uint32_t place = first_boundary(group) + b;
      for (uint32_t axis = 0; axis < 3; ++axis)
        field.weights[3 * field.num_held + axis] =
            static_cast<pal_real>(set.traction[3 * place + axis] * pack.metres);
      field.held[field.num_held++] = set.nodes[place];
    }
    for (uint32_t i = group.first_node; i < group.first_node + group.num_nodes; ++i) {
      const uint32_t packed = pack.zone_nodes[set.nodes[i]].packed_node;
      if (packed == pack::kNoNode) continue;
      for (uint32_t axis = 0; axis < 3; ++axis)
        field.own[3 * field.num_own + axis] =
            static_cast<pal_real>(set.displacement[3 * i + axis] * pack.metres);
      field.own_nodes[field.num_own++] = packed;
    }
  }
}

}  // namespace palpate
