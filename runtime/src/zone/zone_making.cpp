#include "runtime/src/zone/zone_making.hpp"

#include <math.h>
#include <string.h>

#include <algorithm>

#include "runtime/src/pack/contact_place.hpp"
#include "runtime/src/pack/pack_view.hpp"
#include "runtime/src/zone/zone_handover.hpp"
#include "runtime/src/zone/zone_members.hpp"
#include "runtime/src/zone/zone_tangent.hpp"

namespace palpate {
namespace {

// Multiply-adds that take as long as an entry that is copied to where it and its mirror image stand.
constexpr uint64_t kOfCopied = 48;
constexpr uint32_t kColumnsOfStep = 32;

// Room for S at rest, S_int, C between groups, the tangents and their sensitivities.
bool take_matrices(ZoneState& state, uint32_t num_boundary, ZoneGroup& group) {
  ZoneSet& set = state.next;
  const size_t square = size_t{group.boundary_stride} * group.boundary_stride;
  const size_t sensitivities = size_t{group.num_axes} * group.unknowns;
  const size_t rows = 2 * sensitivities + size_t{3} * group.unknowns;
  const size_t order = round_to_columns(3 * group.num_boundary);
  const size_t own = round_to_columns(3 * (group.num_interior + group.num_held)) + order;
  const size_t largest = own > 2 * order ? own : 2 * order;
  const size_t preparation =
      (largest + kEliminationColumns) * elimination_stride(static_cast<uint32_t>(largest));
  const size_t compliances = size_t{group.boundary_stride} * 3 * (num_boundary - group.num_boundary);
  const size_t matrices = 2 * square + compliances + size_t{3} * group.boundary_stride;
  const size_t tangent = size_t{round_to_columns(group.size)} * group.stride;
  if (state.matrices_used + matrices > state.max_matrices || state.rows_used + rows > state.max_rows ||
      state.tangents_used + tangent > state.max_tangents || preparation > state.max_preparation)
    return false;
  group.exterior = group.exterior_at_rest = set.matrices + state.matrices_used;
  group.couplings = nullptr;
  group.own = group.exterior + square;
  group.compliances = group.own + square;
  group.coupled = group.compliances + compliances;
  group.moved_by_others = group.coupled + group.boundary_stride;
  group.exterior_force = group.moved_by_others + group.boundary_stride;
  group.tangent_place = state.tangents_used;
  group.factor = nullptr;
  group.spare = state.tangents[2] + group.tangent_place;
  group.sensitivities = set.rows + state.rows_used;
  group.spare_sensitivities = group.sensitivities + sensitivities;
  group.step = group.spare_sensitivities + sensitivities;
  group.trend = group.step + group.unknowns;
  group.began = group.trend + group.unknowns;
  state.tangents_used += tangent;
  state.matrices_used += matrices;
  state.rows_used += rows;
  return true;
}

// Once the members are known.
bool take_matrices(ZoneState& state) {
  const ZoneSet& set = state.next;
  bool fits = exterior_size(set) <= state.max_exterior;
  for (uint32_t g = 0; g < set.num_groups && fits; ++g)
    fits = take_matrices(state, state.boundary_used, set.groups[g]);
  return fits;
}

// Clears some columns of a matrix; multiply-adds.
uint64_t clear_columns(uint32_t step, uint32_t columns, uint32_t stride, double* matrix) {
  const uint32_t begin = step * kColumnsOfStep;
  const uint32_t count = std::min(kColumnsOfStep, columns - begin);
  memset(matrix + size_t{begin} * stride, 0, size_t{count} * stride * sizeof *matrix);
  return uint64_t{count} * stride;
}

uint32_t num_clearings(uint32_t columns) {
  return (columns + kColumnsOfStep - 1) / kColumnsOfStep;
}

// C_ij, in three columns.
void fetch_block(const pal_pack& pack, uint32_t i, uint32_t j, size_t stride, double* columns) {
  double block[9];
  zone_compliance(pack, i, j, block);
  for (uint32_t entry = 0; entry < 9; ++entry) columns[entry % 3 * stride + entry / 3] = block[entry];
}

// [ C_BB  . ]
// [ 1     0 ], whose last block becomes -C_BB^-1; an axis that is held gets a compliance of its own.
bool fill_compliance(const pal_pack& pack, uint64_t operations, ZoneState& state, const ZoneGroup& group,
                     uint64_t& spent) {
  const uint32_t order = round_to_columns(3 * group.num_boundary);
  const uint32_t stride = elimination_stride(2 * order);
  const uint32_t cleared = num_clearings(2 * order);
  const uint32_t* nodes = state.next.nodes + first_boundary(group);
  double* matrix = state.preparation;
  for (; state.column < cleared + group.num_boundary; ++state.column) {
    if (spent >= operations) return false;
    if (state.column < cleared) {
      spent += clear_columns(state.column, 2 * order, stride, matrix);
      continue;
    }
    const uint32_t j = state.column - cleared;
    for (uint32_t i = j; i < group.num_boundary; ++i) {
      fetch_block(pack, nodes[i], nodes[j], stride, matrix + size_t{3} * j * stride + 3 * i);
    }
    spent += kOfBlock * (group.num_boundary - j);
  }
  for (uint32_t i = 0; i < order; ++i) {
    double& diagonal = matrix[size_t{i} * stride + i];
    const bool is_free =
        i < 3 * group.num_boundary && (pack.zone_nodes[nodes[i / 3]].free_axes >> (i % 3) & 1) != 0;
    if (!is_free) diagonal = 1;
    matrix[size_t{i} * stride + order + i] = 1;
  }
  return true;
}

// What elimination leaves of a matrix.
struct Left {
  const double* matrix;
  uint32_t stride;
  uint32_t first;
  double operator()(uint32_t i, uint32_t j) const { return matrix[size_t{first + j} * stride + first + i]; }
};

// A column of matrix := base - what is left, symmetric, from the diagonal on, and the row that it is as well; zeros behind.
uint64_t take_left(const Left& left, const double* base, uint32_t j, uint32_t size, uint32_t stride,
                   double* matrix) {
  for (uint32_t i = j; i < stride; ++i) {
    double entry = 0;
    if (i < size && j < size) entry = (base != nullptr ? base[size_t{j} * stride + i] : 0) - left(i, j);
    matrix[size_t{j} * stride + i] = matrix[size_t{i} * stride + j] = entry;
  }
  return kOfCopied * (stride - j);
}

// T. Unsound where a node is held by more of its neighbours than any tissue is: the forces would not fit into a float.
bool take_whole(const pal_pack& pack, uint64_t operations, ZoneState& state, const ZoneGroup& group,
                uint64_t& spent) {
  constexpr double kMostHeld = 1e8;  // as kLargestNodalForce of linear_dd
  ZoneSet& set = state.next;
  const uint32_t size = 3 * group.num_boundary;
  const uint32_t order = round_to_columns(size);
  const Left left = {state.preparation, elimination_stride(2 * order), order};
  for (; state.column < group.boundary_stride; ++state.column) {
    if (spent >= operations) return false;
    const uint32_t j = state.column;
    spent += take_left(left, nullptr, j, size, group.boundary_stride, group.own);
    if (j >= size) continue;
    const uint32_t node = set.nodes[first_boundary(group) + j / 3];
    double own[9];
    zone_compliance(pack, node, node, own);
    if (!(group.own[size_t{j} * group.boundary_stride + j] * own[4 * (j % 3)] <= kMostHeld))
      set.sound = false;
  }
  return true;
}

// K_V in the order of ZoneState::base: the nodes that are eliminated, interior and held, then the boundary.
uint32_t num_eliminated(const ZoneGroup& group) {
  return round_to_columns(3 * (group.num_interior + group.num_held));
}

uint32_t size_of_own(const ZoneGroup& group) {
  return num_eliminated(group) + 3 * group.num_boundary;
}

// At rest, where they stand in K_V.
void place_nodes(const pal_pack& pack, ZoneState& state, const ZoneGroup& group) {
  ZoneSet& set = state.next;
  const uint32_t free = group.num_interior + group.num_boundary;
  for (uint32_t i = 0; i < group.num_nodes; ++i) {
    const uint32_t place = group.first_node + i;
    uint32_t& own = state.base[place];
    if (i < group.num_interior) {
      own = 3 * i;
    } else if (i < free) {
      own = num_eliminated(group) + 3 * (i - group.num_interior);
    } else {
      own = i < free + group.num_held ? 3 * (i - group.num_boundary) : kNoUnknown;
    }
    memcpy(set.displacement + size_t{3} * place, pack.zone_nodes[set.nodes[place]].displacement,
           3 * sizeof(double));
    for (uint32_t axis = 0; axis < 3; ++axis) set.rest_force[3 * place + axis] = 0;
  }
}

// K_V at rest, and the nodal forces there.
bool fill_stiffness(const pal_pack& pack, uint64_t operations, ZoneState& state, const ZoneGroup& group,
                    uint64_t& spent) {
  ZoneSet& set = state.next;
  const uint32_t size = size_of_own(group);
  const uint32_t stride = elimination_stride(size);
  const uint32_t cleared = num_clearings(round_to_columns(size));
  double* matrix = state.preparation;
  for (; state.column <= cleared + num_parts(group.batches); ++state.column) {
    if (spent >= operations) return false;
    if (state.column < cleared) {
      spent += clear_columns(state.column, round_to_columns(size), stride, matrix);
      continue;
    }
    if (state.column == cleared) {
      place_nodes(pack, state, group);
      continue;
    }
    const ZoneBatches some = part_of(group.batches, state.column - cleared - 1);
    add_zone_forces(some, set.displacement, set.rest_force);
    for (uint32_t p = 0; p < some.num_patches; ++p) {
      ZonePatch& patch = some.patches[p];
      patch.followed = patch.at_rest = patch.pressure;
    }
    add_zone_stiffness(some, set.displacement, {state.base, nullptr, nullptr}, matrix, stride);
    spent += force_operations(some) + stiffness_operations(some);
  }
  for (uint32_t i = 3 * (group.num_interior + group.num_held); i < num_eliminated(group); ++i)
    matrix[size_t{i} * stride + i] = 1;
  for (uint32_t i = group.first_node; i < group.first_node + group.num_nodes; ++i) {
    const uint32_t axes = pack.zone_nodes[set.nodes[i]].free_axes;
    for (uint32_t axis = 0; axis < 3 && state.base[i] != kNoUnknown; ++axis) {
      if ((axes >> axis & 1) == 0) drop_unknown(state.base[i] + axis, size, stride, matrix);
    }
  }
  return true;
}

// S = T - S_int, with S_int from the elimination of K_V; S_int takes the place of T.
bool take_exterior(uint64_t operations, ZoneState& state, const ZoneGroup& group, uint64_t& spent) {
  const uint32_t size = 3 * group.num_boundary;
  const size_t stride = group.boundary_stride;
  const Left left = {state.preparation, elimination_stride(size_of_own(group)), num_eliminated(group)};
  for (; state.column < stride; ++state.column) {
    if (spent >= operations) return false;
    const uint32_t j = state.column;
    spent += take_left(left, group.own, j, size, group.boundary_stride, group.exterior);
    for (uint32_t i = j; i < stride; ++i) {
      const double entry = i < size && j < size ? left(i, j) : 0;
      group.own[j * stride + i] = group.own[i * stride + j] = entry;
    }
    spent += kOfCopied * (stride - j);
  }
  return true;
}

// Columns of an elimination, to its end.
bool eliminate(uint64_t operations, uint32_t eliminated, uint32_t size, ZoneState& state, uint64_t& spent) {
  const uint32_t stride = elimination_stride(size);
  for (; state.column < size; state.column += kEliminationColumns) {
    const uint64_t of_columns = elimination_operations(size, eliminated, state.column);
    if (spent > 0 && spent + of_columns > operations) return false;
    spent += of_columns;
    if (!state.kernel.eliminate_columns(state.preparation, stride, size, eliminated, state.column)) {
      state.next.sound = false;
      return true;
    }
  }
  return true;
}

// O (force_control.hpp), of a contact and one of another group; else it stays zero.
void couple_contacts(const pal_pack& pack, uint32_t contact, uint32_t other, ZoneSet& set) {
  if (group_of(set, contact) == group_of(set, other)) return;
  const uint32_t* starts = pack.patch_starts;
  const uint32_t from = set.sites[other];
  const uint32_t to = set.sites[contact];
  const double pairs = 1.0 * (starts[from + 1] - starts[from]) * (starts[to + 1] - starts[to]);
  for (uint32_t p = starts[to]; p < starts[to + 1]; ++p) {
    for (uint32_t q = starts[from]; q < starts[from + 1]; ++q) {
      double block[9];
      zone_compliance(pack, pack.patch_nodes[p], pack.patch_nodes[q], block);
      for (uint32_t k = 0; k < 9; ++k) set.others[3 * contact + k / 3][3 * other + k % 3] += block[k] / pairs;
    }
  }
}

// C between the boundary of a group and those of the others, three columns a node; then O of its contacts.
bool couple_groups(const pal_pack& pack, uint64_t operations, ZoneState& state, const ZoneGroup& group,
                   uint64_t& spent) {
  ZoneSet& set = state.next;
  const uint32_t* nodes = set.nodes + first_boundary(group);
  uint32_t index = 0;
  for (uint32_t g = 0; g < set.num_groups; ++g) {
    const ZoneGroup& other = set.groups[g];
    if (&other == &group) continue;
    for (uint32_t b = 0; b < other.num_boundary; ++b, ++index) {
      if (index < state.column) continue;
      if (spent >= operations) return false;
      double* columns = group.compliances + size_t{3} * index * group.boundary_stride;
      memset(columns, 0, size_t{3} * group.boundary_stride * sizeof *columns);
      for (uint32_t i = 0; i < group.num_boundary; ++i) {
        fetch_block(pack, nodes[i], set.nodes[first_boundary(other) + b], group.boundary_stride,
                    columns + 3 * i);
      }
      spent += kOfBlock * group.num_boundary;
      ++state.column;
    }
  }
  for (; state.column < index + group.num_contacts * set.num_contacts; ++state.column) {
    if (spent >= operations) return false;
    const uint32_t pair = state.column - index;
    couple_contacts(pack, group.contacts[pair / set.num_contacts], pair % set.num_contacts, set);
    spent += kOfBlock * pack.max_patch_nodes * pack.max_patch_nodes;
  }
  return true;
}

}  // namespace

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
  memset(set.others, 0, size_t{3} * count * sizeof *set.others);
  begin_members(state);
  state.phase = ZoneState::Phase::collect;
  state.group = 0;
  state.matrices_used = 0;
  state.rows_used = 0;
  state.tangents_used = 0;
}

bool advance_zone(const pal_pack& pack, uint64_t operations, ZoneState& state) {
  using Phase = ZoneState::Phase;
  ZoneSet& set = state.next;
  uint64_t spent = 0;
  const auto go_on = [&](ZoneGroup& group) {
    const uint32_t order = round_to_columns(3 * group.num_boundary);
    switch (state.phase) {
      case Phase::collect:
        return collect_members(pack, operations, state, spent);
      case Phase::compliance:
        return fill_compliance(pack, operations, state, group, spent);
      case Phase::inverse:
        return eliminate(operations, order, 2 * order, state, spent);
      case Phase::whole:
        return take_whole(pack, operations, state, group, spent);
      case Phase::stiffness:
        return fill_stiffness(pack, operations, state, group, spent);
      case Phase::own:
        return eliminate(operations, num_eliminated(group), size_of_own(group), state, spent);
      case Phase::condensed:
        return take_exterior(operations, state, group, spent);
      case Phase::couple:
        return couple_groups(pack, operations, state, group, spent);
      case Phase::place:
        return place_next(pack, operations, state, spent);
      case Phase::tangent:
        return advance_first_tangent(pack, operations, state, group, spent);
      case Phase::done:
        return spent <= operations / 2;  // the handover takes its time, too
    }
    return true;
  };
  while (go_on(set.groups[state.group])) {
    state.column = 0;
    if (!set.sound && state.phase != Phase::done) {  // answers nothing
      set.num_nodes = set.num_groups = state.group = 0;
      state.phase = Phase::done;
      continue;
    }
    switch (state.phase) {
      case Phase::collect:
        set.sound = take_matrices(state);
        state.phase = Phase::compliance;
        break;
      case Phase::couple:
        ++state.group;
        state.phase = state.group < set.num_groups ? Phase::compliance : Phase::place;
        if (state.phase == Phase::place) state.group = 0;
        break;
      case Phase::place:
        state.phase = Phase::tangent;
        break;
      case Phase::tangent:
        if (++state.group < set.num_groups) break;
        state.group = 0;
        state.phase = Phase::done;
        break;
      case Phase::done:
        if (!set.sound) place_next(pack, UINT64_MAX, state, spent);
        let_next_answer(pack, state);
        return true;
      default:
        state.phase = static_cast<Phase>(static_cast<uint32_t>(state.phase) + 1);
    }
  }
  return false;
}

}  // namespace palpate
