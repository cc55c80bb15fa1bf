#include "runtime/src/zone/zone_set.hpp"

#include <string.h>

#include <algorithm>

#include "runtime/src/pack/contact_place.hpp"
#include "runtime/src/pack/pack_view.hpp"

namespace palpate {
namespace {

ZonePlace place_now(const ZoneSet& set) {
  return {set.displacement, set.followed, set.force, set.points, set.stiffness};
}

// Of a group.
void copy_place(const ZoneSet& set, const ZoneGroup& group, const ZonePlace& from, const ZonePlace& to) {
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

void carve_zone(const pal_pack& pack, uint32_t max_contacts, uint32_t max_fixed, uint32_t rings, bool turns,
                Arena& arena, ZoneState& state) {
  state = {};
  state.axes_per_contact = turns ? 6 : 3;
  state.max_contacts = max_contacts < kMostZoneContacts ? max_contacts : kMostZoneContacts;
  state.max_fixed = max_fixed < kMostZoneFixed ? max_fixed : kMostZoneFixed;
  state.rings = rings;
  const auto times = [&](uint32_t of_site, uint32_t all) {
    const uint64_t most = uint64_t{of_site} * state.max_contacts;
    return static_cast<uint32_t>(most < all ? most : all);
  };
  const uint32_t fixed = state.max_contacts * state.max_fixed;
  state.max_nodes = times(pack.most_zone_nodes, pack.num_zone_nodes) + fixed;
  state.max_elements = times(pack.most_zone_elements, pack.num_zone_elements);
  state.max_quadratic = state.max_elements < pack.num_quadratic ? state.max_elements : pack.num_quadratic;
  const uint32_t boundary = state.max_boundary = times(pack.most_zone_boundary, pack.num_zone_nodes) + fixed;
  state.max_masters = state.max_contacts * pack.max_patch_nodes;
  const uint32_t axes = state.axes_per_contact * state.max_contacts;
  const size_t squares = elimination_stride(3 * boundary + kEliminationRows * state.max_contacts);
  state.max_exterior = squares * squares;
  state.max_matrices = squares * (2 * squares + 3);
  const uint32_t unknowns = 3 * state.max_nodes + kEliminationColumns;
  state.max_rows = size_t{2 * axes + 3} * (unknowns + kEliminationColumns * state.max_contacts);
  const uint32_t size = unknowns + axes + kEliminationRows * state.max_contacts;
  state.max_tangents = size_t{round_to_columns(size)} * elimination_stride(size);
  const uint32_t own = unknowns + kEliminationColumns;
  const uint32_t twice = 2 * (3 * boundary + kEliminationColumns);
  const uint32_t largest = own > twice ? own : twice;
  state.max_preparation =
      size_t{largest + 2 * kEliminationColumns} * elimination_stride(largest + kEliminationColumns);
  for (ZoneSet* set : {&state.active, &state.next}) {
    set->sites = arena.take<uint32_t>(state.max_contacts);
    set->fixed = arena.take<uint32_t>(state.max_fixed);
    set->groups = arena.take<ZoneGroup>(state.max_contacts);
    set->followed = arena.take<double>(axes);
    set->wanted = arena.take<double>(axes);
    set->force = arena.take<double>(axes);
    set->stiffness = arena.take<double[kMostZoneAxes]>(axes);
    set->points = arena.take<double[3]>(state.max_contacts);
    set->places = arena.take<double[3]>(state.max_contacts);
    set->turning = arena.take<double[9]>(state.max_contacts);
    set->nodes = arena.take<uint32_t>(state.max_nodes);
    set->elements = arena.take<uint32_t>(state.max_elements);
    set->unknown_of = arena.take<uint32_t>(state.max_nodes);
    set->first_master = arena.take<uint32_t>(size_t{state.max_nodes} + 1);
    set->masters = arena.take<ZoneMaster>(state.max_masters);
    set->displacement = arena.take<double>(size_t{3} * state.max_nodes);
    set->rest_force = arena.take<double>(size_t{3} * state.max_nodes);
    set->traction = arena.take<double>(size_t{3} * state.max_nodes);
    ZoneCorrection& correction = set->correction;
    correction.followed_then = arena.take<double>(axes);
    for (double** values : {&correction.force, &correction.displacement_then})
      *values = arena.take<double>(size_t{3} * state.max_nodes);
    set->balanced = {arena.take<double>(size_t{3} * state.max_nodes), arena.take<double>(axes),
                     arena.take<double>(axes), arena.take<double[3]>(state.max_contacts),
                     arena.take<double[kMostZoneAxes]>(axes)};
    const auto batches = [&](uint32_t elements) { return elements / kLanes + state.max_contacts; };
    set->linear = arena.take<ZoneBatch<4>>(batches(state.max_elements));
    if (state.max_quadratic > 0) set->quadratic = arena.take<ZoneBatch<10>>(batches(state.max_quadratic));
    if (pack.num_sharing > 0)
      set->patches = arena.take<ZonePatch>(state.max_elements < pack.num_sharing ? state.max_elements
                                                                                 : pack.num_sharing);
    set->matrices = arena.take<double>(state.max_matrices);
    set->rows = arena.take<double>(state.max_rows);
    set->others = arena.take<double[kMostZoneAxes]>(3 * state.max_contacts);
  }
  state.node_contacts = arena.take<uint64_t>(pack.num_zone_nodes);
  state.element_contacts = arena.take<uint64_t>(pack.num_zone_elements);
  state.found_nodes = arena.take<uint32_t>(state.max_nodes);
  state.found_elements = arena.take<uint32_t>(state.max_elements);
  state.queue = arena.take<uint32_t>(state.max_nodes);
  state.place_of = arena.take<uint32_t>(pack.num_zone_nodes);
  state.base = arena.take<uint32_t>(state.max_nodes);
  state.preparation = arena.take<double>(state.max_preparation);
  state.tractions_before = arena.take<double>(size_t{3} * state.max_nodes);
  state.exterior = arena.take<double>(state.max_exterior);
  for (double*& tangents : state.tangents) tangents = arena.take<double>(state.max_tangents);
  state.forces = arena.take<double>(size_t{3} * state.max_nodes);
  state.saved = arena.take<double>(size_t{3} * state.max_nodes);
  const size_t vector = size_t{3} * state.max_nodes + kMostZoneAxes + 2 * kEliminationRows;
  for (double** of_group : {&state.residual, &state.boundary, &state.outside, &state.vector})
    *of_group = arena.take<double>(vector);
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
  const pack::ZoneNode& entry = pack.zone_nodes[node];
  for (int i = 0; i < 3; ++i) out[i] = entry.position[i] + entry.displacement[i] - set.points[contact][i];
}

bool has_exterior(const ZoneSet& set) {
  return std::any_of(set.groups, set.groups + set.num_groups,
                     [](const ZoneGroup& group) { return group.num_boundary > 0; });
}

size_t exterior_size(const ZoneSet& set) {
  size_t all = 0;
  size_t size = 0;
  for (uint32_t g = 0; g < set.num_groups; ++g) all += size_t{3} * set.groups[g].num_boundary;
  for (uint32_t g = 0; g < set.num_groups; ++g) {
    const ZoneGroup& group = set.groups[g];
    size += group.boundary_stride * (all + group.boundary_stride - size_t{3} * group.num_boundary);
  }
  return size;
}

void use_exterior(double* exterior, ZoneSet& set) {
  uint32_t all = 0;
  for (uint32_t g = 0; g < set.num_groups; ++g) all += 3 * set.groups[g].num_boundary;
  for (uint32_t g = 0; g < set.num_groups; ++g) {
    ZoneGroup& group = set.groups[g];
    group.exterior = exterior;
    group.couplings = exterior + size_t{group.boundary_stride} * group.boundary_stride;
    exterior = group.couplings + size_t{group.boundary_stride} * (all - 3 * group.num_boundary);
    group.has_new_exterior = true;
  }
}

void drop_correction(ZoneSet& set) {
  ZoneCorrection& correction = set.correction;
  memset(correction.force, 0, size_t{3} * set.num_nodes * sizeof *correction.force);
  correction.energy = 0;
  correction.tangent = 0;
  for (uint32_t g = 0; g < set.num_groups; ++g) {
    ZoneGroup& group = set.groups[g];
    if (group.exterior == group.exterior_at_rest) continue;
    group.exterior = group.exterior_at_rest;
    group.couplings = nullptr;
    group.has_new_exterior = true;
  }
  correction.is_refined = false;
  correction.failures = 0;
  ++correction.restarts;
}

void keep_balance(ZoneSet& set, ZoneGroup& group) {
  copy_place(set, group, place_now(set), set.balanced);
  for (uint32_t p = 0; p < group.batches.num_patches; ++p)
    group.batches.patches[p].balanced = group.batches.patches[p].followed;
  group.stored_in_balance = group.stored;
  group.has_balance = true;
}

void go_back_to_balance(ZoneSet& set, ZoneGroup& group) {
  copy_place(set, group, set.balanced, place_now(set));
  for (uint32_t p = 0; p < group.batches.num_patches; ++p)
    group.batches.patches[p].followed = group.batches.patches[p].balanced;
  group.stored = group.stored_in_balance;
  group.has_tangent = false;
  group.is_assembling = false;
  group.has_trend = false;
  group.is_back = true;
}

void rest_group(const pal_pack& pack, ZoneSet& set, ZoneGroup& group) {
  for (uint32_t i = group.first_node; i < group.first_node + group.num_nodes; ++i) {
    memcpy(set.displacement + size_t{3} * i, pack.zone_nodes[set.nodes[i]].displacement, 3 * sizeof(double));
    memset(set.traction + size_t{3} * i, 0, 3 * sizeof(double));
  }
  for (uint32_t i = 0; i < group.num_axes; ++i) {
    const uint32_t at = contact_axis(set, group, i);
    set.followed[at] = set.wanted[at] = set.force[at] = 0;
    memset(set.stiffness[at], 0, sizeof *set.stiffness);  // until there is a tangent
  }
  for (uint32_t slot = 0; slot < group.num_contacts; ++slot)
    memset(set.turning[group.contacts[slot]], 0, sizeof *set.turning);
  for (uint32_t p = 0; p < group.batches.num_patches; ++p)
    group.batches.patches[p].followed = group.batches.patches[p].at_rest;
  drop_correction(set);
  group.stored = 0;
  group.has_tangent = false;
  group.is_assembling = false;
  group.has_trend = false;
  group.is_back = true;
  group.failures = group.astray = group.late = group.jammed = 0;
  group.longest_step = kLongestStep;
  keep_balance(set, group);
}

void zone_compliance(const pal_pack& pack, uint32_t i, uint32_t j, double block[9]) {
  const uint32_t high = i > j ? i : j;
  const uint32_t low = i > j ? j : i;
  const double* lower = high < pack.num_contact_nodes
                            ? pack.contact_compliance + 9 * pack::lower_block(high, low)
                            : pack.zone_compliance + 9 * (pack::lower_block(high, low) -
                                                          pack::lower_block(pack.num_contact_nodes, 0));
  for (uint32_t row = 0; row < 3; ++row) {
    for (uint32_t column = 0; column < 3; ++column)
      block[3 * row + column] = i >= j ? lower[3 * row + column] : lower[3 * column + row];
  }
}

}  // namespace palpate
