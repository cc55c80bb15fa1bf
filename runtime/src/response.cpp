#include "runtime/src/response.hpp"

#include <math.h>
#include <string.h>

#include <algorithm>

#include "runtime/src/contact_place.hpp"
#include "runtime/src/force_control.hpp"
#include "runtime/src/linear_blend.hpp"
#include "runtime/src/linear_point.hpp"
#include "runtime/src/pack_view.hpp"
#include "runtime/src/patch_turns.hpp"
#include "runtime/src/place_answer.hpp"
#include "runtime/src/polynomial_dd.hpp"
#include "runtime/src/session_state.hpp"
#include "runtime/src/zone_exterior.hpp"
#include "runtime/src/zone_making.hpp"

namespace palpate {
namespace {

// In units of the scene's largest displacement: beyond it a float32 would overflow before anyone is told.
constexpr double kAbsurdDisplacement = 1e6;
// Of lengths that units were multiplied into and out of.
constexpr double kRounding = 1e-9;
// The estimate where nothing was measured: all of it may be wrong.
constexpr double kUnknownError = 1.0;

double largest_component(const double d[3]) {
  const double x = fabs(d[0]);
  const double y = fabs(d[1]);
  const double z = fabs(d[2]);
  const double larger = x > y ? x : y;
  return larger > z ? larger : z;
}

// |d|, without overflow on the way.
double length(const double d[3]) {
  constexpr double kLeast = 1e-140;  // their squares are exact enough
  constexpr double kMost = 1e140;
  const double largest = largest_component(d);
  if (largest > kLeast && largest < kMost) return sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
  if (largest == 0) return 0;
  const double x = d[0] / largest;
  const double y = d[1] / largest;
  const double z = d[2] / largest;
  return largest * sqrt(x * x + y * y + z * z);
}

// Turns a displacement that is given into model units, shortening an absurd one.
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

// What 95 % of errors at this |d| stay below, told with a confidence of 95 % where they grow within a bin of the
// survey as from bin to bin, or kUnknownError: for a case that no survey has, or a flagged answer. The force's as
// parts of `force`, its size in model units: of one that is small for its displacement they are larger parts.
void estimate_errors(const pal_pack& pack, pal_model model, bool surveyed, const double displacement[3],
                     double force, pal_contact_result& result) {
  result.displacement_error = kUnknownError;
  result.force_error = kUnknownError;
  if (!surveyed || result.flags != 0) return;
  const SurveyView& survey = pack.surveys[model - PAL_MODEL_LINEAR];
  const double size = length(displacement) / pack.max_displacement;
  for (uint32_t bin = 0; bin < survey.num_bins; ++bin) {
    // The scene's largest displacement itself belongs to the last bin, whatever its rounding.
    const ErrorBinView& of = survey.bins[bin];
    if (size <= of.to * (1.0 + 1e-9)) {
      const double below = std::max(0.0, of.to - size);
      result.displacement_error = std::max(0.0, of.displacement_bound - below * of.displacement_slope);
      // As an absolute error, and of what it leaves of the force at least.
      const double bound = std::max(0.0, of.force_bound - below * of.force_slope);
      const double scale = static_cast<double>(survey.force_scale) * std::min(1.0, size);
      const double left = force - bound * scale;
      result.force_error = !(force < scale)       ? bound
                           : left > bound * scale ? bound * scale / left
                                                  : std::max(kUnknownError, bound);
      return;
    }
  }
}

// The same for several contacts of a zone, whose errors are parts of the largest displacement and force among them:
// what 95 % of errors of such sets stay below, over their loads and over their reach (ErrorSurvey in schemas/pack.fbs), or
// what one contact of that size has, whatever is most. A flag of one is a doubt about all; so is a
// load or a reach whose bound is all of the displacement.
void estimate_set_errors(const pal_session& session, bool surveyed, uint32_t count, double load,
                         pal_contact_result* results) {
  const pal_pack& pack = *session.pack;
  const SurveyView& survey = pack.surveys[PAL_MODEL_ZONE - PAL_MODEL_LINEAR];
  const double* largest = session.displacements;
  pal_contact_result of_set = {};
  double largest_size = 0;
  double reach = 0;
  for (uint32_t c = 0; c < count; ++c) {
    const double* d = session.displacements + size_t{3} * c;
    const double size = length(d) / pack.max_displacement;
    reach += size * size;
    if (!(size > largest_size)) continue;
    largest_size = size;
    largest = d;
  }
  const double displacement_error =
      std::max(survey.set_displacement_bound * load, survey.set_displacement_reach_bound * reach);
  const double force_error = std::max(survey.set_force_bound * load, survey.set_force_reach_bound * reach);
  for (uint32_t c = 0; c < count; ++c) {
    if (displacement_error >= kUnknownError) results[c].flags |= PAL_FLAG_EXTRAPOLATED;
    of_set.flags |= results[c].flags;
  }
  estimate_errors(pack, PAL_MODEL_ZONE, surveyed && count <= survey.most_contacts, largest,
                  static_cast<double>(INFINITY), of_set);
  for (uint32_t c = 0; c < count; ++c) {
    results[c].displacement_error =
        std::min(kUnknownError, std::max(of_set.displacement_error, displacement_error));
    results[c].force_error = std::min(kUnknownError, std::max(of_set.force_error, force_error));
  }
}

// Whether displacements as this one were sampled at every corner of a place.
bool is_sampled_about(const pal_pack& pack, const ContactPlace& place, const double displacement[3]) {
  for (uint32_t i = 0; i < place.count; ++i) {
    if (!is_sampled(pack, place.corners[i].site, displacement)) return false;
  }
  return true;
}

// The model that answers a contact alone at a site.
pal_model model_alone(const pal_pack& pack, uint32_t site) {
  if (pack.polynomial_sites == nullptr) return PAL_MODEL_LINEAR;
  return was_sampled(pack, site) ? PAL_MODEL_POLYNOMIAL : PAL_MODEL_AFFINE;
}

// The largest of the estimates: where the models of these sites alone come in.
void worsen_estimate(const pal_pack& pack, const ContactPlace& place, bool surveyed,
                     const double displacement[3], double force, pal_contact_result& result) {
  for (uint32_t i = 0; i < place.count; ++i) {
    pal_contact_result of_corner = {};
    of_corner.flags = result.flags;
    estimate_errors(pack, model_alone(pack, place.corners[i].site), surveyed, displacement, force, of_corner);
    result.displacement_error = std::max(result.displacement_error, of_corner.displacement_error);
    result.force_error = std::max(result.force_error, of_corner.force_error);
  }
}

// Turns given forces into model units, cutting those that would move their contact alone by an absurd
// displacement.
uint32_t take_forces(const pal_session& session, const pal_contact& contact, uint32_t index, double* out) {
  const double* stiffness = session.linear.answering.own_stiffness + size_t{9} * index;
  uint32_t flags = 0;
  for (uint32_t axis = 0; axis < 3; ++axis) {
    if ((contact.force_axes >> axis & 1) == 0) continue;
    const double limit = kAbsurdDisplacement * session.pack->max_displacement * stiffness[4 * axis];
    const double force = contact.force[axis] / session.pack->newtons;
    out[axis] = force > limit ? limit : force < -limit ? -limit : force;
    if (fabs(force) > limit) flags = PAL_FLAG_CLAMPED | PAL_FLAG_EXTRAPOLATED;
  }
  return flags;
}

// Displacements that given forces have made absurd: all of the answer is scaled with them.
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
  for (uint32_t i = 0; i < 3 * linear.answering.num_held; ++i) shorten(linear.nodal_force[i]);
  for (int of = 0; of < 2; ++of) shorten(frame.energy);  // of forces and displacements
  frame.flags |= PAL_FLAG_CLAMPED | PAL_FLAG_EXTRAPOLATED;
}

LinearFrame evaluate_given(pal_session& session, const pal_contact* contacts, uint32_t count) {
  LinearFrame frame = {};
  frame.given_forces = session.given_forces;
  frame.gravity_turn = session.gravity_turned ? session.gravity_turn : nullptr;
  frame.turn_before = session.gravity_changed ? session.turn_before : nullptr;
  frame.displacements = session.displacements;
  frame.forces = session.forces;
  place_contacts(contacts, session.linear);
  uint32_t any_axes = 0;
  for (uint32_t c = 0; c < count; ++c) {
    session.given_axes[c] = contacts[c].force_axes;
    any_axes |= contacts[c].force_axes;
    if (contacts[c].force_axes != 0)
      session.input_flags[c] |= take_forces(session, contacts[c], c, session.given_forces + size_t{3} * c);
  }
  if (any_axes != 0) frame.given_axes = session.given_axes;
  evaluate_linear(*session.pack, session.linear, frame);
  if (any_axes != 0) shorten_answer(*session.pack, count, session.linear, frame);
  return frame;
}

void answer_linear(pal_session& session, const pal_contact* contacts, uint32_t count,
                   pal_contact_result* results) {
  const pal_pack& pack = *session.pack;
  LinearState& linear = session.linear;
  const LinearFrame frame = evaluate_given(session, contacts, count);
  const double energy_unit = count == 0 ? 0.0 : pack.newtons * pack.metres;
  session.stored_energy = frame.energy * energy_unit;
  session.energy_brought = (frame.energy - frame.energy_before) * energy_unit;
  FieldState& field = session.snapshots.slots[session.snapshots.back];
  field.num_held = linear.answering.num_held;
  memcpy(field.held, linear.answering.held, field.num_held * sizeof *field.held);
  for (uint32_t i = 0; i < 3 * field.num_held; ++i) {
    field.weights[i] = static_cast<pal_real>(linear.nodal_force[i] * pack.metres);
  }
  if (results == nullptr) return;
  const bool surveyed =
      count == 1 && session.num_fixed == 0 && contacts[0].force_axes == 0 && !session.gravity_turned;
  for (uint32_t c = 0; c < count; ++c) {
    const double* d = session.displacements + size_t{3} * c;
    pal_contact_result& result = results[c];
    result = {};
    result.model = PAL_MODEL_LINEAR;
    result.flags = frame.flags | session.input_flags[c];
    if (session.config.model == PAL_MODEL_AUTO &&
        (pack.polynomial_sites != nullptr || pack.zone_nodes != nullptr))
      result.flags |= PAL_FLAG_LINEAR_FALLBACK;
    if (count > kMostBetween && !is_at_site(contacts[c])) result.flags |= PAL_FLAG_NEAREST_SITE;
    const bool sampled = acts_at_site(contacts[c], count) ? is_sampled(pack, nearest_site(contacts[c]), d)
                                                          : is_sampled_about(pack, place_of(contacts[c]), d);
    if (!sampled) result.flags |= PAL_FLAG_EXTRAPOLATED;
    estimate_errors(pack, PAL_MODEL_LINEAR, surveyed, d, length(session.forces + size_t{3} * c), result);
    for (uint32_t i = 0; i < 3; ++i) {
      result.force[i] = session.forces[3 * c + i] * pack.newtons;
      result.displacement[i] = d[i] * pack.metres;
      for (uint32_t j = 0; j < 3; ++j) {
        result.stiffness[i][j] =
            linear.answering.own_stiffness[9 * c + 3 * i + j] * (pack.newtons / pack.metres);
      }
    }
  }
}

// Of one contact that was answered alone, all of it in model units.
void give_result(const pal_session& session, pal_model model, uint32_t flags, const double force[3],
                 const double stiffness[9], pal_contact_result& result) {
  const pal_pack& pack = *session.pack;
  const double* d = session.displacements;
  result = {};
  result.model = model;
  result.flags = flags | session.input_flags[0];
  estimate_errors(pack, model, true, d, length(force), result);
  for (int i = 0; i < 3; ++i) {
    result.force[i] = force[i] * pack.newtons;
    result.displacement[i] = d[i] * pack.metres;
    for (int j = 0; j < 3; ++j) result.stiffness[i][j] = stiffness[3 * i + j] * (pack.newtons / pack.metres);
  }
}

void answer_polynomial(pal_session& session, const pal_contact& contact, pal_contact_result* results) {
  const pal_pack& pack = *session.pack;
  FieldState& field = session.snapshots.slots[session.snapshots.back];
  const ContactPlace place = place_of(contact);
  field.num_corners = 0;
  const PlaceAnswer blend = blend_polynomials(pack, place, session.displacements, field);
  session.stored_energy = blend.energy * pack.newtons * pack.metres;
  if (results == nullptr) return;
  bool all_sampled = true;
  for (uint32_t i = 0; i < place.count; ++i)
    all_sampled = all_sampled && was_sampled(pack, place.corners[i].site);
  pal_contact_result& result = results[0];
  give_result(session, all_sampled ? PAL_MODEL_POLYNOMIAL : PAL_MODEL_AFFINE, blend.flags, blend.force,
              blend.stiffness, result);
  if (!all_sampled) worsen_estimate(pack, place, true, session.displacements, length(blend.force), result);
  if (session.config.model == PAL_MODEL_AFFINE) result.model = PAL_MODEL_AFFINE;
}

void answer_linear_point(pal_session& session, const pal_contact& contact, pal_contact_result* results) {
  const pal_pack& pack = *session.pack;
  const ContactPlace place = place_of(contact);
  LinearPointAnswer answer;
  FieldState& field = session.snapshots.slots[session.snapshots.back];
  field.num_held =
      evaluate_linear_point(pack, place, session.displacements, answer, field.held, field.weights);
  session.stored_energy = answer.energy * pack.newtons * pack.metres;
  if (results == nullptr) return;
  const uint32_t flags =
      is_sampled_about(pack, place, session.displacements) ? 0 : uint32_t{PAL_FLAG_EXTRAPOLATED};
  give_result(session, PAL_MODEL_LINEAR, flags, answer.force, answer.stiffness, results[0]);
}

// Whether one of the two blends is ready for these contacts; it then answers.
bool find_ready_blend(LinearState& linear, const pal_contact* contacts, uint32_t count,
                      uint32_t fixed_version) {
  if (linear.answering.ready && is_for(linear.answering, contacts, count, fixed_version)) return true;
  if (!linear.next.ready || !is_for(linear.next, contacts, count, fixed_version)) return false;
  swap_blends(linear);
  return true;
}

// Whether a zone takes linear_dd to move these contacts to their places (place_answer.hpp).
bool is_moved_together(const pal_contact* contacts, uint32_t count, uint32_t num_fixed) {
  if (count > kMostBetween || (count == 1 && num_fixed == 0)) return false;
  return std::any_of(contacts, contacts + count,
                     [](const pal_contact& contact) { return place_of(contact).count > 1; });
}

// Adds it to what moves each of them, once the difference is placed, and to the field. `couplings`: [3 count][3
// count] of the stiffness, above the diagonal, where forces are given. Returns its energy.
double move_together(pal_session& session, const pal_contact* contacts, uint32_t count, PlaceAnswer* moved,
                     double* couplings, FieldState& field) {
  const pal_pack& pack = *session.pack;
  const ZoneSet& set = session.zone.answering;
  LinearState& linear = session.linear;
  LinearFrame frame = {};
  frame.displacements = set.followed;
  frame.forces = session.forces;
  evaluate_linear(pack, linear, frame);
  const bool are_forces_given = std::any_of(
      contacts, contacts + count, [](const pal_contact& contact) { return contact.force_axes != 0; });
  for (uint32_t c = 0; c < count; ++c) {
    moved[c].flags |= frame.flags;
    for (uint32_t i = 0; i < 3; ++i) moved[c].force[i] += frame.forces[3 * c + i];
    for (uint32_t i = 0; i < 9; ++i) moved[c].stiffness[i] += linear.answering.own_stiffness[9 * c + i];
    for (uint32_t other = c + 1; other < count && are_forces_given; ++other) {
      double block[9];
      contact_stiffness(pack, linear, c, other, block);
      for (uint32_t i = 0; i < 9; ++i) couplings[(3 * c + i / 3) * 3 * count + 3 * other + i % 3] = block[i];
    }
  }
  const uint32_t end = field.num_held + field.num_moved;
  const LinearBlend& blend = linear.answering;
  memcpy(field.held + end, blend.held, blend.num_held * sizeof *field.held);
  for (uint32_t i = 0; i < 3 * blend.num_held; ++i)
    field.weights[3 * end + i] = static_cast<pal_real>(linear.nodal_force[i] * pack.metres);
  field.num_moved += blend.num_held;
  return frame.energy;
}

void answer_zone(pal_session& session, const pal_contact* contacts, uint32_t count, const double* turns,
                 pal_contact_result* results) {
  const pal_pack& pack = *session.pack;
  FieldState& field = session.snapshots.slots[session.snapshots.back];
  const ZoneSet& set = session.zone.answering;
  const bool is_together = is_moved_together(contacts, count, set.num_fixed) &&
                           find_ready_blend(session.linear, contacts, count, set.fixed_version);
  session.moved_together = is_together;
  if (is_together) place_difference(contacts, set.sites, session.linear);
  for (uint32_t at = 0; at < 3 * count; ++at) {
    if (is_force_given(contacts[at / 3], at % 3))
      session.displacements[at] = session.zone.strained ? set.wanted[at] : 0.0;
  }
  const bool is_turned = take_turns(session, contacts, count, turns);
  ZoneAnswer answer;
  ForceControl control;
  PlaceAnswer moved[pack::kMostZoneContacts];
  double couplings[9 * kMostBetween * kMostBetween] = {};
  // A frame's iterations are for all that the given forces take.
  for (uint32_t left = session.config.zone_iterations;;) {
    answer = solve_zone(pack, session.displacements, left, session.zone);
    left -= answer.iterations;
    fill_zone_field(pack, session.zone, field);
    for (uint32_t c = 0; c < count; ++c) {
      moved[c] = {};
      // Of contacts that share one, what moves one alone would drag the patches of the others from where they are
      // held, and with it nodes that are fixed.
      if (!is_alone_in_zone(set, c) || set.num_fixed > 0) continue;
      moved[c] = (is_together ? move_beyond_linear : move_to_place)(pack, set.sites[c], place_of(contacts[c]),
                                                                    set.followed + size_t{3} * c, field);
      answer.energy += moved[c].energy;
    }
    if (is_together) answer.energy += move_together(session, contacts, count, moved, couplings, field);
    control =
        control_forces(pack, set, contacts, moved, is_together ? couplings : nullptr, session.displacements);
    if (control.has_ended || answer.went_back || left == 0) break;
  }
  for (uint32_t at = 0; at < 3 * count; ++at) {
    const bool goes_on = is_force_given(contacts[at / 3], at % 3) && !answer.went_back;
    set.wanted[at] = goes_on ? session.displacements[at] : set.followed[at];
  }
  if (!answer.went_back) answer.flags |= control.flags;
  if (!control.has_ended) answer.flags |= PAL_FLAG_UNCONVERGED;
  session.stored_energy = answer.energy * pack.newtons * pack.metres;
  if (results == nullptr) return;
  // One that others press on from nearby may, and what the organ outside then adds is felt by all.
  double largest = 0;
  for (uint32_t c = 0; c < count; ++c) {
    largest = std::max(largest, length(session.displacements + size_t{3} * c));
    if (is_turned)
      largest =
          std::max(largest, pack.mean_surface_edge * length(session.displacements + size_t{3} * (count + c)));
  }
  double farthest = largest;  // on the way, too
  for (uint32_t c = 0; c < count; ++c) farthest = std::max(farthest, length(set.followed + size_t{3} * c));
  bool is_beyond = false;
  double load = 0;
  for (uint32_t c = 0; c < count; ++c) {
    is_beyond = is_beyond || is_beyond_series(pack, set, c, farthest);
    load = std::max(load, length(set.force + size_t{3} * c) / pack.zone_force_scale[set.sites[c]]);
  }
  bool is_surveyed = session.zone.rings == pack.zone_rings && !session.zone.inclusion.is_present &&
                     set.num_fixed == 0 && !is_turned;
  for (uint32_t c = 0; c < count; ++c) {
    const double* d = session.displacements + size_t{3} * c;
    pal_contact_result& result = results[c];
    result = {};
    result.model = PAL_MODEL_ZONE;
    result.flags = answer.flags | moved[c].flags | session.input_flags[c];
    if (!set.sound) result.flags |= PAL_FLAG_ILL_CONDITIONED;
    if (length(d) > pack.max_displacement * (1 + kRounding) || is_beyond)
      result.flags |= PAL_FLAG_EXTRAPOLATED;
    // Surveyed were contacts at sites with all rings, once they had come to rest.
    const ContactPlace difference = difference_from(place_of(contacts[c]), set.sites[c]);
    if (difference.count > 0 && !is_together && (count > 1 || set.num_fixed > 0))
      result.flags |= PAL_FLAG_NEAREST_SITE;
    is_surveyed = is_surveyed && contacts[c].force_axes == 0 && (count == 1 || difference.count == 0);
    double force[3];
    for (uint32_t i = 0; i < 3; ++i) force[i] = set.force[3 * c + i] + moved[c].force[i];
    estimate_errors(pack, PAL_MODEL_ZONE, is_surveyed, d, length(force), result);
    worsen_estimate(pack, difference, is_surveyed, d, length(force), result);
    for (uint32_t i = 0; i < 3; ++i) {
      result.force[i] = force[i] * pack.newtons;
      result.displacement[i] = set.followed[3 * c + i] * pack.metres;
      for (uint32_t j = 0; j < 3; ++j)
        result.stiffness[i][j] = (set.stiffness[3 * c + i][3 * c + j] + moved[c].stiffness[3 * i + j]) *
                                 (pack.newtons / pack.metres);
    }
  }
  if (count > 1) estimate_set_errors(session, is_surveyed, count, load, results);
  for (uint32_t c = 0; c < count && largest > 0; ++c) {
    for (double* error : {&results[c].displacement_error, &results[c].force_error})
      *error = std::min(kUnknownError, *error + answer.left / largest);
  }
}

// The zone that is ready is for these contacts and turned out not to be one: linear_dd takes its place, if it may.
bool is_zone_refused(const pal_session& session, const pal_contact* contacts, uint32_t count) {
  const ZoneSet& set = session.zone.answering;
  return session.config.model == PAL_MODEL_AUTO && set.ready && !set.sound &&
         is_zone_for(set, contacts, count, session.fixed_version);
}

bool zone_answers(const pal_session& session, uint32_t num_contacts) {
  return (session.config.model == PAL_MODEL_AUTO || session.config.model == PAL_MODEL_ZONE) &&
         session.pack->zone_nodes != nullptr && !session.gravity_turned &&
         session.num_fixed <= session.zone.max_fixed && num_contacts >= 1 &&
         num_contacts <= session.zone.max_contacts;
}

bool polynomial_answers(const pal_session& session, uint32_t num_contacts, bool forces_given) {
  const bool is_for_zone =
      (session.zone.inclusion.is_present || has_turns(session)) && zone_answers(session, num_contacts);
  return !forces_given && !session.gravity_turned && !is_for_zone &&
         (session.config.model == PAL_MODEL_AUTO || session.config.model == PAL_MODEL_POLYNOMIAL ||
          session.config.model == PAL_MODEL_AFFINE) &&
         session.pack->polynomial_sites != nullptr && num_contacts == 1 && session.num_fixed == 0;
}

// Whether what moves a zone to the places of these contacts is still to be made.
bool lacks_blend(pal_session& session, const pal_contact* contacts, uint32_t count, uint32_t num_fixed,
                 uint32_t fixed_version) {
  return is_moved_together(contacts, count, num_fixed) &&
         !find_ready_blend(session.linear, contacts, count, fixed_version);
}

bool has_zone_for(const pal_session& session, const pal_contact* contacts, uint32_t count,
                  uint32_t fixed_version) {
  const ZoneSet& set = session.zone.answering;
  return set.ready && is_zone_for(set, contacts, count, fixed_version);
}

struct Begun {
  bool blend;
  bool zone;
};

// Begins what these contacts are not ready for: a blend, a zone, or both.
Begun begin(pal_session& session, Answering answering, const pal_contact* contacts, uint32_t count) {
  const FixedNodes fixed = {session.num_fixed, session.fixed, session.fixed_version};
  const bool is_zone = answering == Answering::zone;
  const Begun begun = {!is_zone || lacks_blend(session, contacts, count, fixed.count, fixed.version),
                       is_zone && !has_zone_for(session, contacts, count, fixed.version)};
  if (begun.blend) begin_linear(contacts, count, fixed.nodes, fixed.count, fixed.version, session.linear);
  if (begun.zone) begin_zone(*session.pack, contacts, count, fixed, session.zone);
  return begun;
}

// Goes on with what is begun by a frame's share of work. Once all of it is ready it answers, and true is returned.
bool advance(pal_session& session) {
  const pal_pack& pack = *session.pack;
  if (session.linear_begun) {
    session.linear_begun = !advance_linear(pack, session.operations, session.linear);
    return !session.linear_begun && !session.zone_begun;
  }
  session.zone_begun = !advance_zone(pack, session.operations, session.zone);
  return !session.zone_begun;
}

}  // namespace

bool can_answer(const pal_session& session, uint32_t num_contacts, bool forces_given) {
  const bool may_be_linear =
      session.config.model == PAL_MODEL_AUTO || session.config.model == PAL_MODEL_LINEAR;
  return num_contacts == 0 || polynomial_answers(session, num_contacts, forces_given) ||
         zone_answers(session, num_contacts) || (may_be_linear && session.pack->field_compliance != nullptr);
}

Answering answering_for(const pal_session& session, const pal_contact* contacts, uint32_t count,
                        bool forces_given) {
  // Untouched, an organ rests; but nodes that are fixed hold it where gravity has turned.
  if (count == 0)
    return session.gravity_turned && session.num_fixed > 0 ? Answering::linear : Answering::nothing;
  if (polynomial_answers(session, count, forces_given)) return Answering::polynomial;
  if (zone_answers(session, count) && !is_zone_refused(session, contacts, count)) return Answering::zone;
  const bool alone = count == 1 && session.num_fixed == 0 && !forces_given && !session.gravity_turned;
  return alone && !is_at_site(contacts[0]) ? Answering::linear_point : Answering::linear;
}

void make_ready(pal_session& session, Answering answering, const pal_contact* contacts, uint32_t count) {
  if (is_ready(session, answering, contacts, count, session.fixed_version)) return;
  const Begun begun = begin(session, answering, contacts, count);
  if (begun.blend) advance_linear(*session.pack, UINT64_MAX, session.linear);
  if (begun.zone) advance_zone(*session.pack, UINT64_MAX, session.zone);
  // What tools had begun of the same kind is lost.
  session.linear_begun = session.linear_begun && !begun.blend;
  session.zone_begun = session.zone_begun && !begun.zone;
}

bool is_ready(pal_session& session, Answering answering, const pal_contact* contacts, uint32_t count,
              uint32_t fixed_version) {
  if (answering == Answering::linear) return find_ready_blend(session.linear, contacts, count, fixed_version);
  return answering != Answering::zone ||
         (has_zone_for(session, contacts, count, fixed_version) &&
          !lacks_blend(session, contacts, count, session.zone.answering.num_fixed, fixed_version));
}

bool make_ready_within(pal_session& session, Answering answering, const pal_contact* contacts, uint32_t count,
                       bool& began, bool& finished) {
  began = false;
  finished = false;
  if (is_ready(session, answering, contacts, count, session.fixed_version)) return true;
  if (!session.zone_begun && !session.linear_begun) {
    const Begun begun = begin(session, answering, contacts, count);
    session.linear_begun = begun.blend;
    session.zone_begun = begun.zone;
    began = true;
  }
  if (!advance(session)) return false;
  finished = true;
  return is_ready(session, answering, contacts, count, session.fixed_version);
}

void answer_contacts(pal_session& session, Answering answering, const pal_contact* contacts, uint32_t count,
                     const double* turns, pal_contact_result* results) {
  for (uint32_t c = 0; c < count; ++c) {
    double given[3];
    for (uint32_t axis = 0; axis < 3; ++axis)
      given[axis] = (contacts[c].force_axes >> axis & 1) != 0 ? 0.0 : contacts[c].displacement[axis];
    session.input_flags[c] = take_displacement(*session.pack, given, session.displacements + size_t{3} * c);
  }
  session.energy_brought = 0;
  if (answering != Answering::zone) rest_zone(*session.pack, session.zone);
  FieldState& field = session.snapshots.slots[session.snapshots.back];
  field.model = model_of(answering);
  field.gravity_turned = session.gravity_turned;
  for (int i = 0; i < 3; ++i)
    field.gravity_turn[i] = static_cast<pal_real>(session.gravity_turn[i] * session.pack->metres);
  switch (answering) {
    case Answering::nothing:
      session.stored_energy = 0;
      break;
    case Answering::polynomial:
      answer_polynomial(session, contacts[0], results);
      break;
    case Answering::linear_point:
      answer_linear_point(session, contacts[0], results);
      break;
    case Answering::zone:
      answer_zone(session, contacts, count, turns, results);
      break;
    case Answering::linear:
      answer_linear(session, contacts, count, results);
      break;
  }
  publish(session.snapshots);
}

void add_coupling(const pal_session& session, Answering answered, const pal_contact_result* results,
                  uint32_t row, uint32_t column, double* sum) {
  const pal_pack& pack = *session.pack;
  const double scale = pack.newtons / pack.metres;
  double block[9] = {};
  if (row != column && answered == Answering::linear)
    contact_stiffness(pack, session.linear, row, column, block);
  if (row != column && answered == Answering::zone) {
    for (uint32_t i = 0; i < 9; ++i)
      block[i] = session.zone.answering.stiffness[3 * row + i / 3][3 * column + i % 3];
    if (session.moved_together) {
      double of_move[9];
      contact_stiffness(pack, session.linear, row, column, of_move);
      for (uint32_t i = 0; i < 9; ++i) block[i] += of_move[i];
    }
  }
  for (uint32_t i = 0; i < 9; ++i)
    sum[i] += row == column ? results[row].stiffness[i / 3][i % 3] : scale * block[i];
}

}  // namespace palpate
