#include "runtime/src/zone/refinement.hpp"

#include <math.h>
#include <string.h>

#include <algorithm>
#include <atomic>

#include "runtime/src/pack/pack_view.hpp"
#include "runtime/src/zone/zone_inclusion.hpp"

namespace palpate {
namespace {

using Phase = Refinement::Phase;

Exterior exterior_of(const pal_pack& pack, const EliminationKernel& kernel, const Refinement& of,
                     bool is_whole) {
  return {pack, kernel, of.front_of, of.elements, is_whole ? nullptr : of.left_out, of.rest};
}

// Nodes of the zone that move at its boundary are kept; the others of the zone, and fixed ones, are absent.
bool begin_own(const pal_pack& pack, const EliminationKernel& kernel, Refinement& of) {
  const ZoneRequest& request = of.mailbox.request;
  std::fill_n(of.own.roles, pack.organ.num_nodes, NodeRole::eliminated);
  for (uint32_t i = 0; i < request.num_nodes; ++i) of.own.roles[request.nodes[i]] = NodeRole::absent;
  of.own.num_kept = request.num_boundary;
  if (request.num_boundary > of.own.room.kept) return false;
  for (uint32_t b = 0; b < request.num_boundary; ++b) {
    of.own.kept[b] = request.nodes[request.boundary[b]];
    of.own.roles[of.own.kept[b]] = NodeRole::kept;
  }
  memset(of.is_zone_element, 0, pack.organ.num_elements * sizeof *of.is_zone_element);
  for (uint32_t e = 0; e < request.num_elements; ++e) of.is_zone_element[request.elements[e]] = 1;
  leave_out(pack.organ, of.elements, of.is_zone_element, of.left_out);
  const Exterior exterior = exterior_of(pack, kernel, of, false);
  of.failures = 0;
  of.largest_energy = of.unbalanced = 0;
  rest_exterior(exterior, of.exterior);  // also the pressures of shared volumes, which the factor reads
  restart_acceleration(of.acceleration);
  return begin_condensation(exterior, &of.whole, of.scratch, of.own);
}

void begin_exterior_iteration(const pal_pack& pack, const EliminationKernel& kernel, Refinement& of) {
  const ZoneRequest& request = of.mailbox.request;
  // Iterates of other places of the contacts say nothing of the next ones.
  const size_t bytes = request.num_axes * sizeof *request.followed;
  if (memcmp(of.followed, request.followed, bytes) != 0) restart_acceleration(of.acceleration);
  memcpy(of.followed, request.followed, bytes);
  memcpy(of.zone, of.rest, size_t{3} * pack.organ.num_nodes * sizeof *of.zone);
  for (uint32_t i = 0; i < request.num_nodes; ++i)
    memcpy(of.zone + size_t{3} * request.nodes[i], request.displacement + size_t{3} * i, 3 * sizeof *of.zone);
  begin_iteration(exterior_of(pack, kernel, of, false), of.own, of.zone, of.exterior);
}

// Force and energy of the exterior where the frame has the boundary, at a distance m from where the iteration has it (the
// acceleration mixes the boundary, too), and with the exterior in equilibrium to second order:
//
//   g + S m,   E + m . (g + S m / 2) - D,   D = r_O . K_OO^-1 r_O / 2
//
// D is the energy that the exterior still gives up on its way to equilibrium. Returns false in two cases:
//   - D is more than kMostUnbalanced of the stored energy, as where a stiff part of the organ turns. Such an answer is
//     worse than one to first order.
//   - Numbers are not finite, as in a damaged pack.
// The field stays that of the iteration.
bool find_outside(const pal_pack& pack, const EliminationKernel& kernel, Refinement& of, bool& is_finite) {
  constexpr double kMostUnbalanced = 0.1;
  constexpr double kRounding = 1e-6;  // near rest all that is stored may be unbalanced
  const ZoneRequest& request = of.mailbox.request;
  ZoneDelivery& delivery = of.mailbox.delivery;
  const uint32_t stride = of.own.schur_stride;
  memset(of.moved, 0, stride * sizeof *of.moved);
  memset(of.forces, 0, stride * sizeof *of.forces);
  for (uint32_t i = 0; i < 3 * request.num_boundary; ++i) {
    const size_t at = size_t{3} * of.own.kept[i / 3] + i % 3;
    of.moved[i] = of.zone[at] - of.exterior.displacement[at];
  }
  kernel.add_symmetric_product(of.own.schur, stride, of.moved, of.forces);
  double unbalanced = 0;
  for (uint32_t node = 0; node < pack.organ.num_nodes; ++node) {
    if (of.own.roles[node] != NodeRole::eliminated) continue;
    const double* below = of.exterior.forces + size_t{3} * node;  // L^-1 r
    for (int axis = 0; axis < 3; ++axis) unbalanced += 0.5 * below[axis] * below[axis];
  }
  delivery.energy = of.exterior.energy - unbalanced;
  const bool has_fallen = unbalanced < 0.5 * of.unbalanced;
  of.unbalanced = unbalanced;
  if (has_fallen) of.failures = 0;
  double sum = 0;
  for (uint32_t i = 0; i < 3 * request.num_boundary; ++i) {
    const double force = of.exterior.forces[size_t{3} * of.own.kept[i / 3] + i % 3];
    delivery.energy += of.moved[i] * (force + 0.5 * of.forces[i]);
    delivery.outside[i] = force + of.forces[i];
    sum += delivery.outside[i];
  }
  is_finite = isfinite(sum) && isfinite(delivery.energy);
  const double rounding = kRounding * (fabs(of.exterior.rest_energy) + of.largest_energy);
  return is_finite && unbalanced <= kMostUnbalanced * of.exterior.energy + rounding;
}

void write_field(const pal_pack& pack, const Refinement& of) {
  for (uint32_t node = 0; node < pack.organ.num_nodes; ++node) {
    const size_t packed = pack.organ.nodes[node].packed_node;
    if (packed == pack::kNoNode) continue;
    for (size_t axis = 0; axis < 3; ++axis)
      of.mailbox.request.field[3 * packed + axis] =
          static_cast<pal_real>(of.exterior.displacement[3 * size_t{node} + axis] * pack.metres);
  }
}

// The largest component by which the last iteration moved the exterior.
double find_change(const pal_pack& pack, const Refinement& of) {
  double largest = 0;
  for (size_t i = 0; i < size_t{3} * pack.organ.num_nodes; ++i)
    largest = std::max(largest, fabs(of.exterior.displacement[i] - of.exterior.next[i]));
  return largest;
}

void deliver(bool is_good, Refinement& of) {
  of.mailbox.delivery.is_good = is_good;
  of.phase = Phase::begin;
  std::atomic_ref<uint32_t>(of.mailbox.state)
      .store(static_cast<uint32_t>(MailboxState::delivered), std::memory_order_release);
}

// Begins what the request needs first. Returns false where that cannot be had.
bool begin_phase(const pal_pack& pack, const EliminationKernel& kernel, Refinement& of) {
  const ZoneRequest& request = of.mailbox.request;
  if (of.is_broken) return false;
  if (!of.has_whole || of.inclusion != request.inclusion_version) {
    set_organ_stiffness(pack, request.inclusion, of.elements);
    of.inclusion = request.inclusion_version;
    of.set = 0;
    std::fill_n(of.whole.roles, pack.organ.num_nodes, NodeRole::eliminated);
    of.phase = Phase::whole;
    const Exterior organ = exterior_of(pack, kernel, of, true);
    rest_exterior(organ, of.exterior);
    return begin_condensation(organ, nullptr, of.scratch, of.whole);
  }
  if (of.set != request.set) {
    of.set = 0;
    of.phase = Phase::condense;
    return begin_own(pack, kernel, of);
  }
  begin_exterior_iteration(pack, kernel, of);
  of.phase = Phase::iterate;
  return true;
}

// Advances the phase. Returns Progress::ended once an iteration has ended.
Progress advance_phase(const pal_pack& pack, const EliminationKernel& kernel, uint64_t operations,
                       Refinement& of, uint64_t& spent) {
  const Exterior exterior = exterior_of(pack, kernel, of, of.phase == Phase::whole);
  Progress progress = Progress::goes_on;
  switch (of.phase) {
    case Phase::begin:
      return begin_phase(pack, kernel, of) ? Progress::goes_on : Progress::failed;
    case Phase::whole:
      progress = advance_condensation(exterior, operations, of.scratch, of.whole, spent);
      of.has_whole = progress == Progress::ended;
      break;
    case Phase::condense:
      progress = advance_condensation(exterior, operations, of.scratch, of.own, spent);
      if (progress == Progress::ended) of.set = of.mailbox.request.set;
      break;
    case Phase::iterate:
      return advance_iteration(exterior, of.own, operations, of.scratch, &of.acceleration, of.exterior,
                               spent);
  }
  if (progress != Progress::ended) return progress;
  of.phase = Phase::begin;
  return Progress::goes_on;
}

}  // namespace

void carve_refinement(const pal_pack& pack, const ZoneState& zone, Arena& arena, Refinement& refinement) {
  refinement = {};
  carve_mailbox(pack, zone, arena, refinement.mailbox);
  carve_organ_elements(pack, arena, refinement.elements);
  refinement.front_of = carve_front_of(pack, arena);
  const uint32_t kept = std::min(zone.max_boundary, pack.organ.num_free);
  carve_condensation(pack, condensation_room(pack, 0), arena, refinement.whole);
  carve_condensation(pack, condensation_room(pack, kept), arena, refinement.own);
  carve_scratch(pack, kept, arena, refinement.scratch);
  carve_exterior(pack, arena, refinement.exterior);
  const size_t numbers = size_t{3} * pack.organ.num_nodes;
  carve_acceleration(numbers, arena, refinement.acceleration);
  refinement.rest = arena.take<double>(numbers);
  refinement.zone = arena.take<double>(numbers);
  refinement.is_zone_element = arena.take<uint8_t>(pack.organ.num_elements);
  refinement.left_out = arena.take<uint8_t>(most_lanes(pack));
  refinement.moved = arena.take<double>(elimination_stride(3 * kept));
  refinement.forces = arena.take<double>(elimination_stride(3 * kept));
}

void fill_refinement(const pal_pack& pack, Refinement& refinement) {
  refinement.is_broken =
      !fill_organ_elements(pack, refinement.elements) || !fill_front_of(pack, refinement.front_of);
  clear_scratch(pack, refinement.scratch);
  for (uint32_t node = 0; node < pack.organ.num_nodes; ++node)
    memcpy(refinement.rest + size_t{3} * node, pack.organ.nodes[node].displacement,
           3 * sizeof *refinement.rest);
}

bool has_request(const Refinement& refinement) {
  const std::atomic_ref<uint32_t> state(const_cast<uint32_t&>(refinement.mailbox.state));
  return state.load(std::memory_order_acquire) == static_cast<uint32_t>(MailboxState::requested);
}

Refined refine(const pal_pack& pack, const EliminationKernel& kernel, uint64_t operations,
               Refinement& refinement) {
  if (!has_request(refinement)) return Refined::nothing;
  uint64_t spent = 0;
  Progress progress = Progress::goes_on;
  while (progress == Progress::goes_on && spent < operations)
    progress = advance_phase(pack, kernel, operations, refinement, spent);
  if (progress == Progress::goes_on) return Refined::works;
  bool is_finite = true;
  const bool is_good = progress == Progress::ended && find_outside(pack, kernel, refinement, is_finite);
  refinement.failures = is_good ? 0 : refinement.failures + 1;
  // Begins anew at rest, also as such numbers stay in no state.
  if (!is_finite || refinement.failures >= kMostFailures) refinement.set = refinement.failures = 0;
  if (is_good) {
    write_field(pack, refinement);
    refinement.largest_energy = std::max(refinement.largest_energy, refinement.exterior.energy);
    refinement.mailbox.delivery.change = find_change(pack, refinement);
    ++refinement.iterations;
  }
  deliver(is_good, refinement);
  return is_good ? Refined::delivered : Refined::failed;
}

}  // namespace palpate
