#include "runtime/src/zone/zone_overlap.hpp"

#include <math.h>
#include <string.h>

#include "runtime/src/pack/pack_view.hpp"
#include "runtime/src/zone/zone_exterior.hpp"
#include "runtime/src/zone/zone_loads.hpp"

namespace palpate {
namespace {

constexpr double kStep = 1e-3;  // of a mean edge, the farthest node: of differences that give n2

// How often an element is to be taken out of the products of two contacts' loads.
int times_counted(uint32_t zones, uint32_t contact, uint32_t other) {
  if ((zones >> contact & 1) != 0 || (zones >> other & 1) != 0) return 0;
  int count = 0;
  for (uint32_t rest = zones; rest != 0; rest &= rest - 1) ++count;
  return contact == other ? count - 1 : 1;
}

bool is_counted(const ZoneLanes& lanes, uint32_t contact, uint32_t other) {
  for (int lane = 0; lane < lanes.count; ++lane) {
    if (times_counted(lanes.zones[lane], contact, other) != 0) return true;
  }
  return false;
}

// Of these batches the first that holds an element which counts, to the last; how many.
template <int kNodes>
uint32_t trim(uint32_t contact, uint32_t other, ZoneBatch<kNodes>*& batches, uint32_t count) {
  while (count > 0 && !is_counted(batches[count - 1], contact, other)) --count;
  while (count > 0 && !is_counted(*batches, contact, other)) {
    ++batches;
    --count;
  }
  return count;
}

// The elements that count, and some between them; all or none where patches share volumes, for theirs may be anywhere.
ZoneBatches those_that_count(const ZoneBatches& batches, uint32_t contact, uint32_t other) {
  ZoneBatches some = batches;
  some.num_linear = trim(contact, other, some.linear, some.num_linear);
  some.num_quadratic = trim(contact, other, some.quadratic, some.num_quadratic);
  return batches.num_patches > 0 && some.num_linear + some.num_quadratic > 0 ? batches : some;
}

// Makes each element count that often, or once as in the mesh.
void count_elements(const ZoneBatches& batches, uint32_t contact, uint32_t other, bool as_in_mesh) {
  constexpr double kNone = 1e-30;  // where a volume of zero would leave its patch without a mean
  for_each_lanes(batches, [&](ZoneLanes& lanes, auto) {
    for (int lane = 0; lane < kLanes; ++lane) {
      const int times = as_in_mesh ? 1 : times_counted(lanes.zones[lane], contact, other);
      lanes.stiffness[lane] = times != 0 ? times : kNone;
    }
  });
  scale_volumes(batches);
}

// A direction to go in from rest, and how much of it is a step: zero where it leads nowhere.
struct Direction {
  const double* moves;
  double step;
};

Direction direction_of(const pal_pack& pack, const double* moves, size_t count) {
  double farthest = 0;
  for (size_t i = 0; i < count; ++i) farthest = fabs(moves[i]) > farthest ? fabs(moves[i]) : farthest;
  return {moves, farthest > 0 ? kStep * pack.mean_surface_edge / farthest : 0};
}

// Forces of these elements about rest, of whose differences along a + b and a - b n2(a, b) is made:
//
//   4 n2(a, b) = P(a + b) + P(-(a + b)) - P(a - b) - P(-(a - b))
//
// Leaves one of those four terms, of a step along each, in ZoneState::forces, without its sign, which it returns.
double find_term(ZoneState& state, const ZoneGroup& group, const ZoneBatches& batches, uint32_t term,
                 const Direction& a, const Direction& b) {
  const uint32_t first = 3 * group.first_node;
  const uint32_t count = 3 * group.num_nodes;
  double* u = state.next.displacement + first;
  double* rest = state.saved + first;
  const double sign = term < 2 ? 1 : -1;
  const double along_a = term % 2 == 0 ? a.step : -a.step;
  const double along_b = term % 2 == 0 ? sign * b.step : -sign * b.step;
  memcpy(rest, u, count * sizeof *u);
  for (uint32_t i = 0; i < count; ++i) u[i] += along_a * a.moves[i] + along_b * b.moves[i];
  memset(state.forces + first, 0, count * sizeof *state.forces);
  add_zone_forces(batches, state.next.displacement, state.forces);
  memcpy(u, rest, count * sizeof *u);
  return sign;
}

}  // namespace

bool fill_overlaps(const pal_pack& pack, uint64_t operations, uint32_t first_row, ZoneState& state,
                   ZoneGroup& group, uint64_t& spent) {
  const ZoneSet& set = state.next;
  const uint32_t columns = num_overlaps(pack, set);
  const uint32_t stride = elimination_stride(first_row + columns);
  const size_t of_axis = size_t{3} * group.num_nodes;
  if (columns == 0) return true;
  for (; state.column < set.num_contacts; ++state.column) {
    if (spent >= operations) return false;
    const uint32_t site = set.sites[state.column];
    find_moves_of_loads(pack, site, set.nodes + group.first_node, group.num_nodes, of_axis,
                        state.moves + 3 * of_axis * state.column);  // U
    spent += kOfBlock * group.num_nodes * (pack.patch_starts[site + 1] - pack.patch_starts[site]);
  }
  for (; state.column < set.num_contacts + 4 * columns; ++state.column) {
    if (spent >= operations) return false;
    const uint32_t column = (state.column - set.num_contacts) / 4;
    const uint32_t term = (state.column - set.num_contacts) % 4;
    uint32_t u = 0;
    uint32_t v = 0;
    pack::find_lower_block(column, u, v);
    const uint32_t contact = u / 3;
    const uint32_t other = v / 3;
    const Direction a = direction_of(pack, state.moves + of_axis * u, of_axis);
    const Direction b = direction_of(pack, state.moves + of_axis * v, of_axis);
    // What two contacts of one site add to each other has no column, and is counted nowhere.
    const bool is_nothing =
        a.step == 0 || b.step == 0 || (contact != other && set.sites[contact] == set.sites[other]);
    const ZoneBatches some = is_nothing ? ZoneBatches() : those_that_count(group.batches, contact, other);
    spent += 2 * of_axis + uint64_t{20} * (group.batches.num_linear + group.batches.num_quadratic);
    if (some.num_linear + some.num_quadratic == 0) {
      state.column += 3;  // the other terms
      continue;
    }
    count_elements(some, contact, other, false);
    const double sign = find_term(state, group, some, term, a, b);
    double factor = sign / (4 * a.step * b.step);
    if (contact == other) factor *= u == v ? -0.5 : -1;
    count_elements(some, contact, other, true);
    spent += 2 * force_operations(some);
    for (uint32_t i = 0; i < of_axis; ++i) {
      const uint32_t place = group.first_node + i / 3;
      const uint32_t axes = pack.zone_nodes[set.nodes[place]].free_axes;
      if (state.base[place] == kNoUnknown || (axes >> (i % 3) & 1) == 0) continue;
      state.preparation[size_t{state.base[place] + i % 3} * stride + first_row + column] +=
          factor * state.forces[3 * group.first_node + i];
    }
  }
  return true;
}

void add_overlaps(const pal_pack& pack, const ZoneState& state, const ZoneSet& set, const ZoneGroup& group,
                  uint32_t by_axis, double* forces) {
  const uint32_t columns = num_overlaps(pack, set);
  if (columns == 0) return;
  double loads[3 * kMostZoneContacts];
  for (uint32_t c = 0; c < set.num_contacts; ++c) {
    const bool is_shortened = load_that_counts(set, c, loads + size_t{3} * c);
    if (is_shortened && c == by_axis / 3) return;
  }
  const auto add = [&](uint64_t column, uint32_t count, const double* products) {
    state.kernel.add_product(group.overlaps + column * group.boundary_stride, group.boundary_stride,
                             group.boundary_stride, count, products, forces);
  };
  if (by_axis != kNoAxis) {
    for (uint32_t u = 0; u < 3 * set.num_contacts; ++u) {
      const double factor = u == by_axis ? 2 * loads[u] : loads[u];
      add(u > by_axis ? pack::lower_block(u, by_axis) : pack::lower_block(by_axis, u), 1, &factor);
    }
    return;
  }
  double products[kMostOverlaps];
  double* product = products;
  for (uint32_t u = 0; u < 3 * set.num_contacts; ++u) {
    for (uint32_t v = 0; v <= u; ++v) *product++ = loads[u] * loads[v];
  }
  add(0, columns, products);
}

}  // namespace palpate
