#include "runtime/src/zone/zone_set.hpp"

#include <math.h>
#include <string.h>

#include <algorithm>

#include "runtime/src/pack/contact_place.hpp"
#include "runtime/src/pack/pack_view.hpp"

namespace palpate {
namespace {

SetState current_state(const ZoneSet& set) {
  return {set.displacement, set.followed, set.force, set.points, set.stiffness};
}

// Copies the state of a group between two sets of arrays.
void copy_group_state(const ZoneSet& set, const ZoneGroup& group, const SetState& from, const SetState& to) {
  const size_t first = size_t{3} * group.first_node;
  memcpy(to.displacement + first, from.displacement + first,
         size_t{3} * group.num_nodes * sizeof *to.displacement);
  for (uint32_t i = 0; i < group.num_axes; ++i) {
    const uint32_t at = contact_axis(set, group, i);
    to.followed[at] = from.followed[at];
    to.force[at] = from.force[at];
    memcpy(to.stiffness[at], from.stiffness[at], sizeof *to.stiffness);
  }
  for (uint32_t slot = 0; slot < group.num_contacts; ++slot) {
    const uint32_t contact = group.contacts[slot];
    memcpy(to.points[contact], from.points[contact], sizeof *to.points);
  }
}

}  // namespace

ZoneRoom zone_room(const pal_pack& pack, uint32_t max_contacts, uint32_t max_fixed, uint32_t rings,
                   bool turns) {
  ZoneRoom room = {};
  room.axes_per_contact = turns ? 6 : 3;
  room.contacts = std::min(max_contacts, kMostZoneContacts);
  room.fixed = std::min(max_fixed, kMostZoneFixed);
  room.rings = rings;
  const auto of_contacts = [&](uint32_t of_site, uint32_t all) {
    return static_cast<uint32_t>(std::min<uint64_t>(uint64_t{of_site} * room.contacts, all));
  };
  room.nodes = of_contacts(pack.most_zone_nodes, pack.num_zone_nodes) + room.fixed;
  room.elements = of_contacts(pack.most_zone_elements, pack.num_zone_elements);
  room.quadratic = std::min(room.elements, pack.organ.num_quadratic);
  room.boundary = of_contacts(pack.most_zone_boundary, pack.num_zone_nodes) + room.fixed;
  room.masters = room.contacts * pack.max_patch_nodes;
  // Each group rounds its sizes up to kSymmetricRows, kEliminationColumns and kEliminationRows.
  const size_t stride = symmetric_stride(3 * room.boundary + kSymmetricRows * room.contacts);
  room.exterior = stride * stride;
  const uint32_t axes = room.axes_per_contact * room.contacts;
  const uint32_t unknowns = 3 * room.nodes + kEliminationColumns;
  const size_t of_unknowns = size_t{unknowns} + kEliminationColumns * room.contacts;
  room.rows = 3 * of_unknowns + (axes + 3) * stride;
  room.tangent_rows = axes * of_unknowns;
  const uint32_t size = unknowns + axes + kEliminationRows * room.contacts;
  room.tangents = size_t{round_to_columns(size)} * elimination_stride(size);
  return room;
}

void carve_set(const pal_pack& pack, const ZoneRoom& room, Arena& arena, ZoneSet& set) {
  const uint32_t axes = room.axes_per_contact * room.contacts;
  const size_t values = size_t{3} * room.nodes;
  set.sites = arena.take<uint32_t>(room.contacts);
  set.fixed = arena.take<uint32_t>(room.fixed);
  set.groups = arena.take<ZoneGroup>(room.contacts);
  set.followed = arena.take<double>(axes);
  set.wanted = arena.take<double>(axes);
  set.force = arena.take<double>(axes);
  set.coupled_force = arena.take<double>(axes);
  set.coupled_stiffness = arena.take<double[kMostZoneAxes]>(axes);
  set.stiffness = arena.take<double[kMostZoneAxes]>(axes);
  set.points = arena.take<double[3]>(room.contacts);
  set.places = arena.take<double[3]>(room.contacts);
  set.turning = arena.take<double[9]>(room.contacts);
  set.nodes = arena.take<uint32_t>(room.nodes);
  set.unknown_of = arena.take<uint32_t>(room.nodes);
  set.first_master = arena.take<uint32_t>(size_t{room.nodes} + 1);
  set.masters = arena.take<ZoneMaster>(room.masters);
  for (double** of_nodes : {&set.displacement, &set.rest_force, &set.correction.force})
    *of_nodes = arena.take<double>(values);
  set.correction.followed_then = arena.take<double>(axes);
  set.correction.coupled_then = arena.take<double>(axes);
  set.balanced = {arena.take<double>(values), arena.take<double>(axes), arena.take<double>(axes),
                  arena.take<double[3]>(room.contacts), arena.take<double[kMostZoneAxes]>(axes)};
  const auto batches = [&](uint32_t elements) { return elements / kLanes + room.contacts; };
  set.linear = arena.take<ZoneBatch<4>>(batches(room.elements));
  if (room.quadratic > 0) set.quadratic = arena.take<ZoneBatch<10>>(batches(room.quadratic));
  set.patches = arena.take<ZonePatch>(std::min(room.elements, pack.organ.num_patches));
  set.exterior_at_rest = arena.take<float>(room.exterior);
  set.rows = arena.take<double>(room.rows);
}

TangentBuffers carve_tangents(const ZoneRoom& room, Arena& arena) {
  return {arena.take<float>(room.tangents), arena.take<double>(room.tangent_rows)};
}

void carve_work(const ZoneRoom& room, Arena& arena, ZoneWork& work) {
  const size_t values = size_t{3} * room.nodes;
  work.forces = arena.take<double>(values);
  work.saved = arena.take<double>(values);
  for (double** of_group : {&work.residual, &work.boundary, &work.outside, &work.vector})
    *of_group = arena.take<double>(values + kMostZoneAxes + 2 * kEliminationRows);
}

void carve_zone(const pal_pack& pack, const ZoneRoom& room, Arena& arena, ZoneState& state) {
  state = {};
  state.room = room;
  carve_set(pack, room, arena, state.active);
  state.tangents = carve_tangents(room, arena);
  state.exterior = arena.take<float>(room.exterior);
  carve_work(room, arena, state.work);
}

bool is_zone_for(const ZoneSet& set, const pal_contact* contacts, uint32_t count, uint32_t fixed_version) {
  if (set.num_contacts != count || set.fixed_version != fixed_version) return false;
  for (uint32_t c = 0; c < count; ++c) {
    if (!is_about_nearest(contacts[c], set.sites[c])) return false;
  }
  return true;
}

void find_places(const pal_pack& pack, const pal_contact* contacts, ZoneSet& set) {
  for (uint32_t c = 0; c < set.num_contacts; ++c) {
    const ContactPlace place = place_of(contacts[c]);
    double* point = set.places[c];
    for (int i = 0; i < 3; ++i) point[i] = 0;
    for (uint32_t k = 0; k < place.count; ++k) {
      const double* corner = pack.rest_positions + size_t{3} * pack.site_nodes[place.corners[k].site];
      for (int i = 0; i < 3; ++i) point[i] += place.corners[k].weight * corner[i];
    }
  }
}

const ZoneGroup* group_of(const ZoneSet& set, uint32_t contact) {
  for (uint32_t g = 0; g < set.num_groups; ++g) {
    const ZoneGroup& group = set.groups[g];
    for (uint32_t i = 0; i < group.num_contacts; ++i) {
      if (group.contacts[i] == contact) return &group;
    }
  }
  return nullptr;
}

bool is_alone_in_zone(const ZoneSet& set, uint32_t contact) {
  const ZoneGroup* group = group_of(set, contact);
  return group != nullptr && group->num_contacts == 1;
}

Rotation patch_rotation(const ZoneSet& set, uint32_t contact) {
  double q[4];
  quaternion_of(set.followed + 3 * (set.num_contacts + contact), q);
  return rotation_of(q);
}

void rest_arm(const pal_pack& pack, const ZoneSet& set, uint32_t contact, uint32_t node, double out[3]) {
  const pack::OrganNode& entry = pack.organ.nodes[node];
  for (int i = 0; i < 3; ++i) out[i] = entry.position[i] + entry.displacement[i] - set.points[contact][i];
}

bool has_exterior(const ZoneSet& set) {
  return std::any_of(set.groups, set.groups + set.num_groups,
                     [](const ZoneGroup& group) { return group.num_boundary > 0; });
}

size_t exterior_size(const ZoneSet& set) {
  size_t size = 0;
  for (uint32_t g = 0; g < set.num_groups; ++g)
    size += size_t{set.groups[g].boundary_stride} * set.groups[g].boundary_stride;
  return size;
}

void use_exterior(float* exterior, ZoneSet& set) {
  for (uint32_t g = 0; g < set.num_groups; ++g) {
    ZoneGroup& group = set.groups[g];
    group.exterior.stiffness = exterior;
    exterior += size_t{group.boundary_stride} * group.boundary_stride;
  }
}

void drop_correction(ZoneSet& set) {
  ZoneCorrection& correction = set.correction;
  memset(correction.force, 0, size_t{3} * set.num_nodes * sizeof *correction.force);
  memset(correction.followed_then, 0, set.num_axes * sizeof *correction.followed_then);
  memset(correction.coupled_then, 0, set.num_axes * sizeof *correction.coupled_then);
  correction.energy = 0;
  if (correction.tangent != correction.rest_tangent) use_exterior(set.exterior_at_rest, set);
  correction.tangent = correction.rest_tangent;
  correction.field = correction.rest_field;
  correction.is_refined = correction.is_unstable = false;
  correction.failures = 0;
  ++correction.restarts;
}

void find_axes_change(uint32_t num_contacts, uint32_t num_axes, const double* from, const double* to,
                      double* change) {
  for (uint32_t i = 0; i < 3 * num_contacts; ++i) change[i] = to[i] - from[i];
  for (uint32_t i = 3 * num_contacts; i < num_axes; i += 3) find_turn_change(from + i, to + i, change + i);
}

namespace {

// Drops the tangent. The infinite length outdates a tangent that the refining lane is making at this time.
void drop_tangent(ZoneGroup& group) {
  group.has_tangent = false;
  group.trend.is_good = false;
  group.tangent.moved_since = static_cast<double>(INFINITY);
}

}  // namespace

void keep_balance(ZoneSet& set, ZoneGroup& group) {
  copy_group_state(set, group, current_state(set), set.balanced);
  for (uint32_t p = 0; p < group.batches.num_patches; ++p)
    group.batches.patches[p].balanced = group.batches.patches[p].followed;
  memcpy(group.exterior.coupled_in_balance, group.exterior.coupled,
         group.boundary_stride * sizeof *group.exterior.coupled);
  group.stored_in_balance = group.stored;
  group.has_balance = true;
}

void go_back_to_balance(ZoneSet& set, ZoneGroup& group) {
  copy_group_state(set, group, set.balanced, current_state(set));
  for (uint32_t p = 0; p < group.batches.num_patches; ++p)
    group.batches.patches[p].followed = group.batches.patches[p].balanced;
  group.stored = group.stored_in_balance;
  drop_tangent(group);
  group.setbacks.is_back = true;
}

void rest_group(const pal_pack& pack, ZoneSet& set, ZoneGroup& group) {
  for (uint32_t i = group.first_node; i < group.first_node + group.num_nodes; ++i)
    memcpy(set.displacement + size_t{3} * i, node_at(pack, set, i).displacement, 3 * sizeof(double));
  for (uint32_t i = 0; i < group.num_axes; ++i) {
    const uint32_t at = contact_axis(set, group, i);
    set.followed[at] = set.wanted[at] = set.force[at] = set.coupled_force[at] = 0;
    memset(set.stiffness[at], 0, sizeof *set.stiffness);  // unknown without a tangent
  }
  for (uint32_t slot = 0; slot < group.num_contacts; ++slot)
    memset(set.turning[group.contacts[slot]], 0, sizeof *set.turning);
  for (uint32_t p = 0; p < group.batches.num_patches; ++p)
    group.batches.patches[p].followed = group.batches.patches[p].at_rest;
  // The balances of the other groups belong to the correction that is dropped here.
  for (uint32_t g = 0; g < set.num_groups && set.correction.is_refined; ++g)
    set.groups[g].has_balance = false;
  drop_correction(set);
  group.stored = 0;
  drop_tangent(group);
  group.setbacks.is_back = true;
  group.setbacks.failures = group.setbacks.stalled = group.setbacks.nearer_rest = group.setbacks.jammed = 0;
  group.setbacks.longest_step = kLongestStep;
  keep_balance(set, group);
}

}  // namespace palpate
