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

// `of.phase` says which elements, and where the tangent is.
Exterior exterior_of(const pal_pack& pack, const EliminationKernel& kernel, const Refinement& of) {
  const uint8_t* left_out = of.phase == Phase::whole ? nullptr : of.left_out;
  const double* displacement = of.phase == Phase::renew ? of.exterior.displacement : of.rest;
  return {pack, kernel, of.front_of, of.elements, left_out, displacement};
}

// Condenses the exterior with the tangent at rest, which has the pressures at rest.
bool begin_condensation_at_rest(const pal_pack& pack, const EliminationKernel& kernel, Refinement& of) {
  of.phase = Phase::condense;
  of.set = 0;
  const ZoneBatches& all = of.elements.all;
  for (uint32_t p = all.first_patch; p < all.first_patch + all.num_patches; ++p)
    all.patches[p].followed = all.patches[p].at_rest;
  return begin_condensation(exterior_of(pack, kernel, of), &of.whole, of.scratch, of.own);
}

// Lists the exterior of the request's zone, at rest. Nodes of the zone that move at its boundary are kept; the others of
// the zone, and fixed ones, are absent.
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
  of.phase = Phase::condense;
  of.failures = 0;
  of.largest_energy = of.unbalanced = of.change = 0;
  // Also the pressures of shared volumes, which the factor reads.
  rest_exterior(exterior_of(pack, kernel, of), of.exterior);
  restart_acceleration(of.acceleration);
  return begin_condensation_at_rest(pack, kernel, of);
}

bool stands_still(const Refinement& of) {
  const ZoneRequest& request = of.mailbox.request;
  return memcmp(of.followed, request.followed, request.num_axes * sizeof *request.followed) == 0;
}

// Whether iterations would gain by a tangent where they have got to.
bool is_tangent_old(const pal_pack& pack, const Refinement& of) {
  constexpr uint32_t kIterations = 2;
  constexpr double kConverged = 1e-6;   // of the scene's largest displacement
  constexpr double kUnbalanced = 0.01;  // of the stored energy
  if (of.iterations_of_tangent < kIterations || of.failures > 0) return false;
  const bool is_near = of.unbalanced <= kUnbalanced * of.exterior.energy;
  return stands_still(of) ? is_near && of.change > kConverged * pack.max_displacement : !is_near;
}

void begin_exterior_iteration(const pal_pack& pack, const EliminationKernel& kernel, Refinement& of) {
  const ZoneRequest& request = of.mailbox.request;
  // Iterates of other places of the contacts say nothing of the next ones.
  if (!stands_still(of)) restart_acceleration(of.acceleration);
  memcpy(of.followed, request.followed, request.num_axes * sizeof *request.followed);
  memcpy(of.zone, of.rest, size_t{3} * pack.organ.num_nodes * sizeof *of.zone);
  for (uint32_t i = 0; i < request.num_nodes; ++i)
    memcpy(of.zone + size_t{3} * request.nodes[i], request.displacement + size_t{3} * i, 3 * sizeof *of.zone);
  begin_iteration(exterior_of(pack, kernel, of), of.own, of.zone, of.exterior);
}

// c and C of the delivery: with g, E and w_e of the iteration, and the exterior in equilibrium to second order,
//
//   c = g - S w_e,   C = E - D - w_e . (c + S w_e / 2),   D = r_O . K_OO^-1 r_O / 2
//
// D is the energy that the exterior still gives up on its way to equilibrium. Returns false in two cases:
//   - D is more than kMostUnbalanced of the stored energy, as where a stiff part of the organ turns. Such an answer is
//     worse than one to first order.
//   - Numbers are not finite, as in a damaged pack.
// The field stays that of the iteration.
bool find_correction(const pal_pack& pack, const EliminationKernel& kernel, Refinement& of, bool& is_finite) {
  constexpr double kMostUnbalanced = 0.1;
  constexpr double kRounding = 1e-6;  // near rest all that is stored may be unbalanced
  const ZoneRequest& request = of.mailbox.request;
  ZoneDelivery& delivery = of.mailbox.delivery;
  const uint32_t stride = of.own.schur_stride;
  memset(of.moved, 0, stride * sizeof *of.moved);
  memset(of.forces, 0, stride * sizeof *of.forces);
  for (uint32_t i = 0; i < 3 * request.num_boundary; ++i) {
    const size_t at = size_t{3} * of.own.kept[i / 3] + i % 3;
    of.moved[i] = of.exterior.displacement[at] - of.rest[at];  // w_e
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
  memcpy(delivery.moved, of.moved, 3 * request.num_boundary * sizeof *of.moved);
  for (uint32_t i = 0; i < 3 * request.num_boundary; ++i) {
    delivery.force[i] = of.exterior.forces[size_t{3} * of.own.kept[i / 3] + i % 3] - of.forces[i];
    delivery.energy -= of.moved[i] * (delivery.force[i] + 0.5 * of.forces[i]);
    sum += delivery.force[i];
  }
  is_finite = isfinite(sum) && isfinite(delivery.energy);
  const double rounding = kRounding * (fabs(of.exterior.rest_energy) + of.largest_energy);
  return is_finite && unbalanced <= kMostUnbalanced * of.exterior.energy + rounding;
}

// The rows of a group and the column of a node in S as frames have it (exterior_size()); `kept`: of the boundary's nodes.
double* columns_of(const ZoneRequest& request, uint32_t kept, uint32_t g, double* of_group) {
  const size_t stride = request.groups[g].boundary_stride;
  const uint32_t place = request.boundary[kept];
  size_t column = 3 * size_t{place - request.groups[g].first_boundary};
  for (uint32_t h = 0, before = 0; h < request.num_groups; ++h) {
    const ZoneRequest::Group& other = request.groups[h];
    if (h != g && place - other.first_boundary < other.num_boundary)
      column = stride + 3 * size_t{before + place - other.first_boundary};
    if (h != g) before += other.num_boundary;
  }
  return of_group + column * stride;
}

// S of all groups, if the request has another one.
void write_tangent(Refinement& of) {
  const ZoneRequest& request = of.mailbox.request;
  ZoneDelivery& delivery = of.mailbox.delivery;
  delivery.tangent = of.tangent;
  if (request.tangent == of.tangent) return;
  memset(delivery.exterior, 0, request.exterior_size * sizeof *delivery.exterior);
  double* of_group = delivery.exterior;
  uint32_t num_boundary = 0;
  for (uint32_t g = 0; g < request.num_groups; ++g) num_boundary += request.groups[g].num_boundary;
  for (uint32_t g = 0; g < request.num_groups; ++g) {
    const ZoneRequest::Group& group = request.groups[g];
    const size_t stride = group.boundary_stride;
    for (uint32_t kept = 0; kept < request.num_boundary; ++kept) {
      double* columns = columns_of(request, kept, g, of_group);
      for (uint32_t row = 0; row < request.num_boundary; ++row) {
        const uint32_t place = request.boundary[row] - group.first_boundary;
        if (place >= group.num_boundary) continue;
        for (size_t entry = 0; entry < 9; ++entry)
          columns[entry / 3 * stride + 3 * place + entry % 3] =
              of.own.schur[(3 * size_t{kept} + entry / 3) * of.own.schur_stride + 3 * row + entry % 3];
      }
    }
    of_group += stride * (stride + 3 * size_t{num_boundary - group.num_boundary});
  }
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
    const Exterior organ = exterior_of(pack, kernel, of);
    rest_exterior(organ, of.exterior);
    return begin_condensation(organ, nullptr, of.scratch, of.whole);
  }
  if (of.set != request.set) return begin_own(pack, kernel, of);
  if (is_tangent_old(pack, of)) {
    of.phase = Phase::renew;
    return begin_condensation(exterior_of(pack, kernel, of), nullptr, of.scratch, of.own);
  }
  of.phase = Phase::iterate;
  begin_exterior_iteration(pack, kernel, of);
  return true;
}

// The new condensation is that of the request's zone.
void take_condensation(const pal_pack& pack, const EliminationKernel& kernel, Refinement& of) {
  of.set = of.mailbox.request.set;
  ++of.tangent;
  of.iterations_of_tangent = 0;
  restart_acceleration(of.acceleration);
  of.phase = Phase::evaluate;
  begin_evaluation(exterior_of(pack, kernel, of), of.exterior);
}

// Advances the phase. Returns Progress::ended once an iteration has ended.
Progress advance_phase(const pal_pack& pack, const EliminationKernel& kernel, uint64_t operations,
                       Refinement& of, uint64_t& spent) {
  if (of.phase == Phase::begin) return begin_phase(pack, kernel, of) ? Progress::goes_on : Progress::failed;
  const Exterior exterior = exterior_of(pack, kernel, of);
  Condensation& factor = of.phase == Phase::whole ? of.whole : of.own;
  const bool is_iteration = of.phase == Phase::evaluate || of.phase == Phase::iterate;
  const Progress progress =
      is_iteration
          ? advance_iteration(exterior, factor, operations, of.scratch, &of.acceleration, of.exterior, spent)
          : advance_condensation(exterior, operations, of.scratch, factor, spent);
  if (progress == Progress::goes_on || (progress == Progress::failed && of.phase != Phase::renew))
    return progress;
  switch (of.phase) {
    case Phase::whole:
      of.has_whole = true;
      of.phase = Phase::begin;
      break;
    case Phase::renew:
      // Where the tangent is not positive definite, that at rest has to do.
      if (progress == Progress::failed)
        return begin_condensation_at_rest(pack, kernel, of) ? Progress::goes_on : Progress::failed;
      take_condensation(pack, kernel, of);
      break;
    case Phase::condense:
      take_condensation(pack, kernel, of);
      break;
    case Phase::iterate:
      ++of.iterations_of_tangent;
      return Progress::ended;
    default:
      of.phase = Phase::begin;
  }
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
  const bool is_good = progress == Progress::ended && find_correction(pack, kernel, refinement, is_finite);
  refinement.failures = is_good ? 0 : refinement.failures + 1;
  // Begins anew at rest, also as such numbers stay in no state.
  if (!is_finite || refinement.failures >= kMostFailures) refinement.set = refinement.failures = 0;
  if (is_good) {
    write_field(pack, refinement);
    write_tangent(refinement);
    refinement.largest_energy = std::max(refinement.largest_energy, refinement.exterior.energy);
    refinement.mailbox.delivery.change = refinement.change = find_change(pack, refinement);
    ++refinement.iterations;
  }
  deliver(is_good, refinement);
  return is_good ? Refined::delivered : Refined::failed;
}

}  // namespace palpate
