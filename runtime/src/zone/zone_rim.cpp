#include "runtime/src/zone/zone_rim.hpp"

#include <math.h>
#include <string.h>

#include <algorithm>

#include "runtime/src/pack/pack_view.hpp"
#include "runtime/src/zone/zone_exterior.hpp"
#include "runtime/src/zone/zone_loads.hpp"

namespace palpate {
namespace {

// A gradient of the displacement that second order still tells of; neighbours to two edges go to 0.7.
constexpr double kMostGradient = 1;
// What s moves the boundary by, of what the tractions move the rim by: where it is more, third order is as much. The brain's
// neighbours at nu = 0.4 and below keep it to two edges. Where four-node elements lock, rounds no longer settle at 0.11.
constexpr double kMostPart = 0.04;

// Bits of ZoneState::element_contacts behind those of contacts: in the rim of a group.
uint64_t rim_bit(uint32_t group) {
  return uint64_t{1} << (kMostZoneContacts + group);
}

// Of what is in a zone, or between near contacts.
constexpr uint64_t kZoneBits = ((uint64_t{1} << kMostZoneContacts) - 1) * (1 + (uint64_t{1} << kBetweenBits));

bool are_near(const ZoneSet& set, const ZoneGroup& group) {
  for (uint32_t slot = 0; slot < group.num_contacts; ++slot) {
    if (is_near(set, group.contacts[slot])) return true;
  }
  return false;
}

// Whether the series has what each two contacts of the group add to each other.
bool has_all_pairs(const pal_pack& pack, const ZoneSet& set, const ZoneGroup& group) {
  for (uint32_t slot = 0; slot < group.num_contacts; ++slot) {
    for (uint32_t other = 0; other < slot; ++other) {
      if (set.sites[group.contacts[slot]] == set.sites[group.contacts[other]]) return false;
    }
  }
  return pack.num_pair_fields > 0;
}

double largest_of(const double v[3]) {
  return std::max({fabs(v[0]), fabs(v[1]), fabs(v[2])});
}

// So many elements, and as many more for each group as its last batch may leave free.
uint32_t num_batches(const ZoneState& state, uint32_t elements) {
  return elements / kLanes + state.max_contacts;
}

// Puts an element into the next free lane of `most` batches.
template <int kNodes>
bool append(const pal_pack& pack, const pack::ZoneElement& element, const ZoneState& state, uint32_t fixed,
            uint32_t most, uint32_t& count, RimBatch<kNodes>* batches) {
  if (count / kLanes >= most) return false;
  int nodes[kNodes];
  for (size_t a = 0; a < kNodes; ++a) {
    const uint32_t place = state.place_of[element.nodes[a]];
    nodes[a] = static_cast<int>(place > 0 ? place - 1 : fixed);
  }
  RimBatch<kNodes>& batch = batches[count / kLanes];
  const int first = static_cast<int>(count++ % kLanes);
  for (int lane = first; lane < kLanes; ++lane) {
    const SecondOrderLaw law = lane == first ? state.second_order[element.material] : SecondOrderLaw();
    if (!set_rim_element<kNodes>(pack, element, nodes, law, lane, batch)) return false;
  }
  return true;
}

double add_second_order_of(const ZoneRim& rim, const double* a, const double* b, double* forces) {
  return std::max(add_second_order(rim.linear, rim.num_linear, a, b, forces),
                  add_second_order(rim.quadratic, rim.num_quadratic, a, b, forces));
}

// U x of the group. Returns how much shorter the loads are than they were.
double find_of_loads(const ZoneFrame& frame, const ZoneGroup& group, double* of_loads) {
  const ZoneRim& rim = group.rim;
  double part = 1;
  memset(of_loads, 0, rim.stride * sizeof *of_loads);
  for (uint32_t slot = 0; slot < group.num_contacts; ++slot) {
    const double* load = frame.set.loads + size_t{3} * group.contacts[slot];
    double x[3];
    if (load_that_counts(frame.set, group.contacts[slot], x))
      part = std::min(part, largest_of(x) / largest_of(load));
    frame.state.kernel.add_product(rim.per_load + size_t{3} * slot * rim.stride, rim.stride, rim.stride, 3, x,
                                   of_loads);
  }
  return part;
}

// -s, of v as it is, or shortened as the loads are and as far as its gradient is beyond what counts. Whether it was.
bool find_second_order(const ZoneFrame& frame, const ZoneGroup& group, const double* v, double* forces) {
  const ZoneRim& rim = group.rim;
  double* less = frame.state.rim_scratch[1];
  double* more = frame.state.rim_scratch[2];
  double part = find_of_loads(frame, group, forces);
  for (uint32_t i = 0; i < rim.stride; ++i) {
    less[i] = part * v[i] - forces[i];
    more[i] = part * v[i] + forces[i];
  }
  for (bool again = false;; again = true) {
    memset(forces, 0, rim.stride * sizeof *forces);
    const double square = add_second_order_of(rim, less, more, forces);
    if (again || square <= kMostGradient * kMostGradient) return part < 1;
    const double shorter = kMostGradient / sqrt(square);
    for (uint32_t i = 0; i < rim.stride; ++i) {
      const double change = (shorter - 1) * part * v[i];
      less[i] += change;
      more[i] += change;
    }
    part *= shorter;
  }
}

}  // namespace

void carve_rims(const pal_pack& pack, Arena& arena, ZoneState& state) {
  if (state.max_contacts < 2 || pack.most_rim_elements == 0) return;
  // Zones share nothing, but rims of groups may, which are of two contacts at least.
  const auto times = [&](uint32_t of_site, uint32_t all) {
    const uint64_t most = uint64_t{all} * (state.max_contacts / 2);
    return static_cast<uint32_t>(std::min(uint64_t{of_site} * state.max_contacts, most));
  };
  state.max_rim_nodes = times(pack.most_rim_nodes, pack.num_zone_nodes);
  state.max_rim_elements = times(pack.most_rim_elements, pack.num_zone_elements);
  state.max_rim_quadratic = times(pack.most_rim_elements, pack.num_quadratic);
  const size_t strides =
      elimination_stride(3 * state.max_rim_nodes + (3 + kEliminationRows) * state.max_contacts);
  const size_t boundaries =
      elimination_stride(3 * state.max_boundary + kEliminationRows * state.max_contacts);
  state.max_rim_columns = strides * boundaries;
  state.max_rim_rows = strides * (3 * state.max_contacts + 1) + 2 * boundaries;
  for (ZoneSet* set : {&state.active, &state.next}) {
    set->rim_nodes = arena.take<uint32_t>(state.max_rim_nodes);
    set->rim_linear = arena.take<RimBatch<4>>(num_batches(state, state.max_rim_elements));
    if (state.max_rim_quadratic > 0)
      set->rim_quadratic = arena.take<RimBatch<10>>(num_batches(state, state.max_rim_quadratic));
    set->rim_columns = arena.take<float>(state.max_rim_columns);
    set->rim_rows = arena.take<double>(state.max_rim_rows);
  }
  for (double*& scratch : state.rim_scratch) scratch = arena.take<double>(strides);
  auto* laws = arena.take<SecondOrderLaw>(pack.num_zone_materials);
  for (uint32_t i = 0; i < pack.num_zone_materials && laws != nullptr; ++i)
    laws[i] = second_order_law(pack.zone_materials[i]);
  state.second_order = laws;
}

bool list_rim(const pal_pack& pack, uint32_t index, ZoneState& state) {
  ZoneSet& set = state.next;
  ZoneGroup& group = set.groups[index];
  if (state.max_rim_nodes == 0 || !set.follows_series || !are_near(set, group) ||
      !has_all_pairs(pack, set, group))
    return true;
  ZoneRim& rim = group.rim;
  rim.first_node = state.rim_nodes_used;
  rim.linear = set.rim_linear + state.rim_linear_used;
  rim.quadratic = set.rim_quadratic + state.rim_quadratic_used;
  const uint32_t first_element = state.num_found_elements;
  const uint32_t most_elements = state.max_elements + state.max_rim_elements;
  bool fits = true;
  for (uint32_t b = 0; b < group.num_boundary && fits; ++b) {
    const pack::ZoneNode& node = pack.zone_nodes[set.nodes[first_boundary(group) + b]];
    for (uint32_t e = 0; e < node.num_elements && fits; ++e) {
      const uint32_t at = pack.zone_node_elements[node.first_element + e];
      const pack::ZoneElement& element = pack.zone_elements[at];
      uint64_t& marks = state.element_contacts[at];
      if ((marks & (kZoneBits | rim_bit(index))) != 0 || !has_second_order(pack, element)) continue;
      fits = state.num_found_elements < most_elements;
      if (!fits) break;
      marks |= rim_bit(index);
      state.found_elements[state.num_found_elements++] = at;
      for (uint32_t a = 0; a < element.num_nodes && fits; ++a) {
        const uint32_t of_element = element.nodes[a];
        if (of_element >= pack.num_zone_free || state.place_of[of_element] != 0) continue;
        fits = rim.first_node + rim.num_nodes < state.max_rim_nodes;
        if (!fits) break;
        set.rim_nodes[rim.first_node + rim.num_nodes] = of_element;
        state.place_of[of_element] = ++rim.num_nodes;
      }
    }
  }
  uint32_t num_linear = 0;
  uint32_t num_quadratic = 0;
  for (uint32_t i = first_element; i < state.num_found_elements && fits; ++i) {
    const pack::ZoneElement& element = pack.zone_elements[state.found_elements[i]];
    if (element.num_nodes == 4) {
      fits =
          append(pack, element, state, rim.num_nodes,
                 num_batches(state, state.max_rim_elements) - state.rim_linear_used, num_linear, rim.linear);
    } else {
      fits = state.max_rim_quadratic > 0 &&
             append(pack, element, state, rim.num_nodes,
                    num_batches(state, state.max_rim_quadratic) - state.rim_quadratic_used, num_quadratic,
                    rim.quadratic);
    }
  }
  for (uint32_t i = 0; i < rim.num_nodes; ++i) state.place_of[set.rim_nodes[rim.first_node + i]] = 0;
  rim.num_linear = (num_linear + kLanes - 1) / kLanes;
  rim.num_quadratic = (num_quadratic + kLanes - 1) / kLanes;
  rim.stride = elimination_stride(3 * rim.num_nodes + 3);
  state.rim_nodes_used += rim.num_nodes;
  state.rim_linear_used += rim.num_linear;
  state.rim_quadratic_used += rim.num_quadratic;
  const size_t columns = size_t{group.boundary_stride} * rim.stride;
  const size_t rows = size_t{rim.stride} * (3 * group.num_contacts + 1) + size_t{2} * group.boundary_stride;
  if (!fits || state.rim_columns_used + columns > state.max_rim_columns ||
      state.rim_rows_used + rows > state.max_rim_rows)
    return false;
  rim.compliance = set.rim_columns + state.rim_columns_used;
  rim.per_load = set.rim_rows + state.rim_rows_used;
  rim.force = rim.per_load + size_t{3} * group.num_contacts * rim.stride;
  rim.moved = rim.force + rim.stride;
  rim.pull = rim.moved + group.boundary_stride;
  state.rim_columns_used += columns;
  state.rim_rows_used += rows;
  return true;
}

bool fill_rim(const pal_pack& pack, uint64_t operations, ZoneState& state, ZoneGroup& group,
              uint64_t& spent) {
  ZoneSet& set = state.next;
  ZoneRim& rim = group.rim;
  if (rim.num_nodes == 0) return true;
  for (; state.column < group.num_contacts; ++state.column) {
    if (spent >= operations) return false;
    double* per_load = rim.per_load + size_t{3} * state.column * rim.stride;
    find_moves_of_loads(pack, set.sites[group.contacts[state.column]], set.rim_nodes + rim.first_node,
                        rim.num_nodes, rim.stride, per_load);
    for (uint32_t i = 0; i < 3 * rim.stride; ++i) set.sound = set.sound && isfinite(per_load[i]);
    spent += kOfBlock * rim.num_nodes * pack.max_patch_nodes;
  }
  for (; state.column < group.num_contacts + rim.num_nodes; ++state.column) {
    if (spent >= operations) return false;
    if (state.column == group.num_contacts) {
      memset(rim.compliance, 0, size_t{group.boundary_stride} * rim.stride * sizeof *rim.compliance);
      spent += size_t{group.boundary_stride} * rim.stride / 4;
      rest_rim(group);
    }
    const uint32_t at = state.column - group.num_contacts;
    const uint32_t node = set.rim_nodes[rim.first_node + at];
    for (uint32_t b = 0; b < group.num_boundary; ++b) {
      double block[9];
      zone_compliance(pack, node, set.nodes[first_boundary(group) + b], block);
      for (uint32_t entry = 0; entry < 9; ++entry)
        rim.compliance[size_t{3 * b + entry % 3} * rim.stride + 3 * at + entry / 3] =
            static_cast<float>(block[entry]);
    }
    spent += kOfBlock * group.num_boundary;
  }
  return true;
}

void find_rim(ZoneFrame& frame, ZoneGroup& group) {
  constexpr double kLargestForce = 1e30;
  ZoneRim& rim = group.rim;
  if (rim.num_nodes == 0) return;
  const EliminationKernel& kernel = frame.state.kernel;
  double* t = frame.state.vector;
  const double* traction = frame.set.traction + size_t{3} * first_boundary(group);
  memset(t, 0, group.boundary_stride * sizeof *t);
  for (uint32_t i = 0; i < 3 * group.num_boundary; ++i) t[i] = traction[i] - rim.pull[i];
  double* v = frame.state.rim_scratch[0];
  memset(v, 0, rim.stride * sizeof *v);
  kernel.add_float_product(rim.compliance, rim.stride, rim.stride, 3 * group.num_boundary, t, v);
  rim.is_limited = find_second_order(frame, group, v, rim.force);
  bool sound = true;
  double reach = 0;
  for (uint32_t i = 0; i < rim.stride; ++i) {
    rim.force[i] = i < 3 * rim.num_nodes ? -rim.force[i] : 0;
    reach = std::max(reach, fabs(v[i]));
    sound = sound && fabs(rim.force[i]) <= kLargestForce;
  }
  double* moved = frame.state.vector;
  memset(moved, 0, group.boundary_stride * sizeof *moved);
  kernel.add_transposed_product(rim.compliance, rim.stride, rim.stride, group.boundary_stride, rim.force,
                                moved);
  double largest = 0;
  for (uint32_t i = 0; i < group.boundary_stride; ++i) {
    sound = sound && fabs(moved[i]) <= kLargestForce;
    largest = std::max(largest, fabs(moved[i]));
  }
  const double part = largest > kMostPart * reach ? kMostPart * reach / largest : 1;
  rim.is_limited = rim.is_limited || part < 1;
  rim.largest = part * largest;
  rim.change = 0;
  for (uint32_t i = 0; i < rim.stride && part < 1; ++i) rim.force[i] *= part;
  for (uint32_t i = 0; i < group.boundary_stride; ++i) {
    moved[i] *= part;
    rim.change = std::max(rim.change, fabs(moved[i] - rim.moved[i]));
    rim.moved[i] = moved[i];
  }
  memset(rim.pull, 0, group.boundary_stride * sizeof *rim.pull);
  kernel.add_symmetric_product(group.whole, group.boundary_stride, moved, rim.pull);
  rim.since = 0;
  if (sound) return;
  rest_rim(group);
  frame.flags |= PAL_FLAG_NOT_FINITE;
}

void rest_rim(ZoneGroup& group) {
  ZoneRim& rim = group.rim;
  if (rim.num_nodes == 0) return;
  memset(rim.force, 0, rim.stride * sizeof *rim.force);
  memset(rim.moved, 0, size_t{2} * group.boundary_stride * sizeof *rim.moved);  // and the pull
  rim.change = rim.largest = rim.since = 0;
  rim.is_limited = false;
}

double rim_energy(const ZoneSet& set, const ZoneGroup& group) {
  if (group.rim.num_nodes == 0) return 0;
  const double* t = set.traction + size_t{3} * first_boundary(group);
  double energy = 0;
  for (uint32_t i = 0; i < 3 * group.num_boundary; ++i)
    energy += part_beyond_half(2) * (t[i] - group.rim.pull[i]) * group.rim.moved[i];
  return energy;
}

}  // namespace palpate
