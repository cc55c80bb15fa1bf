#include "runtime/src/zone_set.hpp"

#include <string.h>

#include "runtime/src/contact_place.hpp"
#include "runtime/src/pack_view.hpp"
#include "runtime/src/zone_exterior.hpp"
#include "runtime/src/zone_handover.hpp"
#include "runtime/src/zone_members.hpp"
#include "runtime/src/zone_overlap.hpp"
#include "runtime/src/zone_rim.hpp"
#include "runtime/src/zone_tangent.hpp"

namespace palpate {
namespace {

// Room for S, T, the exterior, the couplings, the tangents and their sensitivities.
bool take_matrices(const pal_pack& pack, ZoneState& state, uint32_t num_boundary, ZoneGroup& group) {
  ZoneSet& set = state.next;
  const size_t square = size_t{group.boundary_stride} * group.boundary_stride;
  const size_t fields = size_t{num_exterior_columns(pack, set.num_contacts)} * group.boundary_stride;
  const size_t rows = size_t{group.num_axes + group.num_fitted + 3} * group.unknowns;
  const size_t order = round_to_columns(3 * group.num_boundary);
  const size_t columns = num_overlaps(pack, set);
  const size_t own = round_to_columns(3 * (group.num_interior + group.num_held)) + order + columns;
  const size_t largest = own > 2 * order ? own : 2 * order;
  const size_t preparation =
      (largest + kEliminationColumns) * elimination_stride(static_cast<uint32_t>(largest));
  const size_t couplings = size_t{group.boundary_stride} * 3 * (num_boundary - group.num_boundary);
  const size_t loads = size_t{group.num_fitted} * group.boundary_stride;
  const uint32_t of_contacts = 3 * group.num_contacts;
  const size_t changes = elimination_stride((group.num_axes + of_contacts) * of_contacts);
  const size_t overlaps = columns * group.boundary_stride;
  const size_t matrices =
      2 * (square + loads) + overlaps + couplings + changes + size_t{7} * group.boundary_stride;
  const size_t tangent = size_t{round_to_columns(group.size)} * group.stride;
  if (state.matrices_used + matrices > state.max_matrices ||
      state.columns_used + 2 * fields > state.max_columns || state.rows_used + rows > state.max_rows ||
      state.tangents_used + tangent > state.max_tangents || preparation > state.max_preparation)
    return false;
  group.exterior = set.matrices + state.matrices_used;
  group.whole = group.exterior + square;
  group.exterior_fields = set.columns + state.columns_used;
  group.exterior_pulls = group.exterior_fields + fields;
  group.overlaps = group.whole + square;
  group.loads_of_tractions = group.overlaps + overlaps;
  group.loads_of_moves = group.loads_of_tractions + loads;
  group.couplings = group.loads_of_moves + loads;
  group.coupled = group.couplings + couplings;
  group.coupled_trend = group.coupled + size_t{2} * group.boundary_stride;
  group.coupled_began = group.coupled_trend + size_t{2} * group.boundary_stride;
  group.exterior_force = group.coupled_began + size_t{2} * group.boundary_stride;
  group.brought = group.exterior_force + group.boundary_stride;
  group.back = group.brought + group.num_axes * of_contacts;
  group.tangent_place = state.tangents_used;
  group.factor = nullptr;
  group.spare = state.tangents[2] + group.tangent_place;
  group.sensitivities = set.rows + state.rows_used;
  group.trend = group.sensitivities + rows - size_t{2} * group.unknowns;
  group.began = group.trend + group.unknowns;
  state.tangents_used += tangent;
  state.matrices_used += matrices;
  state.columns_used += 2 * fields;
  state.rows_used += rows;
  return true;
}

// Which nodes and elements, who shares a zone, and room for all of it.
bool collect(const pal_pack& pack, ZoneState& state) {
  bool sound = find_zone_members(pack, state);
  uint32_t num_boundary = 0;
  for (uint32_t g = 0; g < state.next.num_groups; ++g) num_boundary += state.next.groups[g].num_boundary;
  for (uint32_t g = 0; g < state.next.num_groups && sound; ++g)
    sound = take_matrices(pack, state, num_boundary, state.next.groups[g]);
  return sound;
}

// [ C_BB  . ]
// [ 1     0 ], whose last block becomes -C_BB^-1; an axis that is held gets a compliance of its own.
void fill_compliance(const pal_pack& pack, const ZoneSet& set, const ZoneGroup& group, double* matrix) {
  const uint32_t order = round_to_columns(3 * group.num_boundary);
  const uint32_t stride = elimination_stride(2 * order);
  memset(matrix, 0, size_t{2} * order * stride * sizeof *matrix);
  const uint32_t* nodes = set.nodes + group.first_node + group.num_interior;
  for (uint32_t j = 0; j < group.num_boundary; ++j) {
    for (uint32_t i = j; i < group.num_boundary; ++i) {
      double block[9];
      zone_compliance(pack, nodes[i], nodes[j], block);
      for (uint32_t entry = 0; entry < 9; ++entry)
        matrix[size_t{3 * j + entry % 3} * stride + 3 * i + entry / 3] = block[entry];
    }
  }
  for (uint32_t i = 0; i < order; ++i) {
    double& diagonal = matrix[size_t{i} * stride + i];
    const bool is_free =
        i < 3 * group.num_boundary && (pack.zone_nodes[nodes[i / 3]].free_axes >> (i % 3) & 1) != 0;
    if (!is_free) diagonal = 1;
    matrix[size_t{i} * stride + order + i] = 1;
  }
}

// T from what elimination has left. Unsound where a node is held by more of its neighbours than any tissue is: the
// forces would not fit into a float.
void take_whole(const pal_pack& pack, ZoneSet& set, const double* matrix, ZoneGroup& group) {
  constexpr double kMostHeld = 1e8;  // as kLargestNodalForce of linear_dd
  const uint32_t order = round_to_columns(3 * group.num_boundary);
  const uint32_t stride = elimination_stride(2 * order);
  memset(group.whole, 0, size_t{group.boundary_stride} * group.boundary_stride * sizeof *group.whole);
  for (uint32_t j = 0; j < 3 * group.num_boundary; ++j) {
    for (uint32_t i = j; i < 3 * group.num_boundary; ++i) {
      const double entry = -matrix[size_t{order + j} * stride + order + i];
      group.whole[size_t{j} * group.boundary_stride + i] = entry;
      group.whole[size_t{i} * group.boundary_stride + j] = entry;
    }
  }
  for (uint32_t i = 0; i < 3 * group.num_boundary; ++i) {
    const uint32_t node = set.nodes[group.first_node + group.num_interior + i / 3];
    double own[9];
    zone_compliance(pack, node, node, own);
    if (!(group.whole[size_t{i} * group.boundary_stride + i] * own[4 * (i % 3)] <= kMostHeld))
      set.sound = false;
  }
}

// Where the nodes stand in the zone's own stiffness: interior and held, then boundary.
void list_own_unknowns(const ZoneGroup& group, uint32_t eliminated, uint32_t* base) {
  const uint32_t free = group.num_interior + group.num_boundary;
  for (uint32_t i = 0; i < group.num_nodes; ++i) {
    uint32_t& own = base[group.first_node + i];
    if (i < group.num_interior) {
      own = 3 * i;
    } else if (i < free) {
      own = eliminated + 3 * (i - group.num_interior);
    } else {
      own = i < free + group.num_held ? 3 * (i - group.num_boundary) : kNoUnknown;
    }
  }
}

// Rows of the zone's own stiffness that elimination leaves: of the boundary, then those of fill_overlaps().
uint32_t rows_left(const pal_pack& pack, const ZoneSet& set, const ZoneGroup& group) {
  return 3 * group.num_boundary + num_overlaps(pack, set);
}

// K_V at rest, and the nodal forces there.
void fill_own_stiffness(const pal_pack& pack, ZoneState& state, const ZoneGroup& group) {
  ZoneSet& set = state.next;
  const uint32_t eliminated = round_to_columns(3 * (group.num_interior + group.num_held));
  const uint32_t size = eliminated + rows_left(pack, set, group);
  const uint32_t stride = elimination_stride(size);
  double* matrix = state.preparation;
  memset(matrix, 0, size_t{round_to_columns(size)} * stride * sizeof *matrix);
  list_own_unknowns(group, eliminated, state.base);
  for (uint32_t i = group.first_node; i < group.first_node + group.num_nodes; ++i) {
    memcpy(set.displacement + size_t{3} * i, pack.zone_nodes[set.nodes[i]].displacement, 3 * sizeof(double));
    for (uint32_t axis = 0; axis < 3; ++axis) set.rest_force[3 * i + axis] = 0;
  }
  const ZoneUnknowns unknowns = {state.base, nullptr, nullptr};
  add_zone_forces(group.batches, set.displacement, set.rest_force);
  for (uint32_t p = 0; p < group.batches.num_patches; ++p) {
    ZonePatch& patch = group.batches.patches[p];
    patch.followed = patch.at_rest = patch.pressure;
  }
  add_zone_stiffness(group.batches, set.displacement, unknowns, matrix, stride);
  for (uint32_t i = 3 * (group.num_interior + group.num_held); i < eliminated; ++i)
    matrix[size_t{i} * stride + i] = 1;
  for (uint32_t i = group.first_node; i < group.first_node + group.num_nodes; ++i) {
    const uint32_t axes = pack.zone_nodes[set.nodes[i]].free_axes;
    for (uint32_t axis = 0; axis < 3 && state.base[i] != kNoUnknown; ++axis) {
      if ((axes >> axis & 1) == 0) drop_unknown(state.base[i] + axis, size, stride, matrix);
    }
  }
}

// S from T and what elimination has left of K_V; g of what it has left of n2_V. Not sound where that is not finite.
void take_exterior(const pal_pack& pack, ZoneSet& set, const double* matrix, ZoneGroup& group) {
  const uint32_t eliminated = round_to_columns(3 * (group.num_interior + group.num_held));
  const uint32_t stride = elimination_stride(eliminated + rows_left(pack, set, group));
  const size_t boundary_stride = group.boundary_stride;
  const uint32_t overlaps = num_overlaps(pack, set);
  memcpy(group.exterior, group.whole, boundary_stride * boundary_stride * sizeof *group.exterior);
  for (uint32_t j = 0; j < 3 * group.num_boundary; ++j) {
    for (uint32_t i = j; i < 3 * group.num_boundary; ++i) {
      double& entry = group.exterior[j * boundary_stride + i];
      entry -= matrix[size_t{eliminated + j} * stride + eliminated + i];
      group.exterior[i * boundary_stride + j] = entry;
    }
    for (uint32_t column = 0; column < overlaps; ++column) {
      const double entry =
          matrix[size_t{eliminated + j} * stride + eliminated + 3 * group.num_boundary + column];
      group.overlaps[column * boundary_stride + j] = entry;
      set.sound = set.sound && isfinite(entry);
    }
  }
}

// C between the boundary of a group and a node of another's, three columns.
void fill_coupling(const pal_pack& pack, const ZoneSet& set, const ZoneGroup& group, uint32_t node,
                   double* columns) {
  memset(columns, 0, size_t{3} * group.boundary_stride * sizeof *columns);
  const uint32_t* nodes = set.nodes + first_boundary(group);
  for (uint32_t i = 0; i < group.num_boundary; ++i) {
    double block[9];
    zone_compliance(pack, nodes[i], node, block);
    for (uint32_t entry = 0; entry < 9; ++entry)
      columns[entry % 3 * size_t{group.boundary_stride} + 3 * i + entry / 3] = block[entry];
  }
}

// Some nodes of the boundaries of other groups, from state.column on: their couplings. True when it has ended.
bool couple_groups(const pal_pack& pack, uint64_t operations, ZoneState& state, const ZoneGroup& group,
                   uint64_t& spent) {
  const ZoneSet& set = state.next;
  uint32_t index = 0;
  for (uint32_t g = 0; g < set.num_groups; ++g) {
    const ZoneGroup& other = set.groups[g];
    if (&other == &group) continue;
    for (uint32_t b = 0; b < other.num_boundary; ++b, ++index) {
      if (index < state.column) continue;
      if (spent >= operations) return false;
      fill_coupling(pack, set, group, set.nodes[first_boundary(other) + b],
                    group.couplings + size_t{3} * index * group.boundary_stride);
      spent += uint64_t{36} * group.num_boundary;
      ++state.column;
    }
  }
  return true;
}

ZonePlace place_now(const ZoneSet& set) {
  return {set.displacement, set.followed, set.force, set.loads, set.points, set.stiffness};
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
    memcpy(to.loads + size_t{3} * contact, from.loads + size_t{3} * contact, 3 * sizeof *to.loads);
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
  const uint32_t loads = 3 * state.max_contacts;
  const uint32_t fitted = state.max_contacts > 1 ? loads : 0;
  const size_t squares = elimination_stride(3 * boundary + kEliminationRows * state.max_contacts);
  const size_t couplings = state.max_contacts > 1 ? squares : 0;
  const uint32_t overlaps = num_overlaps(pack, state.max_contacts);
  state.max_columns = squares * 2 * num_exterior_columns(pack, state.max_contacts);
  state.max_matrices = squares * (2 * squares + couplings + overlaps + 2 * fitted + 7) +
                       size_t{axes + loads} * loads + kEliminationRows * state.max_contacts;
  const uint32_t unknowns = 3 * state.max_nodes + kEliminationColumns;
  state.max_rows = size_t{axes + fitted + 3} * (unknowns + kEliminationColumns * state.max_contacts);
  const uint32_t size = unknowns + axes + fitted + loads + kEliminationRows * state.max_contacts;
  state.max_tangents = size_t{round_to_columns(size)} * elimination_stride(size);
  const uint32_t own = unknowns + kEliminationColumns + overlaps;
  const uint32_t twice = 2 * (3 * boundary + kEliminationColumns);
  const uint32_t largest = own > twice ? own : twice;
  state.max_preparation =
      size_t{largest + 2 * kEliminationColumns} * elimination_stride(largest + kEliminationColumns);
  for (ZoneSet* set : {&state.answering, &state.next}) {
    set->sites = arena.take<uint32_t>(state.max_contacts);
    set->fixed = arena.take<uint32_t>(state.max_fixed);
    set->groups = arena.take<ZoneGroup>(state.max_contacts);
    set->followed = arena.take<double>(axes);
    set->wanted = arena.take<double>(axes);
    set->force = arena.take<double>(axes);
    set->loads = arena.take<double>(loads);
    set->weights = arena.take<double>(num_exterior_columns(pack, state.max_contacts));
    set->stiffness = arena.take<double[kMostZoneAxes]>(axes);
    set->points = arena.take<double[3]>(state.max_contacts);
    set->places = arena.take<double[3]>(state.max_contacts);
    set->turning = arena.take<double[9]>(state.max_contacts);
    set->nodes = arena.take<uint32_t>(state.max_nodes);
    set->unknown_of = arena.take<uint32_t>(state.max_nodes);
    set->first_master = arena.take<uint32_t>(size_t{state.max_nodes} + 1);
    set->masters = arena.take<ZoneMaster>(state.max_masters);
    set->displacement = arena.take<double>(size_t{3} * state.max_nodes);
    set->rest_force = arena.take<double>(size_t{3} * state.max_nodes);
    set->traction = arena.take<double>(size_t{3} * state.max_nodes);
    set->balanced = {arena.take<double>(size_t{3} * state.max_nodes),
                     arena.take<double>(axes),
                     arena.take<double>(axes),
                     arena.take<double>(loads),
                     arena.take<double[3]>(state.max_contacts),
                     arena.take<double[kMostZoneAxes]>(axes)};
    const auto batches = [&](uint32_t elements) { return elements / kLanes + state.max_contacts; };
    set->linear = arena.take<ZoneBatch<4>>(batches(state.max_elements));
    if (state.max_quadratic > 0) set->quadratic = arena.take<ZoneBatch<10>>(batches(state.max_quadratic));
    if (pack.num_sharing > 0)
      set->patches = arena.take<ZonePatch>(state.max_elements < pack.num_sharing ? state.max_elements
                                                                                 : pack.num_sharing);
    set->matrices = arena.take<double>(state.max_matrices);
    set->columns = arena.take<float>(state.max_columns);
    set->rows = arena.take<double>(state.max_rows);
  }
  carve_rims(pack, arena, state);
  state.node_contacts = arena.take<uint64_t>(pack.num_zone_nodes);
  state.element_contacts = arena.take<uint64_t>(pack.num_zone_elements);
  state.found_nodes = arena.take<uint32_t>(state.max_nodes);
  state.found_elements = arena.take<uint32_t>(size_t{state.max_elements} + state.max_rim_elements);
  state.queue = arena.take<uint32_t>(state.max_nodes);
  state.place_of = arena.take<uint32_t>(pack.num_zone_nodes);
  state.base = arena.take<uint32_t>(state.max_nodes);
  state.preparation = arena.take<double>(state.max_preparation);
  state.moves = arena.take<double>(overlaps > 0 ? size_t{9} * state.max_contacts * state.max_nodes : 0);
  for (double*& tangents : state.tangents) tangents = arena.take<double>(state.max_tangents);
  state.forces = arena.take<double>(size_t{3} * state.max_nodes);
  state.saved = arena.take<double>(size_t{3} * state.max_nodes);
  const size_t vector = size_t{3} * state.max_nodes + kMostZoneAxes + 2 * kEliminationRows;
  for (double** of_group :
       {&state.residual, &state.boundary, &state.outside, &state.pull, &state.overlap, &state.vector})
    *of_group = arena.take<double>(vector);
}

bool is_zone_for(const ZoneSet& set, const pal_contact* contacts, uint32_t count, uint32_t fixed_version) {
  if (set.num_contacts != count || set.fixed_version != fixed_version) return false;
  for (uint32_t c = 0; c < count; ++c) {
    if (!is_about_nearest(contacts[c], set.sites[c])) return false;
  }
  return true;
}

void begin_zone(const pal_pack& pack, const pal_contact* contacts, uint32_t count, const FixedNodes& fixed,
                ZoneState& state) {
  ZoneSet& set = state.next;
  set.ready = false;
  set.num_contacts = count;
  set.num_axes = state.axes_per_contact * count;
  for (uint32_t c = 0; c < count; ++c) set.sites[c] = nearest_site(contacts[c]);
  find_places(pack, contacts, set);
  memcpy(set.points, set.places, count * sizeof *set.points);
  set.num_fixed = fixed.count;
  memcpy(set.fixed, fixed.nodes, fixed.count * sizeof *set.fixed);
  set.fixed_version = fixed.version;
  set.sound = true;
  set.flags = 0;
  set.inclusion_version = kNoInclusion;
  state.phase = ZoneState::Phase::collect;
  state.group = 0;
  state.column = 0;
  state.matrices_used = 0;
  state.columns_used = 0;
  state.rows_used = 0;
  state.tangents_used = 0;
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

bool is_alone_in_zone(const ZoneSet& set, uint32_t contact) {
  for (uint32_t g = 0; g < set.num_groups; ++g) {
    const ZoneGroup& group = set.groups[g];
    for (uint32_t i = 0; i < group.num_contacts; ++i) {
      if (group.contacts[i] == contact) return group.num_contacts == 1;
    }
  }
  return false;
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
  rest_rim(group);
  group.has_tangent = false;
  group.is_making = false;
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
  for (uint32_t slot = 0; slot < group.num_contacts; ++slot) {
    memset(set.turning[group.contacts[slot]], 0, sizeof *set.turning);
    memset(set.loads + size_t{3} * group.contacts[slot], 0, 3 * sizeof *set.loads);
  }
  for (uint32_t p = 0; p < group.batches.num_patches; ++p)
    group.batches.patches[p].followed = group.batches.patches[p].at_rest;
  group.stored = 0;
  rest_rim(group);
  group.has_tangent = false;
  group.is_making = false;
  group.has_trend = false;
  group.is_back = true;
  group.failures = group.astray = group.late = group.jammed = group.at_other_root = 0;
  group.was_beyond = false;
  group.longest_step = kLongestStep;
  keep_balance(set, group);
}

bool advance_zone(const pal_pack& pack, uint64_t operations, ZoneState& state) {
  using Phase = ZoneState::Phase;
  ZoneSet& set = state.next;
  uint64_t spent = 0;
  // What is not sliced, in multiply-adds that take as long: blocks fetched from all over the pack, tangents.
  const auto fetched = [&](const ZoneGroup& group) {
    return uint64_t{18} * group.num_boundary * group.num_boundary;
  };
  const auto square_of_boundary = [](const ZoneGroup& group) {
    return uint64_t{group.boundary_stride} * group.boundary_stride;
  };
  // Some columns of an elimination; true when it has ended.
  const auto go_on = [&](uint32_t eliminated, uint32_t size) {
    const uint32_t stride = elimination_stride(size);
    while (state.column < size) {
      if (spent >= operations) return false;
      spent += elimination_operations(size, eliminated, state.column);
      if (!state.kernel.eliminate_columns(state.preparation, stride, size, eliminated, state.column)) {
        set.sound = false;
        return true;
      }
      state.column += kEliminationColumns;
    }
    return true;
  };
  while (spent < operations) {
    ZoneGroup& group = set.groups[state.group < set.num_groups ? state.group : 0];
    const uint32_t order = round_to_columns(3 * group.num_boundary);
    const uint32_t inner = round_to_columns(3 * (group.num_interior + group.num_held));
    switch (state.phase) {
      case Phase::collect:
        if (!collect(pack, state)) {
          set.sound = false;
          set.num_nodes = 0;
          set.num_groups = 0;
          state.phase = Phase::done;
          break;
        }
        spent += uint64_t{1000} * (set.num_nodes + state.rim_nodes_used) + fetched(set.groups[0]);
        fill_compliance(pack, set, set.groups[0], state.preparation);
        state.phase = Phase::inverse;
        state.column = 0;
        break;
      case Phase::inverse:
        if (!go_on(order, 2 * order)) return false;
        take_whole(pack, set, state.preparation, group);
        state.phase = Phase::exterior;
        state.column = 0;
        break;
      case Phase::exterior:
        for (; state.column < num_exterior_columns(pack, set.num_contacts); ++state.column) {
          if (spent >= operations) return false;
          set.sound = gather_exterior_column(pack, state, set, state.column, group) && set.sound;
          spent += square_of_boundary(group);
        }
        fit_loads(pack, state, set, group);
        fill_own_stiffness(pack, state, group);
        spent += stiffness_operations(group.batches) + group.num_fitted * square_of_boundary(group);
        state.phase = Phase::overlap;
        state.column = 0;
        break;
      case Phase::overlap:
        if (!fill_overlaps(pack, operations, inner + 3 * group.num_boundary, state, group, spent))
          return false;
        state.phase = Phase::own;
        state.column = 0;
        break;
      case Phase::own:
        if (!go_on(inner, inner + rows_left(pack, set, group))) return false;
        take_exterior(pack, set, state.preparation, group);
        state.phase = Phase::couple;
        state.column = 0;
        break;
      case Phase::couple:
        if (!couple_groups(pack, operations, state, group, spent)) return false;
        state.phase = Phase::rim;
        state.column = 0;
        break;
      case Phase::rim:
        if (!fill_rim(pack, operations, state, group, spent)) return false;
        state.column = 0;
        if (++state.group < set.num_groups) {
          fill_compliance(pack, set, set.groups[state.group], state.preparation);
          spent += fetched(set.groups[state.group]);
          state.phase = Phase::inverse;
        } else {
          place_next(pack, state);
          weigh_exterior(pack, state, set);
          spent += uint64_t{1000} * set.num_nodes;
          state.phase = Phase::tangent;
          state.group = 0;
        }
        break;
      case Phase::tangent:
        if (!advance_first_tangent(pack, operations, state, group, spent)) return false;
        if (++state.group >= set.num_groups) state.phase = Phase::done;
        break;
      case Phase::done:
        if (!set.sound) {
          set.num_nodes = 0;
          set.num_groups = 0;
          place_next(pack, state);
        }
        let_next_answer(pack, state);
        return true;
    }
  }
  return false;
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
