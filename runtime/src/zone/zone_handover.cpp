#include "runtime/src/zone/zone_handover.hpp"

#include <string.h>

#include "runtime/src/pack/pack_view.hpp"
#include "runtime/src/zone/zone_motion.hpp"

namespace palpate {
namespace {

// Where the linear organ had moved a node to, from rest, under the tractions of the set that answers, as placing began.
void linear_displacement(const pal_pack& pack, const ZoneState& state, uint32_t node, double out[3]) {
  const ZoneSet& from = state.active;
  for (int i = 0; i < 3; ++i) out[i] = 0;
  for (uint32_t g = 0; g < from.num_groups; ++g) {
    const ZoneGroup& group = from.groups[g];
    const uint32_t first = group.first_node + group.num_interior;
    for (uint32_t b = first; b < first + group.num_boundary; ++b) {
      double block[9];
      zone_compliance(pack, node, from.nodes[b], block);
      const double* t = state.tractions_before + size_t{3} * b;
      for (int i = 0; i < 3; ++i)
        out[i] += block[3 * i] * t[0] + block[3 * i + 1] * t[1] + block[3 * i + 2] * t[2];
    }
  }
}

// Whether a contact may have come from one place to another by sliding, from a site to the next.
bool has_slid(const pal_pack& pack, const double from[3], const double to[3]) {
  constexpr double kFarthest = 1;  // mean edges of the surface
  double square = 0;
  for (int i = 0; i < 3; ++i) square += (to[i] - from[i]) * (to[i] - from[i]);
  return square <= kFarthest * kFarthest * pack.mean_surface_edge * pack.mean_surface_edge;
}

// Of volume patches that the set before had, too; the others begin as at rest, for U' of nodes that the linear organ
// has placed is no pressure.
void carry_pressures(const ZoneSet& before, const ZoneGroup& group) {
  for (uint32_t p = 0; p < group.batches.num_patches; ++p) {
    ZonePatch& patch = group.batches.patches[p];
    for (uint32_t g = 0; g < before.num_groups && before.ready; ++g) {
      const ZoneBatches& old = before.groups[g].batches;
      for (uint32_t q = 0; q < old.num_patches; ++q) {
        if (old.patches[q].number == patch.number) patch.followed = old.patches[q].followed;
      }
    }
  }
}

// ZoneState::place_of of the set before, or none of them again.
void mark_places(bool marked, ZoneState& state) {
  const ZoneSet& before = state.active;
  for (uint32_t i = 0; i < before.num_nodes && before.ready; ++i)
    state.place_of[before.nodes[i]] = marked ? i + 1 : 0;
}

// A node of the new set where the one before has it, or else where the linear organ does; `again`: there it stays.
// Multiply-adds.
uint64_t place_node(const pal_pack& pack, bool again, uint32_t i, ZoneState& state) {
  const ZoneSet& before = state.active;
  ZoneSet& set = state.next;
  const uint32_t node = set.nodes[i];
  const bool is_moved = before.ready && moving_axes(pack, set, i) != 0;
  const uint32_t place = is_moved ? state.place_of[node] : 0;
  if (again && place == 0) return 0;
  double* to = set.displacement + size_t{3} * i;
  const double* from =
      place != 0 ? before.displacement + size_t{3} * (place - 1) : pack.zone_nodes[node].displacement;
  memcpy(to, from, 3 * sizeof *to);
  if (!is_moved || place != 0 || !state.is_before_strained) return kOfBlock;
  double moved[3];
  linear_displacement(pack, state, node, moved);
  for (int axis = 0; axis < 3; ++axis) to[axis] += moved[axis];
  uint64_t blocks = 1;
  for (uint32_t g = 0; g < before.num_groups; ++g) blocks += before.groups[g].num_boundary;
  return kOfBlock * blocks;
}

// The new set goes on where the one before has got to, once its nodes are placed. `again`: it has begun there before;
// tangents stay.
void begin_where(const pal_pack& pack, bool again, ZoneState& state) {
  const ZoneSet& before = state.active;
  ZoneSet& set = state.next;
  // Contacts that stay keep their forces and rotations. A contact that slides keeps its rotation.
  memset(set.force, 0, set.num_axes * sizeof *set.force);
  memset(set.followed, 0, set.num_axes * sizeof *set.followed);
  memset(set.turning, 0, set.num_contacts * sizeof *set.turning);
  for (uint32_t c = 0; c < set.num_contacts && before.ready && set.sound; ++c) {
    uint32_t old = 0;
    while (old < before.num_contacts && before.sites[old] != set.sites[c]) ++old;
    if (old < before.num_contacts) {
      memcpy(set.force + size_t{3} * c, before.force + size_t{3} * old, 3 * sizeof *set.force);
    } else if (set.num_contacts == before.num_contacts && has_slid(pack, before.points[c], set.points[c])) {
      old = c;
    }
    if (old == before.num_contacts || set.num_axes == 3 * set.num_contacts) continue;
    memcpy(set.followed + size_t{3} * (set.num_contacts + c),
           before.followed + size_t{3} * (before.num_contacts + old), 3 * sizeof *set.followed);
  }
  if (!again) memset(set.stiffness, 0, set.num_axes * sizeof *set.stiffness);
  memset(set.traction, 0, size_t{3} * set.num_nodes * sizeof *set.traction);
  // A patch moves as one: as the mean of its nodes, but for its turn.
  double held[kMostZoneContacts] = {};
  for (uint32_t g = 0; g < set.num_groups; ++g) {
    const ZoneGroup& group = set.groups[g];
    const uint32_t first = group.first_node + group.num_interior + group.num_boundary;
    for (uint32_t i = first; i < first + group.num_held; ++i) {
      const double* rest = pack.zone_nodes[set.nodes[i]].displacement;
      for (uint32_t m = set.first_master[i]; m < set.first_master[i + 1]; ++m) {
        const uint32_t contact = group.contacts[(set.masters[m].unknown - group.unknowns) / 3];
        held[contact] += 1;
        double moved[3];
        for (uint32_t axis = 0; axis < 3; ++axis) moved[axis] = set.displacement[3 * i + axis] - rest[axis];
        if (set.masters[m].turn != kNoUnknown) {
          double arm[3];
          double turned[3];
          rest_arm(pack, set, contact, set.nodes[i], arm);
          rotate(patch_rotation(set, contact), arm, turned);
          for (uint32_t axis = 0; axis < 3; ++axis) moved[axis] -= turned[axis] - arm[axis];
        }
        for (uint32_t axis = 0; axis < 3; ++axis) set.followed[3 * contact + axis] += moved[axis];
      }
    }
  }
  for (uint32_t c = 0; c < set.num_contacts; ++c) {
    for (uint32_t axis = 0; axis < 3 && held[c] > 0; ++axis) set.followed[3 * c + axis] /= held[c];
  }
  memcpy(set.wanted, set.followed, set.num_axes * sizeof *set.wanted);
  // What the linear organ makes of the nodes that come may be no state at all.
  for (uint32_t g = 0; g < set.num_groups; ++g) {
    memset(set.groups[g].coupled, 0, size_t{2} * set.groups[g].boundary_stride * sizeof(double));  // and b
    carry_pressures(before, set.groups[g]);
    const ZoneStrain strain = add_zone_forces(set.groups[g].batches, set.displacement, state.forces);
    set.groups[g].longest_step = kLongestStep;
    keep_balance(set, set.groups[g]);
    set.groups[g].has_balance = false;
    if (!(strain.smallest_jacobian > kLeastJacobian)) rest_group(pack, set, set.groups[g]);
  }
}

// The next set answers, and the one that did is next.
void swap_zone_sets(ZoneState& state) {
  const ZoneSet made = state.next;
  state.next = state.active;
  state.active = made;
  double* const free = state.tangents[1];
  state.tangents[1] = state.tangents[0];
  state.tangents[0] = state.tangents[2];
  state.tangents[2] = free;
  for (uint32_t g = 0; g < made.num_groups; ++g) {
    ZoneGroup& group = state.active.groups[g];
    (group.factor == nullptr ? group.factor : group.spare) = state.tangents[1] + group.tangent_place;
  }
}

}  // namespace

bool place_next(const pal_pack& pack, uint64_t operations, ZoneState& state, uint64_t& spent) {
  const ZoneSet& before = state.active;
  if (state.column == 0) {
    state.is_before_strained = state.strained;
    ZoneFrame frame = {pack, state, state.active, 0};
    find_tractions_from_rest(frame);
    memcpy(state.tractions_before, before.traction, size_t{3} * before.num_nodes * sizeof(double));
  }
  mark_places(true, state);
  for (; state.column < state.next.num_nodes && spent < operations; ++state.column)
    spent += place_node(pack, false, state.column, state);
  mark_places(false, state);
  if (state.column < state.next.num_nodes) return false;
  begin_where(pack, false, state);
  for (uint32_t g = 0; g < state.next.num_groups; ++g)
    spent += force_operations(state.next.groups[g].batches);
  return true;
}

void let_next_answer(const pal_pack& pack, ZoneState& state) {
  ZoneSet& set = state.next;
  double before[kMostZoneAxes];
  memcpy(before, set.followed, set.num_axes * sizeof *before);
  mark_places(true, state);
  for (uint32_t i = 0; i < set.num_nodes; ++i) place_node(pack, true, i, state);
  mark_places(false, state);
  begin_where(pack, true, state);
  const ZoneFrame frame = {pack, state, set, 0};
  for (uint32_t g = 0; g < set.num_groups; ++g) {
    ZoneGroup& group = set.groups[g];
    for (uint32_t i = 0; i < group.num_axes; ++i) {
      const uint32_t at = contact_axis(set, group, i);
      group.moved += length_of(frame, at, set.followed[at] - before[at]);
    }
  }
  drop_correction(set);
  set.correction.number = state.active.correction.number + 1;
  set.ready = true;
  swap_zone_sets(state);
}

}  // namespace palpate
