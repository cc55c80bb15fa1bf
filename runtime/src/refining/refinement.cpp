#include "runtime/src/refining/refinement.hpp"

#include <math.h>
#include <string.h>

#include <algorithm>
#include <atomic>

#include "runtime/src/pack/pack_view.hpp"
#include "runtime/src/refining/delivery.hpp"
#include "runtime/src/refining/state_transfer.hpp"
#include "runtime/src/refining/zone_members.hpp"
#include "runtime/src/zone/zone_inclusion.hpp"
#include "runtime/src/zone/zone_motion.hpp"

namespace palpate {
namespace {

using Phase = Refinement::Phase;

// `of.phase` says which elements, and where the tangent is.
Exterior exterior_of(const pal_pack& pack, const EliminationKernel& kernel, const Refinement& of) {
  const uint8_t* zone_of_lane = of.phase == Phase::whole ? nullptr : of.outline.zone_of_lane;
  const double* displacement = of.phase == Phase::renew ? of.exterior.displacement : of.rest;
  return {pack, kernel, of.front_of, of.elements, zone_of_lane, displacement};
}

bool is_preparing(const Refinement& of) {
  return of.mailbox.request.kind == ZoneRequest::Kind::prepare;
}

// Condenses the exterior with the tangent at rest, which has the pressures at rest.
bool begin_condensation_at_rest(const pal_pack& pack, const EliminationKernel& kernel, Refinement& of) {
  of.phase = Phase::condense;
  of.has_own = false;
  const ZoneBatches& all = of.elements.all;
  for (uint32_t p = all.first_patch; p < all.first_patch + all.num_patches; ++p)
    all.patches[p].followed = all.patches[p].at_rest;
  return begin_condensation(exterior_of(pack, kernel, of), &of.whole, of.scratch, of.own);
}

// Puts the exterior to rest and condenses it there.
bool begin_at_rest(const pal_pack& pack, const EliminationKernel& kernel, Refinement& of) {
  of.phase = Phase::condense;
  of.history.failures = 0;
  of.history.is_unstable = false;
  of.history.largest_energy = of.history.unbalanced = of.history.change = 0;
  rest_exterior(exterior_of(pack, kernel, of), of.exterior);
  std::fill_n(of.response.followed, kMostZoneAxes, 0.0);
  restart_acceleration(of.acceleration);
  return begin_condensation_at_rest(pack, kernel, of);
}

// Places the prepared set where the organ is, and condenses the exterior at rest. The exterior stays where it is, unless the
// organ was at rest.
bool begin_exterior(const pal_pack& pack, const EliminationKernel& kernel, Refinement& of) {
  const size_t bytes = size_t{3} * pack.organ.num_nodes * sizeof *of.zone;
  memcpy(of.zone, of.has_followed ? of.exterior.displacement : of.rest, bytes);
  if (!place_set(pack, of.zone, of.preparation)) of.has_followed = false;
  if (!list_outline(pack, of.preparation, of.mailbox.request.next_set, of.elements, of.own, of.outline) ||
      !begin_at_rest(pack, kernel, of))
    return false;
  if (of.has_followed) memcpy(of.exterior.displacement, of.zone, bytes);
  return true;
}

bool stands_still(const Refinement& of) {
  const ZoneRequest& request = of.mailbox.request;
  return memcmp(of.history.followed, request.followed, request.num_axes * sizeof *request.followed) == 0;
}

// Whether iterations would gain by a tangent where they have got to.
bool is_tangent_old(const pal_pack& pack, const Refinement& of) {
  constexpr uint32_t kIterations = 2;
  constexpr double kConverged = 1e-6;   // of the scene's largest displacement
  constexpr double kUnbalanced = 0.01;  // of the stored energy
  if (of.history.iterations_of_tangent < kIterations || of.history.failures > 0) return false;
  const bool is_near = of.history.unbalanced <= kUnbalanced * of.exterior.energy;
  return stands_still(of) ? is_near && of.history.change > kConverged * pack.max_displacement : !is_near;
}

// Puts the displacements of the set's nodes in Refinement::zone.
void write_zone(Refinement& of, const double* displacement) {
  const ZoneMembers& members = of.outline.members;
  for (uint32_t i = 0; i < members.num_nodes; ++i)
    memcpy(of.zone + size_t{3} * members.nodes[i], displacement + size_t{3} * i, 3 * sizeof *of.zone);
}

void begin_exterior_iteration(const pal_pack& pack, const EliminationKernel& kernel, Refinement& of) {
  const ZoneRequest& request = of.mailbox.request;
  // Iterates of other places of the contacts say nothing of the next ones.
  if (!stands_still(of)) {
    restart_acceleration(of.acceleration);
    of.history.is_unstable = false;
  }
  memcpy(of.history.followed, request.followed, request.num_axes * sizeof *request.followed);
  memcpy(of.zone, of.rest, size_t{3} * pack.organ.num_nodes * sizeof *of.zone);
  write_zone(of, request.displacement);
  begin_iteration(exterior_of(pack, kernel, of), of.own, of.zone, of.exterior);
}

void deliver(bool is_good, Refinement& of) {
  of.mailbox.delivery.is_good = is_good;
  of.mailbox.delivery.is_unstable = of.history.is_unstable;
  of.phase = Phase::begin;
  std::atomic_ref<uint32_t>(of.mailbox.state)
      .store(static_cast<uint32_t>(MailboxState::delivered), std::memory_order_release);
}

bool begin_whole(const pal_pack& pack, const EliminationKernel& kernel, const Inclusion& inclusion,
                 uint32_t version, Refinement& of) {
  set_organ_stiffness(pack, inclusion, of.elements);
  of.inclusion = version;
  of.has_whole = of.has_own = false;
  std::fill_n(of.whole.roles, pack.organ.num_nodes, NodeRole::eliminated);
  of.phase = Phase::whole;
  const Exterior organ = exterior_of(pack, kernel, of);
  rest_exterior(organ, of.exterior);
  return begin_condensation(organ, nullptr, of.scratch, of.whole);
}

// Places the nodes that contacts hold, in the set and in the lane's displacements, and begins its first tangents.
void begin_first_tangents(const pal_pack& pack, const EliminationKernel& kernel, Refinement& of) {
  ZonePreparation& preparation = of.preparation;
  ZoneFrame frame = {pack, kernel, preparation.work, preparation.set, 0};
  for (uint32_t g = 0; g < frame.set.num_groups; ++g) place_held(frame, frame.set.groups[g]);
  write_zone(of, frame.set.displacement);
  of.tangents = {};
  of.phase = Phase::tangents;
}

// After an iteration: whether the zones are elsewhere than at the last tangents of the groups, or S is another one.
bool needs_tangents(const pal_pack& pack, const Refinement& of) {
  const bool has_new_exterior =
      of.mailbox.request.tangent != of.history.tangent || of.history.tangent_of_groups != of.history.tangent;
  return has_new_exterior || find_change(pack, of) > kSamePlace * pack.max_displacement;
}

bool advance_tangents(const pal_pack& pack, const EliminationKernel& kernel, uint64_t operations,
                      Refinement& of, uint64_t& spent) {
  ZoneDelivery& delivery = of.mailbox.delivery;
  const ZoneMaster* masters = is_preparing(of) ? of.preparation.set.masters : of.mailbox.request.masters;
  const GroupTangentSource source = {pack, kernel, of.elements, of.outline, of.blocks, of.zone, masters};
  if (!advance_group_tangents(source, operations, delivery.tangents, delivery.made, of.tangents, spent))
    return false;
  delivery.has_tangents = true;
  of.history.tangent_of_groups = of.history.tangent;
  return true;
}

// Begins what the request needs first. Returns false where that cannot be had.
bool begin_phase(const pal_pack& pack, const EliminationKernel& kernel, Refinement& of) {
  const ZoneRequest& request = of.mailbox.request;
  if (of.is_broken) return false;
  if (!of.has_whole || of.inclusion != request.inclusion_version)
    return begin_whole(pack, kernel, request.inclusion, request.inclusion_version, of);
  const bool is_of_outline = of.outline.set == request.set;
  if (is_preparing(of) && !(request.is_strained && of.has_own && is_of_outline && !of.has_followed)) {
    begin_members(pack, of.preparation);
    of.phase = Phase::members;
    return true;
  }
  if (!is_of_outline) return false;
  if (!of.has_own) return begin_at_rest(pack, kernel, of);
  if (!is_preparing(of) && is_tangent_old(pack, of)) {
    of.phase = Phase::renew;
    return begin_condensation(exterior_of(pack, kernel, of), nullptr, of.scratch, of.own);
  }
  of.phase = Phase::iterate;
  of.mailbox.delivery.has_tangents = false;
  begin_exterior_iteration(pack, kernel, of);
  return true;
}

// The new condensation is that of the outline.
void take_condensation(const pal_pack& pack, const EliminationKernel& kernel, Refinement& of) {
  of.has_own = true;
  ++of.history.tangent;
  of.history.iterations_of_tangent = 0;
  copy_blocks(of);
  restart_acceleration(of.acceleration);
  of.phase = Phase::evaluate;
  begin_evaluation(exterior_of(pack, kernel, of), of.exterior);
}

// The work of the phase.
Progress advance_work(const pal_pack& pack, const EliminationKernel& kernel, uint64_t operations,
                      Refinement& of, uint64_t& spent) {
  const auto progress_of = [](bool has_ended) { return has_ended ? Progress::ended : Progress::goes_on; };
  ZonePreparation& preparation = of.preparation;
  const Exterior exterior = exterior_of(pack, kernel, of);
  switch (of.phase) {
    case Phase::begin:
      return begin_phase(pack, kernel, of) ? Progress::goes_on : Progress::failed;
    case Phase::members:
      return progress_of(collect_members(pack, operations, preparation, spent));
    case Phase::rest:
      return progress_of(advance_rest(pack, operations, preparation, spent));
    case Phase::tangents:
      return progress_of(advance_tangents(pack, kernel, operations, of, spent));
    case Phase::respond: {
      ZoneFrame frame = {pack, kernel, preparation.work, preparation.set, 0};
      return progress_of(advance_field_response(frame, of.own, operations, of.scratch, of.response, spent));
    }
    case Phase::evaluate:
    case Phase::iterate:
      return advance_iteration(exterior, of.own, operations, of.scratch, &of.acceleration, of.exterior,
                               spent);
    default:
      return advance_condensation(exterior, operations, of.scratch,
                                  of.phase == Phase::whole ? of.whole : of.own, spent);
  }
}

// What follows a phase of the preparation that has ended. Returns Progress::ended once the set is prepared.
Progress advance_preparation(const pal_pack& pack, const EliminationKernel& kernel, Progress progress,
                             Refinement& of) {
  ZoneSet& set = of.preparation.set;
  switch (of.phase) {
    case Phase::iterate:
      of.has_followed = true;
      of.phase = Phase::begin;
      return Progress::goes_on;
    case Phase::members:
      if (!begin_rest(of.preparation)) return Progress::failed;
      of.phase = Phase::rest;
      return Progress::goes_on;
    case Phase::rest:
      return begin_exterior(pack, kernel, of) ? Progress::goes_on : Progress::failed;
    case Phase::evaluate: {
      bool is_finite = true;
      of.mailbox.delivery.is_good =
          progress == Progress::ended && find_correction(pack, kernel, of, is_finite) && of.has_followed;
      if (!of.mailbox.delivery.is_good) {
        of.history.unbalanced = 0;
        rest_exterior(exterior_of(pack, kernel, of), of.exterior);
      }
      memcpy(set.exterior_at_rest, of.blocks, of.outline.exterior_size * sizeof *of.blocks);
      use_exterior(set.exterior_at_rest, set);
      begin_first_tangents(pack, kernel, of);
      return Progress::goes_on;
    }
    case Phase::tangents:
      use_tangents(of.mailbox.delivery.tangents, of.mailbox.delivery.made, set);
      of.phase = Phase::respond;
      begin_field_response(pack, set, of.mailbox.delivery.is_good, of.response);
      return Progress::goes_on;
    default:
      return Progress::ended;
  }
}

// Advances the phase. Returns Progress::ended once the iteration or the preparation has ended.
Progress advance_phase(const pal_pack& pack, const EliminationKernel& kernel, uint64_t operations,
                       Refinement& of, uint64_t& spent) {
  const Progress progress = advance_work(pack, kernel, operations, of, spent);
  if (progress == Progress::goes_on) return progress;
  const bool has_failed = progress == Progress::failed;
  switch (of.phase) {
    case Phase::whole:
      of.has_whole = !has_failed;
      of.phase = Phase::begin;
      return has_failed ? progress : Progress::goes_on;
    case Phase::condense:
      if (has_failed) return progress;
      take_condensation(pack, kernel, of);
      return Progress::goes_on;
    case Phase::renew:
      of.history.is_unstable = has_failed && stands_still(of);
      // Where the tangent is not positive definite, that at rest has to do.
      if (has_failed)
        return begin_condensation_at_rest(pack, kernel, of) ? Progress::goes_on : Progress::failed;
      take_condensation(pack, kernel, of);
      return Progress::goes_on;
    case Phase::begin:
      return progress;
    default:
      break;
  }
  if (is_preparing(of)) return advance_preparation(pack, kernel, progress, of);
  if (has_failed || of.phase == Phase::tangents) return progress;
  if (of.phase == Phase::iterate) {
    ++of.history.iterations_of_tangent;
    if (!needs_tangents(pack, of)) return progress;
    of.tangents = {};
    of.phase = Phase::tangents;
    return Progress::goes_on;
  }
  of.phase = Phase::begin;
  return Progress::goes_on;
}

Refined end_iteration(const pal_pack& pack, const EliminationKernel& kernel, Progress progress,
                      Refinement& of) {
  ZoneDelivery& delivery = of.mailbox.delivery;
  bool is_finite = true;
  const bool is_good = progress == Progress::ended && find_correction(pack, kernel, of, is_finite);
  of.history.failures = is_good ? 0 : of.history.failures + 1;
  if (!is_good) of.history.tangent_of_groups = 0;
  // Begins anew at rest, also as such numbers stay in no state.
  if (!is_finite || of.history.failures >= kMostFailures) of.has_own = false;
  if (is_good) {
    update_field_response(pack, of.mailbox.request.followed, of.exterior.next, of.exterior.displacement,
                          of.response);
    write_field(pack, of);
    delivery.tangent = of.history.tangent;
    if (of.mailbox.request.tangent != of.history.tangent)
      memcpy(delivery.exterior, of.blocks, of.outline.exterior_size * sizeof *of.blocks);
    of.history.largest_energy = std::max(of.history.largest_energy, of.exterior.energy);
    delivery.change = of.history.change = find_change(pack, of);
    ++of.history.iterations;
  }
  deliver(is_good, of);
  return is_good ? Refined::delivered : Refined::failed;
}

Refined end_preparation(const pal_pack& pack, Progress progress, Refinement& of) {
  const bool is_prepared = progress == Progress::ended;
  if (is_prepared) {
    write_field(pack, of);
  } else {
    refuse_set(of.preparation);
    of.outline.set = 0;
  }
  of.mailbox.delivery.tangent = of.history.tangent;
  of.mailbox.delivery.change = 0;
  of.has_followed = false;
  deliver(is_prepared && of.mailbox.delivery.is_good, of);
  return Refined::delivered;
}

}  // namespace

void carve_refinement(const pal_pack& pack, const ZoneRoom& room, Arena& arena, Refinement& refinement) {
  refinement = {};
  carve_mailbox(pack, room, arena, refinement.mailbox);
  carve_preparation(pack, room, arena, refinement.preparation);
  carve_organ_elements(pack, arena, refinement.elements);
  refinement.front_of = carve_front_of(pack, arena);
  const uint32_t kept = std::min(room.boundary, pack.organ.num_free);
  carve_condensation(pack, condensation_room(pack, 0), arena, refinement.whole);
  carve_condensation(pack, condensation_room(pack, kept), arena, refinement.own);
  carve_scratch(pack, kept, arena, refinement.scratch);
  carve_exterior(pack, arena, refinement.exterior);
  const size_t numbers = size_t{3} * pack.organ.num_nodes;
  carve_acceleration(numbers, arena, refinement.acceleration);
  carve_field_response(pack, room, arena, refinement.response);
  carve_outline(pack, arena, refinement.outline);
  refinement.rest = arena.take<double>(numbers);
  refinement.zone = arena.take<double>(numbers);
  refinement.blocks = arena.take<float>(room.exterior);
  for (double** vector : {&refinement.moved, &refinement.forces})
    *vector = arena.take<double>(symmetric_stride(3 * kept));
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
  uint64_t spent = 0;
  Progress progress = Progress::goes_on;
  if (!has_request(refinement)) {
    if (refinement.has_whole || refinement.is_broken) return Refined::nothing;
    if (refinement.phase == Phase::begin) begin_whole(pack, kernel, {}, 0, refinement);
    while (refinement.phase == Phase::whole && progress == Progress::goes_on && spent < operations)
      progress = advance_phase(pack, kernel, operations, refinement, spent);
    refinement.is_broken = progress == Progress::failed;
    return Refined::works;
  }
  while (progress == Progress::goes_on && spent < operations)
    progress = advance_phase(pack, kernel, operations, refinement, spent);
  if (progress == Progress::goes_on) return Refined::works;
  return is_preparing(refinement) ? end_preparation(pack, progress, refinement)
                                  : end_iteration(pack, kernel, progress, refinement);
}

}  // namespace palpate
