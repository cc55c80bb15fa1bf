#include "runtime/src/zone_set.hpp"

#include <string.h>

#include "runtime/src/contact_place.hpp"
#include "runtime/src/pack_view.hpp"

namespace palpate {
namespace {

uint32_t patch_begin(const pal_pack& pack, uint32_t site) {
  return pack.patch_starts[site];
}
uint32_t patch_end(const pal_pack& pack, uint32_t site) {
  return pack.patch_starts[site + 1];
}

bool is_fixed(const pal_pack& pack, uint32_t node) {
  return pack.zone_nodes[node].free_axes == 0;
}

// Marks what the zone of a contact holds, ring by ring. False where it is more than a pack may hold.
bool mark_zone(const pal_pack& pack, uint32_t contact, uint32_t site, ZoneState& state) {
  const uint64_t bit = uint64_t{1} << contact;
  uint32_t num_queued = 0;
  const auto add_node = [&](uint32_t node) {
    uint64_t& contacts = state.node_contacts[node];
    if ((contacts & bit) != 0) return true;
    if (num_queued == state.max_nodes) return false;
    if (contacts == 0) {
      if (state.num_found_nodes == state.max_nodes) return false;
      state.found_nodes[state.num_found_nodes++] = node;
    }
    contacts |= bit;
    state.queue[num_queued++] = node;
    return true;
  };
  for (uint32_t p = patch_begin(pack, site); p < patch_end(pack, site); ++p) {
    if (!add_node(pack.patch_nodes[p])) return false;
  }
  uint32_t ring_begin = 0;
  for (uint32_t ring = 0; ring < state.rings; ++ring) {
    const uint32_t ring_end = num_queued;
    for (uint32_t q = ring_begin; q < ring_end; ++q) {
      const pack::ZoneNode& node = pack.zone_nodes[state.queue[q]];
      for (uint32_t e = 0; e < node.num_elements; ++e) {
        const uint32_t index = pack.zone_node_elements[node.first_element + e];
        uint64_t& contacts = state.element_contacts[index];
        if ((contacts & bit) != 0) continue;
        if (contacts == 0) {
          if (state.num_found_elements == state.max_elements) return false;
          state.found_elements[state.num_found_elements++] = index;
        }
        contacts |= bit;
        const pack::ZoneElement& element = pack.zone_elements[index];
        for (uint32_t a = 0; a < element.num_nodes; ++a) {
          if (!add_node(element.nodes[a])) return false;
        }
      }
    }
    ring_begin = ring_end;
  }
  return true;
}

void forget_marks(ZoneState& state) {
  for (uint32_t i = 0; i < state.num_found_nodes; ++i) state.node_contacts[state.found_nodes[i]] = 0;
  for (uint32_t i = 0; i < state.num_found_elements; ++i) state.element_contacts[state.found_elements[i]] = 0;
  state.num_found_nodes = 0;
  state.num_found_elements = 0;
}

// The contacts that share nodes, directly or through others, as bits: of each contact its group's.
void find_groups(const ZoneState& state, uint32_t count, uint64_t groups[kMostZoneContacts]) {
  for (uint32_t c = 0; c < count; ++c) groups[c] = uint64_t{1} << c;
  for (uint32_t i = 0; i < state.num_found_nodes; ++i) {
    const uint64_t contacts = state.node_contacts[state.found_nodes[i]];
    uint64_t joined = 0;
    for (uint32_t c = 0; c < count; ++c) {
      if ((contacts >> c & 1) != 0) joined |= groups[c];
    }
    for (uint32_t c = 0; c < count; ++c) {
      if ((joined >> c & 1) != 0) groups[c] = joined;
    }
  }
}

// Of the elements at a node, those in the zone.
uint32_t num_inside(const pal_pack& pack, const ZoneState& state, uint32_t node, uint64_t group) {
  const pack::ZoneNode& entry = pack.zone_nodes[node];
  uint32_t count = 0;
  for (uint32_t e = 0; e < entry.num_elements; ++e) {
    const uint32_t index = pack.zone_node_elements[entry.first_element + e];
    count += (state.element_contacts[index] & group) != 0 ? 1 : 0;
  }
  return count;
}

// The contacts that hold a node, as masters of it; how many. `num_masters` counts them on.
uint32_t list_masters(const pal_pack& pack, const ZoneSet& set, const ZoneGroup& group, uint32_t node,
                      uint32_t& num_masters) {
  uint32_t count = 0;
  for (uint32_t slot = 0; slot < group.num_contacts; ++slot) {
    const uint32_t site = set.sites[group.contacts[slot]];
    for (uint32_t p = patch_begin(pack, site); p < patch_end(pack, site); ++p) {
      if (pack.patch_nodes[p] != node) continue;
      set.masters[num_masters + count++] = {slot, 0.0};
    }
  }
  for (uint32_t m = 0; m < count; ++m) set.masters[num_masters + m].share = 1.0 / count;
  num_masters += count;
  return count;
}

enum class Role : uint32_t { interior, boundary, held, fixed };

// The group's nodes, role by role.
void list_nodes(const pal_pack& pack, const ZoneState& state, uint64_t mask, uint32_t& num_masters,
                ZoneSet& set, ZoneGroup& group) {
  const auto role_of = [&](uint32_t node) {
    if (is_fixed(pack, node)) return Role::fixed;
    for (uint32_t slot = 0; slot < group.num_contacts; ++slot) {
      const uint32_t site = set.sites[group.contacts[slot]];
      for (uint32_t p = patch_begin(pack, site); p < patch_end(pack, site); ++p) {
        if (pack.patch_nodes[p] == node) return Role::held;
      }
    }
    const pack::ZoneNode& entry = pack.zone_nodes[node];
    return entry.num_outside > 0 || num_inside(pack, state, node, mask) < entry.num_elements ? Role::boundary
                                                                                             : Role::interior;
  };
  group.first_node = set.num_nodes;
  for (const Role role : {Role::interior, Role::boundary, Role::held, Role::fixed}) {
    const uint32_t before = set.num_nodes;
    for (uint32_t i = 0; i < state.num_found_nodes; ++i) {
      const uint32_t node = state.found_nodes[i];
      if ((state.node_contacts[node] & mask) == 0 || role_of(node) != role) continue;
      const uint32_t place = set.num_nodes++;
      set.nodes[place] = node;
      set.first_master[place] = num_masters;
      const uint32_t own = 3 * (place - group.first_node);
      set.unknown_of[place] = role == Role::fixed ? kNoUnknown : role == Role::held ? kHeldUnknown : own;
      if (role == Role::held && list_masters(pack, set, group, node, num_masters) > 1)
        set.flags |= PAL_FLAG_OVERLAPPING;
      set.first_master[place + 1] = num_masters;
    }
    const uint32_t count = set.num_nodes - before;
    if (role == Role::interior) group.num_interior = count;
    if (role == Role::boundary) group.num_boundary = count;
    if (role == Role::held) group.num_held = count;
  }
  group.num_nodes = set.num_nodes - group.first_node;
  group.unknowns = round_to_columns(3 * (group.num_interior + group.num_boundary));
  group.size = group.unknowns + 3 * group.num_contacts + 1;
  group.stride = elimination_stride(group.size);
  group.boundary_stride = elimination_stride(3 * group.num_boundary);
  for (uint32_t i = 0; i < group.num_held; ++i) {
    const uint32_t place = group.first_node + group.num_interior + group.num_boundary + i;
    for (uint32_t m = set.first_master[place]; m < set.first_master[place + 1]; ++m)
      set.masters[m].unknown = group.unknowns + 3 * set.masters[m].unknown;
  }
}

template <int kNodes>
bool append_element(const pal_pack& pack, const pack::ZoneElement& element, const uint32_t* place_of,
                    uint32_t count, ZoneBatch<kNodes>* batches) {
  ZoneBatch<kNodes>& batch = batches[count / kLanes];
  int nodes[kNodes];
  for (uint32_t a = 0; a < kNodes; ++a) nodes[a] = static_cast<int>(place_of[element.nodes[a]] - 1);
  const int first = static_cast<int>(count % kLanes);
  batch.count = first + 1;
  for (int lane = first; lane < kLanes; ++lane) {
    if (!set_zone_element<kNodes>(pack, element, nodes, lane, batch)) return false;
  }
  return true;
}

// The group's elements, in lanes.
bool list_elements(const pal_pack& pack, ZoneState& state, uint64_t mask, uint32_t& first_linear,
                   uint32_t& first_quadratic, ZoneGroup& group) {
  ZoneSet& set = state.next;
  for (uint32_t i = 0; i < group.num_nodes; ++i)
    state.place_of[set.nodes[group.first_node + i]] = group.first_node + i + 1;
  group.batches.linear = set.linear + first_linear;
  group.batches.quadratic = set.quadratic + first_quadratic;
  uint32_t num_linear = 0;
  uint32_t num_quadratic = 0;
  bool sound = true;
  for (uint32_t i = 0; i < state.num_found_elements && sound; ++i) {
    const uint32_t index = state.found_elements[i];
    if ((state.element_contacts[index] & mask) == 0) continue;
    const pack::ZoneElement& element = pack.zone_elements[index];
    if (element.num_nodes == 4) {
      sound = append_element(pack, element, state.place_of, num_linear++, group.batches.linear);
    } else if (num_quadratic < state.max_quadratic) {
      sound = append_element(pack, element, state.place_of, num_quadratic++, group.batches.quadratic);
    } else {
      sound = false;
    }
  }
  for (uint32_t i = 0; i < group.num_nodes; ++i) state.place_of[set.nodes[group.first_node + i]] = 0;
  group.batches.num_linear = (num_linear + kLanes - 1) / kLanes;
  group.batches.num_quadratic = (num_quadratic + kLanes - 1) / kLanes;
  first_linear += group.batches.num_linear;
  first_quadratic += group.batches.num_quadratic;
  return sound;
}

// Room for S, T and the sensitivities.
bool take_matrices(ZoneState& state, ZoneGroup& group) {
  ZoneSet& set = state.next;
  const size_t square = size_t{group.boundary_stride} * group.boundary_stride;
  const size_t rows = (size_t{3} * group.num_contacts + 1) * group.unknowns;
  const size_t order = round_to_columns(3 * group.num_boundary);
  const size_t own = round_to_columns(3 * (group.num_interior + group.num_held)) + order;
  const size_t largest = own > 2 * order ? own : 2 * order;
  const size_t preparation =
      (largest + kEliminationColumns) * elimination_stride(static_cast<uint32_t>(largest));
  if (state.matrices_used + 2 * square > state.max_matrices || state.rows_used + rows > state.max_rows ||
      size_t{round_to_columns(group.size)} * group.stride > state.max_frame ||
      preparation > state.max_preparation)
    return false;
  group.exterior = set.matrices + state.matrices_used;
  group.whole = group.exterior + square;
  group.sensitivities = set.rows + state.rows_used;
  state.matrices_used += 2 * square;
  state.rows_used += rows;
  return true;
}

// Which nodes and elements, and who shares a zone.
bool collect(const pal_pack& pack, ZoneState& state) {
  ZoneSet& set = state.next;
  uint64_t groups[kMostZoneContacts];
  bool sound = true;
  for (uint32_t c = 0; c < set.num_contacts && sound; ++c) sound = mark_zone(pack, c, set.sites[c], state);
  if (sound) find_groups(state, set.num_contacts, groups);
  uint32_t num_masters = 0;
  uint32_t first_linear = 0;
  uint32_t first_quadratic = 0;
  uint32_t num_boundary = 0;
  for (uint32_t c = 0; c < set.num_contacts && sound; ++c) {
    if ((groups[c] & (uint64_t{1} << c)) == 0 || (groups[c] & ((uint64_t{1} << c) - 1)) != 0) continue;
    ZoneGroup& group = set.groups[set.num_groups++];
    group = {};
    for (uint32_t other = c; other < set.num_contacts; ++other) {
      if ((groups[c] >> other & 1) != 0) group.contacts[group.num_contacts++] = other;
    }
    list_nodes(pack, state, groups[c], num_masters, set, group);
    num_boundary += group.num_boundary;
    sound = num_boundary <= state.max_boundary &&
            list_elements(pack, state, groups[c], first_linear, first_quadratic, group) &&
            take_matrices(state, group);
  }
  forget_marks(state);
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

// T from what elimination has left. Unsound where a node is held by more of its neighbours than any tissue is: the forces
// would not fit into a float.
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

// An axis along which the model holds a node takes no part.
void drop_unknown(uint32_t unknown, uint32_t size, uint32_t stride, double* matrix) {
  for (uint32_t column = 0; column < unknown; ++column) matrix[size_t{column} * stride + unknown] = 0;
  for (uint32_t row = unknown; row < size; ++row) matrix[size_t{unknown} * stride + row] = 0;
  matrix[size_t{unknown} * stride + unknown] = 1;
}

// K_V at rest, and the nodal forces there.
void fill_own_stiffness(const pal_pack& pack, ZoneState& state, const ZoneGroup& group) {
  ZoneSet& set = state.next;
  const uint32_t eliminated = round_to_columns(3 * (group.num_interior + group.num_held));
  const uint32_t size = eliminated + 3 * group.num_boundary;
  const uint32_t stride = elimination_stride(size);
  double* matrix = state.preparation;
  memset(matrix, 0, size_t{round_to_columns(size)} * stride * sizeof *matrix);
  list_own_unknowns(group, eliminated, state.base);
  for (uint32_t i = group.first_node; i < group.first_node + group.num_nodes; ++i) {
    memcpy(set.displacement + size_t{3} * i, pack.zone_nodes[set.nodes[i]].displacement, 3 * sizeof(double));
    for (uint32_t axis = 0; axis < 3; ++axis) set.rest_force[3 * i + axis] = 0;
  }
  const ZoneUnknowns unknowns = {state.base, nullptr, nullptr};
  add_zone_stiffness(group.batches, set.displacement, unknowns, set.rest_force, matrix, stride);
  for (uint32_t i = 3 * (group.num_interior + group.num_held); i < eliminated; ++i)
    matrix[size_t{i} * stride + i] = 1;
  for (uint32_t i = group.first_node; i < group.first_node + group.num_nodes; ++i) {
    const uint32_t axes = pack.zone_nodes[set.nodes[i]].free_axes;
    for (uint32_t axis = 0; axis < 3 && state.base[i] != kNoUnknown; ++axis) {
      if ((axes >> axis & 1) == 0) drop_unknown(state.base[i] + axis, size, stride, matrix);
    }
  }
}

// S from T and what elimination has left of K_V.
void take_exterior(const double* matrix, ZoneGroup& group) {
  const uint32_t eliminated = round_to_columns(3 * (group.num_interior + group.num_held));
  const uint32_t stride = elimination_stride(eliminated + 3 * group.num_boundary);
  const size_t boundary_stride = group.boundary_stride;
  memcpy(group.exterior, group.whole, boundary_stride * boundary_stride * sizeof *group.exterior);
  for (uint32_t j = 0; j < 3 * group.num_boundary; ++j) {
    for (uint32_t i = j; i < 3 * group.num_boundary; ++i) {
      double& entry = group.exterior[j * boundary_stride + i];
      entry -= matrix[size_t{eliminated + j} * stride + eliminated + i];
      group.exterior[i * boundary_stride + j] = entry;
    }
  }
}

// Where the linear organ has moved a node to under the tractions of a set, from rest.
void linear_displacement(const pal_pack& pack, const ZoneSet& from, uint32_t node, double out[3]) {
  for (int i = 0; i < 3; ++i) out[i] = 0;
  for (uint32_t g = 0; g < from.num_groups; ++g) {
    const ZoneGroup& group = from.groups[g];
    const uint32_t first = group.first_node + group.num_interior;
    for (uint32_t b = first; b < first + group.num_boundary; ++b) {
      double block[9];
      zone_compliance(pack, node, from.nodes[b], block);
      const double* t = from.traction + size_t{3} * b;
      for (int i = 0; i < 3; ++i)
        out[i] += block[3 * i] * t[0] + block[3 * i + 1] * t[1] + block[3 * i + 2] * t[2];
    }
  }
}

// The new set goes on where the one before has got to.
void begin_where(const pal_pack& pack, const ZoneSet& before, ZoneState& state) {
  ZoneSet& set = state.next;
  for (uint32_t i = 0; i < before.num_nodes && before.ready; ++i) state.place_of[before.nodes[i]] = i + 1;
  for (uint32_t i = 0; i < set.num_nodes; ++i) {
    const uint32_t node = set.nodes[i];
    double* to = set.displacement + size_t{3} * i;
    memcpy(to, pack.zone_nodes[node].displacement, 3 * sizeof *to);
    if (!before.ready || is_fixed(pack, node)) continue;
    if (const uint32_t place = state.place_of[node]; place != 0) {
      memcpy(to, before.displacement + size_t{3} * (place - 1), 3 * sizeof *to);
    } else {
      double moved[3];
      linear_displacement(pack, before, node, moved);
      for (int axis = 0; axis < 3; ++axis) to[axis] += moved[axis];
    }
  }
  for (uint32_t i = 0; i < before.num_nodes && before.ready; ++i) state.place_of[before.nodes[i]] = 0;
  memset(set.force, 0, size_t{3} * set.num_contacts * sizeof *set.force);
  memset(set.stiffness, 0, size_t{3} * set.num_contacts * sizeof *set.stiffness);
  memset(set.traction, 0, size_t{3} * set.num_nodes * sizeof *set.traction);
  // A patch moves as one: as the mean of its nodes.
  memset(set.followed, 0, size_t{3} * set.num_contacts * sizeof *set.followed);
  double held[kMostZoneContacts] = {};
  for (uint32_t g = 0; g < set.num_groups; ++g) {
    const ZoneGroup& group = set.groups[g];
    const uint32_t first = group.first_node + group.num_interior + group.num_boundary;
    for (uint32_t i = first; i < first + group.num_held; ++i) {
      const double* rest = pack.zone_nodes[set.nodes[i]].displacement;
      for (uint32_t m = set.first_master[i]; m < set.first_master[i + 1]; ++m) {
        const uint32_t contact = group.contacts[(set.masters[m].unknown - group.unknowns) / 3];
        held[contact] += 1;
        for (int axis = 0; axis < 3; ++axis)
          set.followed[3 * contact + static_cast<uint32_t>(axis)] +=
              set.displacement[size_t{3} * i + static_cast<size_t>(axis)] - rest[axis];
      }
    }
  }
  for (uint32_t c = 0; c < set.num_contacts; ++c) {
    for (uint32_t axis = 0; axis < 3 && held[c] > 0; ++axis) set.followed[3 * c + axis] /= held[c];
  }
  // What the linear organ makes of the nodes that come may be no state at all.
  for (uint32_t g = 0; g < set.num_groups; ++g) {
    if (!(smallest_jacobian(set.groups[g].batches, set.displacement) > kLeastJacobian))
      rest_group(pack, set, set.groups[g]);
  }
}

}  // namespace

void carve_zone(const pal_pack& pack, uint32_t max_contacts, uint32_t rings, Arena& arena, ZoneState& state) {
  state = {};
  state.max_contacts = max_contacts < kMostZoneContacts ? max_contacts : kMostZoneContacts;
  state.rings = rings;
  const auto times = [&](uint32_t of_site, uint32_t all) {
    const uint64_t most = uint64_t{of_site} * state.max_contacts;
    return static_cast<uint32_t>(most < all ? most : all);
  };
  state.max_nodes = times(pack.most_zone_nodes, pack.num_zone_nodes);
  state.max_elements = times(pack.most_zone_elements, pack.num_zone_elements);
  state.max_quadratic = state.max_elements < pack.num_quadratic ? state.max_elements : pack.num_quadratic;
  const uint32_t boundary = state.max_boundary = times(pack.most_zone_boundary, pack.num_zone_nodes);
  state.max_masters = state.max_contacts * pack.max_patch_nodes;
  const size_t squares = elimination_stride(3 * boundary + kEliminationRows * state.max_contacts);
  state.max_matrices = 2 * squares * squares;
  const uint32_t unknowns = 3 * state.max_nodes + kEliminationColumns;
  state.max_rows =
      (size_t{3} * state.max_contacts + 1) * (unknowns + kEliminationColumns * state.max_contacts);
  const uint32_t size = unknowns + 3 * state.max_contacts + 1;
  state.max_frame = size_t{round_to_columns(size)} * elimination_stride(size);
  const uint32_t own = unknowns + kEliminationColumns;
  const uint32_t twice = 2 * (3 * boundary + kEliminationColumns);
  const uint32_t largest = own > twice ? own : twice;
  state.max_preparation =
      size_t{largest + 2 * kEliminationColumns} * elimination_stride(largest + kEliminationColumns);
  for (ZoneSet* set : {&state.answering, &state.next}) {
    set->sites = arena.take<uint32_t>(state.max_contacts);
    set->groups = arena.take<ZoneGroup>(state.max_contacts);
    set->followed = arena.take<double>(size_t{3} * state.max_contacts);
    set->force = arena.take<double>(size_t{3} * state.max_contacts);
    set->stiffness = arena.take<double[3 * kMostZoneContacts]>(size_t{3} * state.max_contacts);
    set->nodes = arena.take<uint32_t>(state.max_nodes);
    set->unknown_of = arena.take<uint32_t>(state.max_nodes);
    set->first_master = arena.take<uint32_t>(size_t{state.max_nodes} + 1);
    set->masters = arena.take<ZoneMaster>(state.max_masters);
    set->displacement = arena.take<double>(size_t{3} * state.max_nodes);
    set->rest_force = arena.take<double>(size_t{3} * state.max_nodes);
    set->traction = arena.take<double>(size_t{3} * state.max_nodes);
    const auto batches = [&](uint32_t elements) { return elements / kLanes + state.max_contacts; };
    set->linear = arena.take<ZoneBatch<4>>(batches(state.max_elements));
    if (state.max_quadratic > 0) set->quadratic = arena.take<ZoneBatch<10>>(batches(state.max_quadratic));
    set->matrices = arena.take<double>(state.max_matrices);
    set->rows = arena.take<double>(state.max_rows);
  }
  state.node_contacts = arena.take<uint64_t>(pack.num_zone_nodes);
  state.element_contacts = arena.take<uint64_t>(pack.num_zone_elements);
  state.found_nodes = arena.take<uint32_t>(state.max_nodes);
  state.found_elements = arena.take<uint32_t>(state.max_elements);
  state.queue = arena.take<uint32_t>(state.max_nodes);
  state.place_of = arena.take<uint32_t>(pack.num_zone_nodes);
  state.base = arena.take<uint32_t>(state.max_nodes);
  state.preparation = arena.take<double>(state.max_preparation);
  state.frame = arena.take<double>(state.max_frame);
  state.forces = arena.take<double>(size_t{3} * state.max_nodes);
  state.saved = arena.take<double>(size_t{3} * state.max_nodes);
  const size_t vector = size_t{3} * state.max_nodes + 3 * kMostZoneContacts + 2 * kEliminationRows;
  state.vector = arena.take<double>(vector);
  state.boundary = arena.take<double>(vector);
  state.pull = arena.take<double>(vector);
}

bool is_zone_for(const ZoneSet& set, const pal_contact* contacts, uint32_t count) {
  if (set.num_contacts != count) return false;
  for (uint32_t c = 0; c < count; ++c) {
    if (set.sites[c] != nearest_site(contacts[c])) return false;
  }
  return true;
}

void begin_zone(const pal_contact* contacts, uint32_t count, ZoneState& state) {
  ZoneSet& set = state.next;
  set.ready = false;
  set.num_contacts = count;
  for (uint32_t c = 0; c < count; ++c) set.sites[c] = nearest_site(contacts[c]);
  set.sound = true;
  set.flags = 0;
  set.num_groups = 0;
  set.num_nodes = 0;
  state.phase = ZoneState::Phase::collect;
  state.group = 0;
  state.column = 0;
  state.matrices_used = 0;
  state.rows_used = 0;
}

void rest_group(const pal_pack& pack, ZoneSet& set, ZoneGroup& group) {
  for (uint32_t i = group.first_node; i < group.first_node + group.num_nodes; ++i) {
    memcpy(set.displacement + size_t{3} * i, pack.zone_nodes[set.nodes[i]].displacement, 3 * sizeof(double));
    memset(set.traction + size_t{3} * i, 0, 3 * sizeof(double));
  }
  for (uint32_t slot = 0; slot < group.num_contacts; ++slot)
    memset(set.followed + 3 * group.contacts[slot], 0, 3 * sizeof(double));
  group.has_sensitivities = false;
  group.failures = 0;
}

void swap_zone_sets(ZoneState& state) {
  const ZoneSet made = state.next;
  state.next = state.answering;
  state.answering = made;
}

bool advance_zone(const pal_pack& pack, uint64_t operations, ZoneState& state) {
  using Phase = ZoneState::Phase;
  ZoneSet& set = state.next;
  uint64_t spent = 0;
  // What is not sliced, in multiply-adds that take as long: blocks fetched from all over the pack, tangents.
  const auto fetched = [&](const ZoneGroup& group) {
    return uint64_t{18} * group.num_boundary * group.num_boundary;
  };
  const auto assembled = [&](const ZoneGroup& group) {
    return uint64_t{3000} * kLanes * (group.batches.num_linear + uint64_t{20} * group.batches.num_quadratic);
  };
  // Some columns of an elimination; true when it has ended.
  const auto go_on = [&](uint32_t eliminated, uint32_t size) {
    const uint32_t stride = elimination_stride(size);
    while (state.column < size) {
      if (spent >= operations) return false;
      const uint64_t columns = state.column < eliminated ? state.column : eliminated;
      spent += uint64_t{kEliminationColumns} * (size - state.column) * (columns + kEliminationColumns);
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
        spent += uint64_t{1000} * set.num_nodes + fetched(set.groups[0]);
        fill_compliance(pack, set, set.groups[0], state.preparation);
        state.phase = Phase::inverse;
        state.column = 0;
        break;
      case Phase::inverse:
        if (!go_on(order, 2 * order)) return false;
        take_whole(pack, set, state.preparation, group);
        fill_own_stiffness(pack, state, group);
        spent += assembled(group);
        state.phase = Phase::own;
        state.column = 0;
        break;
      case Phase::own:
        if (!go_on(inner, inner + 3 * group.num_boundary)) return false;
        take_exterior(state.preparation, group);
        state.column = 0;
        if (++state.group < set.num_groups) {
          fill_compliance(pack, set, set.groups[state.group], state.preparation);
          spent += fetched(set.groups[state.group]);
          state.phase = Phase::inverse;
        } else {
          state.phase = Phase::done;
        }
        break;
      case Phase::done:
        if (!set.sound) {
          set.num_nodes = 0;
          set.num_groups = 0;
        }
        begin_where(pack, state.answering, state);
        set.ready = true;
        swap_zone_sets(state);
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
