#include "runtime/src/response/zone_response.hpp"

#include <math.h>
#include <string.h>

#include <algorithm>

#include "runtime/src/linear/linear_blend.hpp"
#include "runtime/src/linear/linear_point.hpp"
#include "runtime/src/pack/contact_place.hpp"
#include "runtime/src/pack/pack_view.hpp"
#include "runtime/src/response/error_estimate.hpp"
#include "runtime/src/response/force_control.hpp"
#include "runtime/src/response/patch_rotation.hpp"
#include "runtime/src/response/response_at_point.hpp"

namespace palpate {
namespace {

// Relative rounding of lengths after a conversion of units and back.
constexpr double kRounding = 1e-9;

// Adds linear_dd of all contacts to the transfer of each contact and to the field. Call place_difference()
// first. `couplings`: [3 count][3 count] stiffness above the diagonal, filled in if forces are given. Returns
// the energy.
double add_joint_transfer(TissueState& tissue, const pal_contact* contacts, uint32_t count,
                          PointResponse* transfer, double* couplings, FieldState& field) {
  const pal_pack& pack = *tissue.pack;
  const ZoneSet& set = tissue.zone.active;
  LinearState& linear = tissue.linear;
  LinearFrame frame = {};
  frame.displacements = set.followed;
  frame.forces = tissue.forces;
  evaluate_linear(pack, linear, frame);
  const bool are_forces_given = std::any_of(
      contacts, contacts + count, [](const pal_contact& contact) { return contact.force_axes != 0; });
  for (uint32_t c = 0; c < count; ++c) {
    transfer[c].flags |= frame.flags;
    for (uint32_t i = 0; i < 3; ++i) transfer[c].force[i] += frame.forces[3 * c + i];
    for (uint32_t i = 0; i < 9; ++i) transfer[c].stiffness[i] += linear.active.own_stiffness[9 * c + i];
    for (uint32_t other = c + 1; other < count && are_forces_given; ++other) {
      double block[9];
      stiffness_between(pack, linear, c, other, block);
      for (uint32_t i = 0; i < 9; ++i) couplings[(3 * c + i / 3) * 3 * count + 3 * other + i % 3] = block[i];
    }
  }
  const uint32_t end = field.num_held + field.num_moved;
  const LinearBlend& blend = linear.active;
  memcpy(field.held + end, blend.held, blend.num_held * sizeof *field.held);
  for (uint32_t i = 0; i < 3 * blend.num_held; ++i)
    field.weights[3 * end + i] = static_cast<pal_real>(linear.nodal_force[i] * pack.metres);
  field.num_moved += blend.num_held;
  return frame.energy;
}

// Fills in the results of a zone's contacts, with error estimates. `is_turned`: some patch is rotated.
void fill_results(const TissueState& tissue, const pal_contact* contacts, uint32_t count, bool is_turned,
                  const ZoneAnswer& answer, const PointResponse* transfer, pal_contact_result* results) {
  const pal_pack& pack = *tissue.pack;
  const ZoneSet& set = tissue.zone.active;
  double largest = 0;
  for (uint32_t c = 0; c < count; ++c) {
    largest = std::max(largest, length(tissue.displacements + size_t{3} * c));
    if (is_turned)
      largest =
          std::max(largest, pack.mean_surface_edge * length(tissue.displacements + size_t{3} * (count + c)));
  }
  double load = 0;
  for (uint32_t c = 0; c < count && count > 1; ++c) {
    const double scale = pack.max_displacement * patch_stiffness_norm(pack, set.sites[c]);
    load = std::max(load, length(set.force + size_t{3} * c) / scale);
  }
  // The survey covers given displacements with all rings, without fixed nodes, inclusion or rotation.
  bool is_surveyed = tissue.zone.room.rings == pack.zone_rings && !tissue.zone.inclusion.is_present &&
                     set.num_fixed == 0 && !is_turned;
  bool are_at_sites = true;
  for (uint32_t c = 0; c < count; ++c) {
    const double* d = tissue.displacements + size_t{3} * c;
    pal_contact_result& result = results[c];
    result = {};
    result.model = PAL_MODEL_ZONE;
    result.flags = answer.flags | transfer[c].flags | tissue.input_flags[c];
    if (!set.sound) result.flags |= PAL_FLAG_ILL_CONDITIONED;
    if (length(d) > pack.max_displacement * (1 + kRounding)) result.flags |= PAL_FLAG_EXTRAPOLATED;
    const ContactPlace difference = difference_from(place_of(contacts[c]), set.sites[c]);
    if (difference.count > 0 && !tissue.has_joint_transfer && (count > 1 || set.num_fixed > 0))
      result.flags |= PAL_FLAG_NEAREST_SITE;
    are_at_sites = are_at_sites && difference.count == 0;
    is_surveyed = is_surveyed && contacts[c].force_axes == 0 && (count == 1 || difference.count == 0);
    double force[3];
    for (uint32_t i = 0; i < 3; ++i) force[i] = set.force[3 * c + i] + transfer[c].force[i];
    estimate_errors(pack, PAL_MODEL_ZONE, is_surveyed, d, length(force), result);
    worsen_estimate(pack, difference, is_surveyed, d, length(force), result);
    for (uint32_t i = 0; i < 3; ++i) {
      result.force[i] = force[i] * pack.newtons;
      result.displacement[i] = set.followed[3 * c + i] * pack.metres;
      for (uint32_t j = 0; j < 3; ++j)
        result.stiffness[i][j] = (set.stiffness[3 * c + i][3 * c + j] + transfer[c].stiffness[3 * i + j]) *
                                 (pack.newtons / pack.metres);
    }
  }
  if (count > 1) estimate_set_errors(tissue, is_surveyed, count, load, results);
  uint32_t flags = 0;
  for (uint32_t c = 0; c < count; ++c) flags |= results[c].flags;
  if (set.correction.is_refined && are_at_sites &&
      (flags & ~uint32_t{PAL_FLAG_EXTRAPOLATED | PAL_FLAG_OVERLAPPING}) == 0)
    estimate_refined_errors(tissue, count, results);
  // Without a successful iteration on the current tissue, the error of the correction is unknown.
  const bool is_stale = has_exterior(set) && set.correction.is_refined && !isfinite(set.correction.change);
  for (uint32_t c = 0; c < count && is_stale; ++c)
    results[c].displacement_error = results[c].force_error = kUnknownError;
  for (uint32_t c = 0; c < count && largest > 0; ++c) {
    for (double* error : {&results[c].displacement_error, &results[c].force_error})
      *error = std::min(kUnknownError, *error + answer.left / largest);
  }
}

// Sets ZoneCorrection::force_change in a frame that took a delivery, if no contact moved or turned.
// `followed`, `forces`: [num_axes] ZoneSet::followed and force before the frame.
void find_force_changes(const double* followed, const double* forces, ZoneSet& set) {
  if (memcmp(followed, set.followed, set.num_axes * sizeof *followed) != 0) return;
  for (uint32_t c = 0; c < set.num_contacts; ++c) {
    double change[3];
    for (uint32_t i = 0; i < 3; ++i) change[i] = set.force[3 * c + i] - forces[3 * c + i];
    set.correction.force_change[c] = length(change);
  }
}

// Flags the answer by the state of the last delivery, and requests the next iteration.
void exchange_with_lane(TissueState& tissue, ZoneAnswer& answer) {
  const ZoneSet& set = tissue.zone.active;
  const ZoneCorrection& correction = set.correction;
  if (has_exterior(set) && (!correction.is_refined || !isfinite(correction.change)))
    answer.flags |= PAL_FLAG_UNREFINED;
  if (correction.is_unstable) answer.flags |= PAL_FLAG_UNCONVERGED;
  if (!answer.went_back)
    request_iteration(*tissue.pack, used_fields(tissue.snapshots), tissue.zone, tissue.refinement.mailbox);
}

}  // namespace

bool find_ready_blend(LinearState& linear, const pal_contact* contacts, uint32_t count,
                      uint32_t fixed_version) {
  if (linear.active.ready && is_for(linear.active, contacts, count, fixed_version)) return true;
  if (!linear.next.ready || !is_for(linear.next, contacts, count, fixed_version)) return false;
  swap_blends(linear);
  return true;
}

bool needs_joint_transfer(const pal_contact* contacts, uint32_t count, uint32_t num_fixed) {
  if (count > kMostBetween || (count == 1 && num_fixed == 0)) return false;
  return std::any_of(contacts, contacts + count,
                     [](const pal_contact& contact) { return place_of(contact).count > 1; });
}

void answer_zone(TissueState& tissue, const pal_contact* contacts, uint32_t count, const double* turns,
                 pal_contact_result* results) {
  const pal_pack& pack = *tissue.pack;
  FieldState& field = tissue.snapshots.slots[tissue.snapshots.back];
  const ZoneSet& set = tissue.zone.active;
  const bool is_joint = needs_joint_transfer(contacts, count, set.num_fixed) &&
                        find_ready_blend(tissue.linear, contacts, count, set.fixed_version);
  tissue.has_joint_transfer = is_joint;
  if (is_joint) place_difference(contacts, set.sites, tissue.linear);
  for (uint32_t at = 0; at < 3 * count; ++at) {
    if (is_force_given(contacts[at / 3], at % 3))
      tissue.displacements[at] = tissue.zone.strained ? set.wanted[at] : 0.0;
  }
  const bool is_turned = take_turns(tissue, contacts, count, turns);
  double followed[kMostZoneAxes];
  double forces[kMostZoneAxes];
  memcpy(followed, set.followed, set.num_axes * sizeof *followed);
  memcpy(forces, set.force, set.num_axes * sizeof *forces);
  ZoneAnswer answer;
  ForceControl control;
  PointResponse transfer[pack::kMostZoneContacts];
  double couplings[9 * kMostBetween * kMostBetween] = {};
  const bool are_forces_given = std::any_of(
      contacts, contacts + count, [](const pal_contact& contact) { return contact.force_axes != 0; });
  // The steps of force control share the frame's iterations.
  for (uint32_t num_left = tissue.config->zone_iterations;;) {
    answer = solve_zone(pack, tissue.displacements, num_left, are_forces_given, tissue.zone);
    num_left -= answer.iterations;
    fill_zone_field(pack, tissue.zone, field);
    for (uint32_t c = 0; c < count; ++c) {
      transfer[c] = {};
      // Contacts in one zone share nodes: a transfer of one contact alone would move the patches of the
      // others. Fixed nodes would move too.
      if (!is_alone_in_zone(set, c) || set.num_fixed > 0) continue;
      transfer[c] = (is_joint ? transfer_beyond_linear : transfer_to_place)(
          pack, set.sites[c], place_of(contacts[c]), set.followed + size_t{3} * c, field);
      answer.energy += transfer[c].energy;
    }
    if (is_joint) answer.energy += add_joint_transfer(tissue, contacts, count, transfer, couplings, field);
    control =
        control_forces(pack, set, contacts, transfer, is_joint ? couplings : nullptr, tissue.displacements);
    if (control.has_ended || answer.went_back || num_left == 0) break;
  }
  for (uint32_t at = 0; at < 3 * count; ++at) {
    const bool keeps_goal = is_force_given(contacts[at / 3], at % 3) && !answer.went_back;
    set.wanted[at] = keeps_goal ? tissue.displacements[at] : set.followed[at];
  }
  if (tissue.has_correction) find_force_changes(followed, forces, tissue.zone.active);
  exchange_with_lane(tissue, answer);
  if (!answer.went_back) answer.flags |= control.flags;
  if (!control.has_ended) answer.flags |= PAL_FLAG_UNCONVERGED;
  tissue.stored_energy = answer.energy * pack.newtons * pack.metres;
  if (results == nullptr) return;
  fill_results(tissue, contacts, count, is_turned, answer, transfer, results);
}

}  // namespace palpate
