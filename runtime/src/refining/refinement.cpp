#include "runtime/src/refining/refinement.hpp"

#include <math.h>
#include <string.h>

#include <algorithm>

#include "runtime/src/pack/pack_view.hpp"
#include "runtime/src/refining/delivery.hpp"
#include "runtime/src/refining/state_transfer.hpp"
#include "runtime/src/refining/zone_members.hpp"
#include "runtime/src/zone/zone_inclusion.hpp"
#include "runtime/src/zone/zone_motion.hpp"

namespace palpate {
namespace {

using Phase = Refinement::Phase;

// Returns the elements that the phase condenses or evaluates, and the displacement where K is their tangent.
Exterior exterior_of(const pal_pack& pack, const EliminationKernel& kernel, const Refinement& lane) {
  const uint8_t* zone_of_simd_lane = lane.phase == Phase::whole ? nullptr : lane.layout.zone_of_simd_lane;
  const double* displacement = lane.phase == Phase::renew ? lane.exterior.displacement : lane.rest;
  return {pack, kernel, lane.front_of, lane.elements, zone_of_simd_lane, displacement};
}

bool is_preparing(const Refinement& lane) {
  return lane.mailbox.request.kind == ZoneRequest::Kind::prepare;
}

// Begins to condense the exterior with the tangent and the pressures at rest.
void begin_condensation_at_rest(const pal_pack& pack, const EliminationKernel& kernel, Refinement& lane) {
  lane.phase = Phase::condense;
  lane.is_condensed = false;
  const ZoneBatches& all = lane.elements.all;
  for (uint32_t p = all.first_patch; p < all.first_patch + all.num_patches; ++p)
    all.patches[p].followed = all.patches[p].at_rest;
  begin_condensation(exterior_of(pack, kernel, lane), &lane.whole, lane.scratch, lane.condensation);
}

// Puts the exterior at rest and begins to condense the exterior there.
void begin_at_rest(const pal_pack& pack, const EliminationKernel& kernel, Refinement& lane) {
  lane.phase = Phase::condense;
  lane.history.failures = 0;
  lane.history.is_unstable = false;
  lane.history.largest_energy = lane.history.unbalanced = lane.history.change = 0;
  rest_exterior(exterior_of(pack, kernel, lane), lane.exterior);
  std::fill_n(lane.response.followed, kMostZoneAxes, 0.0);
  restart_acceleration(lane.acceleration);
  begin_condensation_at_rest(pack, kernel, lane);
}

// Places the prepared set at the exterior's displacement or at rest, and begins to condense the exterior.
void begin_exterior(const pal_pack& pack, const EliminationKernel& kernel, Refinement& lane) {
  const size_t bytes = size_t{3} * pack.organ.num_nodes * sizeof *lane.zone;
  memcpy(lane.zone, lane.starts_strained ? lane.exterior.displacement : lane.rest, bytes);
  if (!place_set(pack, lane.zone, lane.preparation)) lane.starts_strained = false;
  describe_zones(pack, lane.preparation, lane.mailbox.request.next_set, lane.elements, lane.condensation,
                 lane.layout);
  begin_at_rest(pack, kernel, lane);
  if (lane.starts_strained) memcpy(lane.exterior.displacement, lane.zone, bytes);
}

// Whether the contacts are where the last iteration had them.
bool stands_still(const Refinement& lane) {
  const ZoneRequest& request = lane.mailbox.request;
  return memcmp(lane.history.followed, request.followed, request.num_axes * sizeof *request.followed) == 0;
}

// Whether a tangent at the current displacement would speed up the iterations: the cases of refinement.hpp.
bool is_tangent_old(const pal_pack& pack, const Refinement& lane) {
  constexpr uint32_t kIterations = 2;
  constexpr double kConverged = 1e-6;   // of the scene's largest displacement
  constexpr double kUnbalanced = 0.01;  // of the exterior's energy
  if (lane.history.iterations_of_schur < kIterations || lane.history.failures > 0) return false;
  const bool is_near = lane.history.unbalanced <= kUnbalanced * lane.exterior.energy;
  return stands_still(lane) ? is_near && lane.history.change > kConverged * pack.max_displacement : !is_near;
}

// Copies the displacements of the set's nodes, in the order of ZoneSet::nodes, to Refinement::zone.
void write_zone(Refinement& lane, const double* displacement) {
  const ZoneMembers& members = lane.layout.members;
  for (uint32_t i = 0; i < members.num_nodes; ++i)
    memcpy(lane.zone + size_t{3} * members.nodes[i], displacement + size_t{3} * i, 3 * sizeof *lane.zone);
}

void begin_exterior_iteration(const pal_pack& pack, const EliminationKernel& kernel, Refinement& lane) {
  const ZoneRequest& request = lane.mailbox.request;
  // The acceleration mixes only iterates for the same contact axes.
  if (!stands_still(lane)) {
    restart_acceleration(lane.acceleration);
    lane.history.is_unstable = false;
  }
  memcpy(lane.history.followed, request.followed, request.num_axes * sizeof *request.followed);
  memcpy(lane.zone, lane.rest, size_t{3} * pack.organ.num_nodes * sizeof *lane.zone);
  write_zone(lane, request.displacement);
  begin_iteration(exterior_of(pack, kernel, lane), lane.condensation, lane.zone, lane.exterior);
}

void deliver(bool is_good, Refinement& lane) {
  lane.mailbox.delivery.is_good = is_good;
  lane.mailbox.delivery.is_unstable = lane.history.is_unstable;
  lane.phase = Phase::begin;
  set_state(lane.mailbox, MailboxState::delivered);
}

// Puts the organ at rest with the stiffness of this inclusion, and begins to factor the organ there.
void begin_whole(const pal_pack& pack, const EliminationKernel& kernel, const Inclusion& inclusion,
                 uint32_t version, Refinement& lane) {
  set_organ_stiffness(pack, inclusion, lane.elements);
  lane.inclusion_version = version;
  lane.has_whole = lane.is_condensed = false;
  std::fill_n(lane.whole.roles, pack.organ.num_nodes, NodeRole::eliminated);
  lane.phase = Phase::whole;
  const Exterior organ = exterior_of(pack, kernel, lane);
  rest_exterior(organ, lane.exterior);
  begin_condensation(organ, nullptr, lane.scratch, lane.whole);
}

// Places the held nodes of the prepared set by its contacts, and begins the first tangents of its groups.
void begin_first_tangents(const pal_pack& pack, const EliminationKernel& kernel, Refinement& lane) {
  ZonePreparation& preparation = lane.preparation;
  ZoneFrame frame = {pack, kernel, preparation.work, preparation.set, 0};
  for (uint32_t g = 0; g < frame.set.num_groups; ++g) place_held(frame, frame.set.groups[g]);
  write_zone(lane, frame.set.displacement);
  lane.tangents = {};
  lane.phase = Phase::tangents;
}

// Whether the groups need new tangents: the frames or the last tangents have another S, or a node has moved.
bool needs_tangents(const pal_pack& pack, const Refinement& lane) {
  const bool has_new_schur = lane.mailbox.request.tangent != lane.history.schur ||
                             lane.history.schur_of_groups != lane.history.schur;
  return has_new_schur || find_largest_change(pack, lane) > kSamePlace * pack.max_displacement;
}

bool advance_tangents(const pal_pack& pack, const EliminationKernel& kernel, uint64_t operations,
                      Refinement& lane, uint64_t& spent) {
  ZoneDelivery& delivery = lane.mailbox.delivery;
  const ZoneMaster* masters =
      is_preparing(lane) ? lane.preparation.set.masters : lane.mailbox.request.masters;
  const GroupTangentSource source = {pack,        kernel,    lane.elements, lane.layout,
                                     lane.blocks, lane.zone, masters};
  if (!advance_group_tangents(source, operations, delivery.tangents, delivery.made, lane.tangents, spent))
    return false;
  delivery.has_tangents = true;
  lane.history.schur_of_groups = lane.history.schur;
  return true;
}

// Begins the phase that the request needs next. Returns false if the request cannot be served.
bool begin_phase(const pal_pack& pack, const EliminationKernel& kernel, Refinement& lane) {
  const ZoneRequest& request = lane.mailbox.request;
  if (lane.is_broken) return false;
  if (!lane.has_whole || lane.inclusion_version != request.inclusion_version) {
    begin_whole(pack, kernel, request.inclusion, request.inclusion_version, lane);
    return true;
  }
  const bool is_same_set = lane.layout.set_number == request.set;
  if (is_preparing(lane) &&
      !(request.is_strained && lane.is_condensed && is_same_set && !lane.starts_strained)) {
    begin_members(pack, lane.preparation);
    lane.phase = Phase::members;
    return true;
  }
  if (!is_same_set) return false;
  if (!lane.is_condensed) {
    begin_at_rest(pack, kernel, lane);
  } else if (!is_preparing(lane) && is_tangent_old(pack, lane)) {
    lane.phase = Phase::renew;
    begin_condensation(exterior_of(pack, kernel, lane), nullptr, lane.scratch, lane.condensation);
  } else {
    lane.phase = Phase::iterate;
    lane.mailbox.delivery.has_tangents = false;
    begin_exterior_iteration(pack, kernel, lane);
  }
  return true;
}

// Takes the finished condensation into use, and begins to evaluate the exterior with it.
void take_condensation(const pal_pack& pack, const EliminationKernel& kernel, Refinement& lane) {
  lane.is_condensed = true;
  ++lane.history.schur;
  lane.history.iterations_of_schur = 0;
  copy_blocks(lane);
  restart_acceleration(lane.acceleration);
  lane.phase = Phase::evaluate;
  begin_evaluation(exterior_of(pack, kernel, lane), lane.exterior);
}

Progress advance_work(const pal_pack& pack, const EliminationKernel& kernel, uint64_t operations,
                      Refinement& lane, uint64_t& spent) {
  const auto progress_of = [](bool has_ended) { return has_ended ? Progress::ended : Progress::goes_on; };
  ZonePreparation& preparation = lane.preparation;
  const Exterior exterior = exterior_of(pack, kernel, lane);
  switch (lane.phase) {
    case Phase::begin:
      return begin_phase(pack, kernel, lane) ? Progress::goes_on : Progress::failed;
    case Phase::members:
      return collect_members(pack, operations, preparation, spent);
    case Phase::tangents:
      return progress_of(advance_tangents(pack, kernel, operations, lane, spent));
    case Phase::respond: {
      ZoneFrame frame = {pack, kernel, preparation.work, preparation.set, 0};
      return progress_of(
          advance_field_response(frame, lane.condensation, operations, lane.scratch, lane.response, spent));
    }
    case Phase::evaluate:
    case Phase::iterate:
      return advance_iteration(exterior, lane.condensation, operations, lane.scratch, lane.acceleration,
                               lane.exterior, spent);
    default:
      return advance_condensation(exterior, operations, lane.scratch,
                                  lane.phase == Phase::whole ? lane.whole : lane.condensation, spent);
  }
}

// Begins the phase that follows in a preparation. Returns Progress::ended once the set is prepared.
Progress advance_preparation(const pal_pack& pack, const EliminationKernel& kernel, Progress progress,
                             Refinement& lane) {
  ZoneSet& set = lane.preparation.set;
  switch (lane.phase) {
    case Phase::iterate:
      lane.starts_strained = true;
      lane.phase = Phase::begin;
      return Progress::goes_on;
    case Phase::members:
      if (progress == Progress::failed) return progress;
      begin_exterior(pack, kernel, lane);
      return Progress::goes_on;
    case Phase::evaluate: {
      bool is_finite = true;
      lane.mailbox.delivery.is_good = progress == Progress::ended &&
                                      find_correction(pack, kernel, lane, is_finite) && lane.starts_strained;
      if (!lane.mailbox.delivery.is_good) {
        lane.history.unbalanced = 0;
        rest_exterior(exterior_of(pack, kernel, lane), lane.exterior);
      }
      memcpy(set.exterior_at_rest, lane.blocks, lane.layout.stiffness_size * sizeof *lane.blocks);
      use_exterior(set.exterior_at_rest, set);
      begin_first_tangents(pack, kernel, lane);
      return Progress::goes_on;
    }
    case Phase::tangents:
      use_tangents(lane.mailbox.delivery.tangents, lane.mailbox.delivery.made, set);
      lane.phase = Phase::respond;
      begin_field_response(pack, set, lane.mailbox.delivery.is_good, lane.response);
      return Progress::goes_on;
    default:
      return Progress::ended;
  }
}

// Advances the phase and, at its end, begins the next phase. Returns Progress::ended at the request's end.
Progress advance_phase(const pal_pack& pack, const EliminationKernel& kernel, uint64_t operations,
                       Refinement& lane, uint64_t& spent) {
  const Progress progress = advance_work(pack, kernel, operations, lane, spent);
  if (progress == Progress::goes_on) return progress;
  const bool has_failed = progress == Progress::failed;
  switch (lane.phase) {
    case Phase::whole:
      lane.has_whole = !has_failed;
      lane.phase = Phase::begin;
      return has_failed ? progress : Progress::goes_on;
    case Phase::condense:
      if (has_failed) return progress;
      take_condensation(pack, kernel, lane);
      return Progress::goes_on;
    case Phase::renew:
      lane.history.is_unstable = has_failed && stands_still(lane);
      // Without a positive definite tangent there, the iterations go on with the tangent at rest.
      if (has_failed)
        begin_condensation_at_rest(pack, kernel, lane);
      else
        take_condensation(pack, kernel, lane);
      return Progress::goes_on;
    case Phase::begin:
      return progress;
    default:
      break;
  }
  if (is_preparing(lane)) return advance_preparation(pack, kernel, progress, lane);
  if (has_failed || lane.phase == Phase::tangents) return progress;
  if (lane.phase == Phase::iterate) {
    ++lane.history.iterations_of_schur;
    if (!needs_tangents(pack, lane)) return progress;
    lane.tangents = {};
    lane.phase = Phase::tangents;
    return Progress::goes_on;
  }
  lane.phase = Phase::begin;
  return Progress::goes_on;
}

Refined end_iteration(const pal_pack& pack, const EliminationKernel& kernel, Progress progress,
                      Refinement& lane) {
  ZoneDelivery& delivery = lane.mailbox.delivery;
  bool is_finite = true;
  const bool is_good = progress == Progress::ended && find_correction(pack, kernel, lane, is_finite);
  lane.history.failures = is_good ? 0 : lane.history.failures + 1;
  if (!is_good) lane.history.schur_of_groups = 0;
  // The next request begins at rest: after kMostFailures failures, and to drop numbers that are not finite.
  if (!is_finite || lane.history.failures >= kMostFailures) lane.is_condensed = false;
  if (is_good) {
    update_field_response(pack, lane.mailbox.request.followed, lane.exterior.next, lane.exterior.displacement,
                          lane.response);
    write_field(pack, lane);
    delivery.tangent = lane.history.schur;
    if (lane.mailbox.request.tangent != lane.history.schur)
      memcpy(delivery.exterior, lane.blocks, lane.layout.stiffness_size * sizeof *lane.blocks);
    lane.history.largest_energy = std::max(lane.history.largest_energy, lane.exterior.energy);
    delivery.change = lane.history.change = find_largest_change(pack, lane);
    ++lane.history.iterations;
  }
  deliver(is_good, lane);
  return is_good ? Refined::delivered : Refined::failed;
}

Refined end_preparation(const pal_pack& pack, Progress progress, Refinement& lane) {
  const bool is_prepared = progress == Progress::ended;
  if (is_prepared) {
    write_field(pack, lane);
  } else {
    refuse_set(lane.preparation);
    lane.layout.set_number = 0;
  }
  lane.mailbox.delivery.tangent = lane.history.schur;
  lane.mailbox.delivery.change = 0;
  lane.starts_strained = false;
  deliver(is_prepared && lane.mailbox.delivery.is_good, lane);
  return Refined::delivered;
}

}  // namespace

void carve_refinement(const pal_pack& pack, const ZoneRoom& room, Arena& arena, Refinement& lane) {
  lane = {};
  carve_mailbox(pack, room, arena, lane.mailbox);
  carve_preparation(pack, room, arena, lane.preparation);
  carve_organ_elements(pack, arena, lane.elements);
  lane.front_of = carve_front_of(pack, arena);
  const uint32_t kept = std::min(room.boundary, pack.organ.num_free);
  carve_condensation(pack, condensation_room(pack, 0), arena, lane.whole);
  carve_condensation(pack, condensation_room(pack, kept), arena, lane.condensation);
  carve_scratch(pack, kept, arena, lane.scratch);
  carve_exterior(pack, arena, lane.exterior);
  const size_t numbers = size_t{3} * pack.organ.num_nodes;
  carve_acceleration(numbers, arena, lane.acceleration);
  carve_field_response(pack, room, arena, lane.response);
  carve_layout(pack, arena, lane.layout);
  lane.rest = arena.take<double>(numbers);
  lane.zone = arena.take<double>(numbers);
  lane.blocks = arena.take<float>(room.exterior);
  for (double** vector : {&lane.moved, &lane.linear_forces})
    *vector = arena.take<double>(symmetric_stride(3 * kept));
}

void fill_refinement(const pal_pack& pack, Refinement& lane) {
  lane.is_broken = !fill_organ_elements(pack, lane.elements) || !fill_front_of(pack, lane.front_of);
  clear_scratch(pack, lane.scratch);
  for (uint32_t node = 0; node < pack.organ.num_nodes; ++node)
    memcpy(lane.rest + size_t{3} * node, pack.organ.nodes[node].displacement, 3 * sizeof *lane.rest);
}

bool has_request(const Refinement& lane) {
  return is_in(lane.mailbox, MailboxState::requested);
}

Refined refine(const pal_pack& pack, const EliminationKernel& kernel, uint64_t operations, Refinement& lane) {
  uint64_t spent = 0;
  Progress progress = Progress::goes_on;
  if (!has_request(lane)) {
    if (lane.has_whole || lane.is_broken) return Refined::nothing;
    if (lane.phase == Phase::begin) begin_whole(pack, kernel, {}, 0, lane);
    while (lane.phase == Phase::whole && progress == Progress::goes_on && spent < operations)
      progress = advance_phase(pack, kernel, operations, lane, spent);
    lane.is_broken = progress == Progress::failed;
    return Refined::works;
  }
  while (progress == Progress::goes_on && spent < operations)
    progress = advance_phase(pack, kernel, operations, lane, spent);
  if (progress == Progress::goes_on) return Refined::works;
  return is_preparing(lane) ? end_preparation(pack, progress, lane)
                            : end_iteration(pack, kernel, progress, lane);
}

}  // namespace palpate
