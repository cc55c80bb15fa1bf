#include "runtime/src/response/response.hpp"

#include <math.h>
#include <string.h>

#include "runtime/src/linear/linear_blend.hpp"
#include "runtime/src/linear/linear_point.hpp"
#include "runtime/src/pack/contact_place.hpp"
#include "runtime/src/pack/pack_view.hpp"
#include "runtime/src/polynomial/polynomial_dd.hpp"
#include "runtime/src/refining/state_transfer.hpp"
#include "runtime/src/response/error_estimate.hpp"
#include "runtime/src/response/patch_rotation.hpp"
#include "runtime/src/response/response_at_point.hpp"
#include "runtime/src/response/zone_response.hpp"

namespace palpate {
namespace {

// Displacements are shortened to this multiple of the scene's largest displacement, so that no float32
// overflows.
constexpr double kAbsurdDisplacement = 1e6;

// Converts a given displacement to model units and shortens an absurd displacement. Returns its flags.
uint32_t take_displacement(const pal_pack& pack, const double displacement[3], double out[3]) {
  const double limit = kAbsurdDisplacement * pack.max_displacement * pack.metres;
  double scale = 1.0;
  const double largest = largest_component(displacement);
  if (2.0 * largest > limit) {
    // Near the largest double |d| itself overflows.
    const double half[3] = {0.5 * displacement[0], 0.5 * displacement[1], 0.5 * displacement[2]};
    const double half_size = length(half);
    if (half_size > 0.5 * limit) scale = 0.5 * limit / half_size;
  }
  const double to_model = scale / pack.metres;
  for (int i = 0; i < 3; ++i) out[i] = to_model * displacement[i];
  return scale < 1.0 ? PAL_FLAG_CLAMPED | PAL_FLAG_EXTRAPOLATED : 0;
}

// Converts given forces to model units. Limits each force to kAbsurdDisplacement x max_displacement x the
// contact's own stiffness along the axis. Returns flags.
uint32_t take_forces(const TissueState& tissue, const pal_contact& contact, uint32_t index, double* out) {
  const double* stiffness = tissue.linear.active.own_stiffness + size_t{9} * index;
  uint32_t flags = 0;
  for (uint32_t axis = 0; axis < 3; ++axis) {
    if ((contact.force_axes >> axis & 1) == 0) continue;
    const double limit = kAbsurdDisplacement * tissue.pack->max_displacement * stiffness[4 * axis];
    const double force = contact.force[axis] / tissue.pack->newtons;
    out[axis] = force > limit ? limit : force < -limit ? -limit : force;
    if (fabs(force) > limit) flags = PAL_FLAG_CLAMPED | PAL_FLAG_EXTRAPOLATED;
  }
  return flags;
}

// Scales the whole answer back if the given forces cause absurd displacements.
void shorten_answer(const pal_pack& pack, uint32_t count, LinearState& linear, LinearFrame& frame) {
  const double limit = kAbsurdDisplacement * pack.max_displacement;
  double largest = 0;
  for (uint32_t i = 0; i < 3 * count; ++i) {
    const double size = fabs(frame.displacements[i]);
    if (size > largest || !isfinite(size)) largest = size;
    if (!isfinite(largest)) break;
  }
  if (largest <= limit) return;
  const double part = isfinite(largest) ? limit / largest : 0.0;
  const auto shorten = [&](double& number) { number = part > 0 ? part * number : 0.0; };
  for (uint32_t i = 0; i < 3 * count; ++i) {
    shorten(frame.displacements[i]);
    shorten(frame.forces[i]);
  }
  for (uint32_t i = 0; i < 3 * linear.active.num_held; ++i) shorten(linear.nodal_force[i]);
  for (int factor = 0; factor < 2; ++factor) shorten(frame.energy);  // energy: force times displacement
  frame.flags |= PAL_FLAG_CLAMPED | PAL_FLAG_EXTRAPOLATED;
}

// Evaluates linear_dd for the given displacements in `tissue` and the given forces of the contacts.
LinearFrame evaluate_given(TissueState& tissue, const pal_contact* contacts, uint32_t count) {
  LinearFrame frame = {};
  frame.given_forces = tissue.given_forces;
  frame.gravity_turn = tissue.gravity.is_turned ? tissue.gravity.now : nullptr;
  frame.turn_before = tissue.gravity.has_changed ? tissue.gravity.before : nullptr;
  frame.displacements = tissue.displacements;
  frame.forces = tissue.forces;
  place_contacts(contacts, tissue.linear);
  uint32_t any_axes = 0;
  for (uint32_t c = 0; c < count; ++c) {
    tissue.given_axes[c] = contacts[c].force_axes;
    any_axes |= contacts[c].force_axes;
    if (contacts[c].force_axes != 0)
      tissue.input_flags[c] |= take_forces(tissue, contacts[c], c, tissue.given_forces + size_t{3} * c);
  }
  if (any_axes != 0) frame.given_axes = tissue.given_axes;
  evaluate_linear(*tissue.pack, tissue.linear, frame);
  if (any_axes != 0) shorten_answer(*tissue.pack, count, tissue.linear, frame);
  return frame;
}

void answer_linear(TissueState& tissue, const pal_contact* contacts, uint32_t count,
                   pal_contact_result* results) {
  const pal_pack& pack = *tissue.pack;
  LinearState& linear = tissue.linear;
  const LinearFrame frame = evaluate_given(tissue, contacts, count);
  const double energy_unit = count == 0 ? 0.0 : pack.newtons * pack.metres;
  tissue.stored_energy = frame.energy * energy_unit;
  tissue.energy_brought = (frame.energy - frame.energy_before) * energy_unit;
  FieldState& field = tissue.snapshots.slots[tissue.snapshots.back];
  field.num_held = linear.active.num_held;
  memcpy(field.held, linear.active.held, field.num_held * sizeof *field.held);
  for (uint32_t i = 0; i < 3 * field.num_held; ++i) {
    field.weights[i] = static_cast<pal_real>(linear.nodal_force[i] * pack.metres);
  }
  if (results == nullptr) return;
  const bool surveyed =
      count == 1 && tissue.num_fixed == 0 && contacts[0].force_axes == 0 && !tissue.gravity.is_turned;
  for (uint32_t c = 0; c < count; ++c) {
    const double* d = tissue.displacements + size_t{3} * c;
    pal_contact_result& result = results[c];
    result = {};
    result.model = PAL_MODEL_LINEAR;
    result.flags = frame.flags | tissue.input_flags[c];
    if (tissue.config->model == PAL_MODEL_AUTO &&
        (pack.polynomial_sites != nullptr || pack.organ.nodes != nullptr))
      result.flags |= PAL_FLAG_LINEAR_FALLBACK;
    if (count > kMostBetween && !is_at_site(contacts[c])) result.flags |= PAL_FLAG_NEAREST_SITE;
    const bool sampled = acts_at_site(contacts[c], count) ? is_in_domain(pack, nearest_site(contacts[c]), d)
                                                          : is_sampled_about(pack, place_of(contacts[c]), d);
    if (!sampled) result.flags |= PAL_FLAG_EXTRAPOLATED;
    estimate_errors(pack, PAL_MODEL_LINEAR, surveyed, d, length(tissue.forces + size_t{3} * c), result);
    for (uint32_t i = 0; i < 3; ++i) {
      result.force[i] = tissue.forces[3 * c + i] * pack.newtons;
      result.displacement[i] = d[i] * pack.metres;
      for (uint32_t j = 0; j < 3; ++j) {
        result.stiffness[i][j] =
            linear.active.own_stiffness[9 * c + 3 * i + j] * (pack.newtons / pack.metres);
      }
    }
  }
}

// Fills in the result of one contact alone. Inputs: model units.
void give_result(const TissueState& tissue, pal_model model, uint32_t flags, const double force[3],
                 const double stiffness[9], pal_contact_result& result) {
  const pal_pack& pack = *tissue.pack;
  const double* d = tissue.displacements;
  result = {};
  result.model = model;
  result.flags = flags | tissue.input_flags[0];
  estimate_errors(pack, model, true, d, length(force), result);
  for (int i = 0; i < 3; ++i) {
    result.force[i] = force[i] * pack.newtons;
    result.displacement[i] = d[i] * pack.metres;
    for (int j = 0; j < 3; ++j) result.stiffness[i][j] = stiffness[3 * i + j] * (pack.newtons / pack.metres);
  }
}

void answer_polynomial(TissueState& tissue, const pal_contact& contact, pal_contact_result* results) {
  const pal_pack& pack = *tissue.pack;
  FieldState& field = tissue.snapshots.slots[tissue.snapshots.back];
  const ContactPlace place = place_of(contact);
  field.num_corners = 0;
  const PointResponse blend = blend_polynomials(pack, place, tissue.displacements, field);
  tissue.stored_energy = blend.energy * pack.newtons * pack.metres;
  if (results == nullptr) return;
  bool all_sampled = true;
  for (uint32_t i = 0; i < place.count; ++i)
    all_sampled = all_sampled && was_sampled(pack, place.corners[i].site);
  pal_contact_result& result = results[0];
  give_result(tissue, all_sampled ? PAL_MODEL_POLYNOMIAL : PAL_MODEL_AFFINE, blend.flags, blend.force,
              blend.stiffness, result);
  if (!all_sampled) worsen_estimate(pack, place, true, tissue.displacements, length(blend.force), result);
  if (tissue.config->model == PAL_MODEL_AFFINE) result.model = PAL_MODEL_AFFINE;
}

void answer_linear_point(TissueState& tissue, const pal_contact& contact, pal_contact_result* results) {
  const pal_pack& pack = *tissue.pack;
  const ContactPlace place = place_of(contact);
  LinearPointAnswer answer;
  FieldState& field = tissue.snapshots.slots[tissue.snapshots.back];
  field.num_held =
      evaluate_linear_point(pack, place, tissue.displacements, answer, field.held, field.weights);
  tissue.stored_energy = answer.energy * pack.newtons * pack.metres;
  if (results == nullptr) return;
  const uint32_t flags =
      is_sampled_about(pack, place, tissue.displacements) ? 0 : uint32_t{PAL_FLAG_EXTRAPOLATED};
  give_result(tissue, PAL_MODEL_LINEAR, flags, answer.force, answer.stiffness, results[0]);
}

// Whether the zone prepared for these contacts cannot answer, and the config lets linear_dd answer instead.
bool is_zone_refused(const TissueState& tissue, const pal_contact* contacts, uint32_t count) {
  const ZoneSet& set = tissue.zone.active;
  return tissue.config->model == PAL_MODEL_AUTO && set.ready && !set.sound &&
         is_zone_for(set, contacts, count, tissue.fixed_version);
}

bool zone_answers(const TissueState& tissue, uint32_t num_contacts) {
  return (tissue.config->model == PAL_MODEL_AUTO || tissue.config->model == PAL_MODEL_ZONE) &&
         tissue.pack->organ.nodes != nullptr && !tissue.gravity.is_turned &&
         tissue.num_fixed <= tissue.zone.room.fixed && num_contacts >= 1 &&
         num_contacts <= tissue.zone.room.contacts;
}

// Inclusions and rotating patches need the zone, if a zone can answer.
bool polynomial_answers(const TissueState& tissue, uint32_t num_contacts, bool forces_given) {
  const bool is_for_zone =
      (tissue.zone.inclusion.is_present || has_turns(tissue)) && zone_answers(tissue, num_contacts);
  return !forces_given && !tissue.gravity.is_turned && !is_for_zone &&
         (tissue.config->model == PAL_MODEL_AUTO || tissue.config->model == PAL_MODEL_POLYNOMIAL ||
          tissue.config->model == PAL_MODEL_AFFINE) &&
         tissue.pack->polynomial_sites != nullptr && num_contacts == 1 && tissue.num_fixed == 0;
}

// Whether the zone's transfer to these contacts' places needs a blend that is not ready.
bool lacks_blend(TissueState& tissue, const pal_contact* contacts, uint32_t count, uint32_t num_fixed,
                 uint32_t fixed_version) {
  return needs_joint_transfer(contacts, count, num_fixed) &&
         !find_ready_blend(tissue.linear, contacts, count, fixed_version);
}

bool has_zone_for(const TissueState& tissue, const pal_contact* contacts, uint32_t count,
                  uint32_t fixed_version) {
  const ZoneSet& set = tissue.zone.active;
  return set.ready && is_zone_for(set, contacts, count, fixed_version);
}

void begin_blend(TissueState& tissue, const pal_contact* contacts, uint32_t count) {
  begin_linear(contacts, count, tissue.fixed, tissue.num_fixed, tissue.fixed_version, tissue.linear);
}

// Requests a zone for these contacts from the refining lane, unless the lane is busy. Returns whether it did.
bool request_zone(TissueState& tissue, const pal_contact* contacts, uint32_t count) {
  ZoneMailbox& mailbox = tissue.refinement.mailbox;
  if (!is_in(mailbox, MailboxState::idle)) return false;
  const FixedNodes fixed = {tissue.num_fixed, tissue.fixed, tissue.fixed_version};
  name_contacts(*tissue.pack, contacts, count, fixed, tissue.zone.active, tissue.refinement.preparation);
  request_set(used_fields(tissue.snapshots), tissue.zone, mailbox);
  return true;
}

}  // namespace

bool can_answer(const TissueState& tissue, uint32_t num_contacts, bool forces_given) {
  const bool may_be_linear =
      tissue.config->model == PAL_MODEL_AUTO || tissue.config->model == PAL_MODEL_LINEAR;
  return num_contacts == 0 || polynomial_answers(tissue, num_contacts, forces_given) ||
         zone_answers(tissue, num_contacts) || (may_be_linear && tissue.pack->field_compliance != nullptr);
}

ResponseKind select_response(const TissueState& tissue, const pal_contact* contacts, uint32_t count,
                             bool forces_given) {
  // The tissue without contacts is at rest, unless fixed nodes hold it under turned gravity.
  if (count == 0)
    return tissue.gravity.is_turned && tissue.num_fixed > 0 ? ResponseKind::linear : ResponseKind::nothing;
  if (polynomial_answers(tissue, count, forces_given)) return ResponseKind::polynomial;
  if (zone_answers(tissue, count) && !is_zone_refused(tissue, contacts, count)) return ResponseKind::zone;
  return select_linear(tissue, contacts, count, forces_given);
}

ResponseKind select_linear(const TissueState& tissue, const pal_contact* contacts, uint32_t count,
                           bool forces_given) {
  const bool is_alone = count == 1 && tissue.num_fixed == 0 && !forces_given && !tissue.gravity.is_turned;
  return is_alone && !is_at_site(contacts[0]) ? ResponseKind::linear_point : ResponseKind::linear;
}

void take_from_lane(TissueState& tissue) {
  tissue.has_new_zone = tissue.has_correction = tissue.is_delivered = false;
  if (tissue.zone.room.contacts == 0) return;
  Refinement& lane = tissue.refinement;
  tissue.has_new_zone = take_prepared(lane.mailbox);
  if (tissue.has_new_zone) exchange_sets(*tissue.pack, lane.mailbox, lane.preparation, tissue.zone);
  const Taken taken = take_delivery(*tissue.pack, lane.mailbox, tissue.zone);
  tissue.has_correction = taken == Taken::taken;
  tissue.is_delivered = tissue.has_new_zone || taken != Taken::none;
}

bool prepare(TissueState& tissue, ResponseKind kind, const pal_contact* contacts, uint32_t count) {
  if (is_ready(tissue, kind, contacts, count, tissue.fixed_version)) return true;
  const bool is_zone = kind == ResponseKind::zone;
  if (!is_zone || lacks_blend(tissue, contacts, count, tissue.num_fixed, tissue.fixed_version)) {
    begin_blend(tissue, contacts, count);
    advance_linear(*tissue.pack, UINT64_MAX, tissue.linear);
    tissue.linear_begun = false;  // this blend replaced the blend in preparation
  }
  if (!is_zone || has_zone_for(tissue, contacts, count, tissue.fixed_version)) return true;
  request_zone(tissue, contacts, count);
  return false;
}

bool is_ready(TissueState& tissue, ResponseKind kind, const pal_contact* contacts, uint32_t count,
              uint32_t fixed_version) {
  if (kind == ResponseKind::linear) return find_ready_blend(tissue.linear, contacts, count, fixed_version);
  return kind != ResponseKind::zone ||
         (has_zone_for(tissue, contacts, count, fixed_version) &&
          !lacks_blend(tissue, contacts, count, tissue.zone.active.num_fixed, fixed_version));
}

bool prepare_within(TissueState& tissue, ResponseKind kind, const pal_contact* contacts, uint32_t count,
                    bool& began, bool& finished) {
  began = false;
  finished = tissue.has_new_zone;
  if (is_ready(tissue, kind, contacts, count, tissue.fixed_version)) return true;
  const bool is_zone = kind == ResponseKind::zone;
  if (!tissue.linear_begun &&
      (!is_zone || lacks_blend(tissue, contacts, count, tissue.num_fixed, tissue.fixed_version))) {
    begin_blend(tissue, contacts, count);
    tissue.linear_begun = true;
    began = !is_zone;
  }
  if (is_zone && !has_zone_for(tissue, contacts, count, tissue.fixed_version))
    began = request_zone(tissue, contacts, count);
  if (tissue.linear_begun && advance_linear(*tissue.pack, tissue.operations, tissue.linear)) {
    tissue.linear_begun = false;
    finished = true;
  }
  return finished && is_ready(tissue, kind, contacts, count, tissue.fixed_version);
}

void answer_contacts(TissueState& tissue, ResponseKind kind, const pal_contact* contacts, uint32_t count,
                     const double* turns, pal_contact_result* results, bool awaits_zone) {
  for (uint32_t c = 0; c < count; ++c) {
    double given[3];
    for (uint32_t axis = 0; axis < 3; ++axis)
      given[axis] = (contacts[c].force_axes >> axis & 1) != 0 ? 0.0 : contacts[c].displacement[axis];
    tissue.input_flags[c] = take_displacement(*tissue.pack, given, tissue.displacements + size_t{3} * c);
  }
  tissue.energy_brought = 0;
  tissue.answered = kind;
  if (kind != ResponseKind::zone && !awaits_zone) rest_zone(*tissue.pack, tissue.zone);
  FieldState& field = tissue.snapshots.slots[tissue.snapshots.back];
  field.model = model_of(kind);
  field.refined_field = field.response = kNoField;
  field.gravity_turned = tissue.gravity.is_turned;
  for (int i = 0; i < 3; ++i)
    field.gravity_turn[i] = static_cast<pal_real>(tissue.gravity.now[i] * tissue.pack->metres);
  switch (kind) {
    case ResponseKind::nothing:
      tissue.stored_energy = 0;
      break;
    case ResponseKind::polynomial:
      answer_polynomial(tissue, contacts[0], results);
      break;
    case ResponseKind::linear_point:
      answer_linear_point(tissue, contacts[0], results);
      break;
    case ResponseKind::zone:
      answer_zone(tissue, contacts, count, turns, results);
      break;
    case ResponseKind::linear:
      answer_linear(tissue, contacts, count, results);
      break;
  }
  publish(tissue.snapshots);
}

double answer_alone(const TissueState& tissue, const pal_contact& contact, pal_contact_result& result) {
  const pal_pack& pack = *tissue.pack;
  double displacement[3];
  LinearPointAnswer answer;
  const uint32_t clamped = take_displacement(pack, contact.displacement, displacement);
  answer = {};
  if (pack.site_forces != nullptr)
    evaluate_linear_point(pack, place_of(contact), displacement, answer, nullptr, nullptr);
  result = {};
  result.model = PAL_MODEL_LINEAR;
  result.flags = PAL_FLAG_PREPARING | PAL_FLAG_UNREFINED | clamped;
  result.displacement_error = result.force_error = kUnknownError;
  for (int i = 0; i < 3; ++i) {
    result.force[i] = answer.force[i] * pack.newtons;
    result.displacement[i] = displacement[i] * pack.metres;
    for (int j = 0; j < 3; ++j)
      result.stiffness[i][j] = answer.stiffness[3 * i + j] * (pack.newtons / pack.metres);
  }
  return answer.energy * pack.newtons * pack.metres;
}

void add_coupling(const TissueState& tissue, ResponseKind answered, const pal_contact_result* results,
                  uint32_t row, uint32_t column, double* sum) {
  const pal_pack& pack = *tissue.pack;
  const double scale = pack.newtons / pack.metres;
  double block[9] = {};
  if (row != column && answered == ResponseKind::linear)
    stiffness_between(pack, tissue.linear, row, column, block);
  if (row != column && answered == ResponseKind::zone) {
    for (uint32_t i = 0; i < 9; ++i)
      block[i] = tissue.zone.active.stiffness[3 * row + i / 3][3 * column + i % 3];
    if (tissue.has_joint_transfer) {
      double transferred[9];
      stiffness_between(pack, tissue.linear, row, column, transferred);
      for (uint32_t i = 0; i < 9; ++i) block[i] += transferred[i];
    }
  }
  for (uint32_t i = 0; i < 9; ++i)
    sum[i] += row == column ? results[row].stiffness[i / 3][i % 3] : scale * block[i];
}

}  // namespace palpate
