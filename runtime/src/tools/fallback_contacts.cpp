#include "runtime/src/tools/fallback_contacts.hpp"

#include <math.h>
#include <string.h>

#include <algorithm>

#include "runtime/src/response/patch_rotation.hpp"
#include "runtime/src/response/response.hpp"

namespace palpate {
namespace {

// Finds each held contact among the answered contacts. Both lists ascend by id.
void match_answered(ToolStates& states) {
  uint32_t i = 0;
  for (uint32_t c = 0; c < states.num_contacts; ++c) {
    const uint64_t id = states.contacts[c].id;
    while (i < states.num_answered && states.answered_ids[i] < id) ++i;
    states.answered_index[c] = i < states.num_answered && states.answered_ids[i] == id ? i : kNotAnswered;
  }
}

// Whether a contact has not reached its given displacement.
bool is_behind(const double displacement[3], const double given[3]) {
  constexpr double kTolerance = 0.01;
  double largest = 0;
  double missing = 0;
  for (int i = 0; i < 3; ++i) {
    largest = std::max(largest, fabs(given[i]));
    missing = std::max(missing, fabs(given[i] - displacement[i]));
  }
  return missing > kTolerance * largest;
}

// Whether the last answered set has a contact that is still held, and a nonlinear model is ready for the set.
bool serves_any(TissueState& tissue, ToolStates& states) {
  if (model_of(states.answered) == PAL_MODEL_LINEAR ||
      !is_ready(tissue, states.answered, states.answered_inputs, states.num_answered, states.answered_fixed))
    return false;
  match_answered(states);
  return std::any_of(states.answered_index, states.answered_index + states.num_contacts,
                     [](uint32_t answered) { return answered != kNotAnswered; });
}

// Whether linear_dd is ready for the held contacts, after this frame's share of work.
bool is_linear_ready(TissueState& tissue, ResponseKind linear, const ToolStates& states) {
  bool began = false;
  bool finished = false;
  return is_ready(tissue, linear, states.inputs, states.num_contacts, tissue.fixed_version) ||
         (!tissue.linear_begun &&
          prepare_within(tissue, linear, states.inputs, states.num_contacts, began, finished));
}

// Records the answered contact set: the held contacts, the set whose preparation began earlier, or none.
void set_answered(ResponseKind kind, uint32_t count, const uint64_t* ids, const pal_contact* inputs,
                  const double* turns, uint32_t fixed_version, TissueState& tissue, ToolStates& states) {
  states.changed =
      states.changed || kind != states.answered || count != states.num_answered ||
      fixed_version != states.answered_fixed ||
      (kind == ResponseKind::zone && states.answered_zone != tissue.zone.active.correction.number);
  states.answered_zone = tissue.zone.active.correction.number;
  for (uint32_t i = 0; i < count; ++i) {
    states.changed = states.changed || states.answered_ids[i] != ids[i];
    states.answered_ids[i] = ids[i];
    states.answered_inputs[i] = inputs[i];
  }
  if (has_turns(tissue) && count > 0) memcpy(states.answered_turns, turns, size_t{3} * count * sizeof *turns);
  states.answered = kind;
  states.num_answered = count;
  states.answered_fixed = fixed_version;
}

// Records the held contacts, with their `ids`, as the set in preparation.
void record_begun(ResponseKind kind, const uint64_t* ids, const TissueState& tissue, ToolStates& states) {
  states.begun = kind;
  states.num_begun = states.num_contacts;
  states.begun_fixed = tissue.fixed_version;
  memcpy(states.begun_ids, ids, states.num_contacts * sizeof *ids);
  memcpy(static_cast<void*>(states.begun_inputs), states.inputs, states.num_contacts * sizeof *states.inputs);
  if (has_turns(tissue))
    memcpy(states.begun_turns, states.turns, size_t{3} * states.num_contacts * sizeof *states.turns);
}

// `finished`: a preparation has ended. Unless `is_any_served`, linear_dd answers meanwhile if it is ready.
void choose_answered(ResponseKind kind, const uint64_t* ids, bool ready, bool finished, bool is_any_served,
                     TissueState& tissue, ToolStates& states) {
  if (ready) {
    set_answered(kind, states.num_contacts, ids, states.inputs, states.turns, tissue.fixed_version, tissue,
                 states);
  } else if (finished &&
             is_ready(tissue, states.begun, states.begun_inputs, states.num_begun, states.begun_fixed)) {
    // The finished set is not ready if a pal_contact_frame has replaced a part of its preparation.
    set_answered(states.begun, states.num_begun, states.begun_ids, states.begun_inputs, states.begun_turns,
                 states.begun_fixed, tissue, states);
  } else if (!is_any_served) {
    const ResponseKind linear = select_linear(tissue, states.inputs, states.num_contacts);
    const bool has_linear = is_linear_ready(tissue, linear, states);
    set_answered(has_linear ? linear : ResponseKind::nothing, has_linear ? states.num_contacts : 0, ids,
                 states.inputs, states.turns, tissue.fixed_version, tissue, states);
  } else if (!is_ready(tissue, states.answered, states.answered_inputs, states.num_answered,
                       states.answered_fixed)) {
    // A pal_contact_frame has prepared the model for another contact set.
    set_answered(ResponseKind::nothing, 0, nullptr, nullptr, nullptr, tissue.fixed_version, tissue, states);
  }
}

// Updates `catches_up`, and clears the zone's marks. Treats an answer as changed in four cases, because the
// force may jump:
// - A new zone starts where the organ is and catches up with the tools. Before equilibrium its force may be
//   several times the final force.
// - A zone had a setback (zone_setback.hpp) in this frame, or in a contact frame since the last haptic frame.
// - A zone has just caught up.
// - The first iteration of the refining lane took effect, or its correction was dropped.
void find_jumps(bool finished, TissueState& tissue, ToolStates& states) {
  bool is_any_behind = has_turns(tissue);  // the rotation alone may be behind
  bool is_any_moving = false;
  for (uint32_t i = 0; i < states.num_answered; ++i) {
    is_any_behind = is_any_behind || is_behind(states.answered_results[i].displacement,
                                               states.answered_inputs[i].displacement);
    is_any_moving = is_any_moving || (states.answered_results[i].flags & PAL_FLAG_UNCONVERGED) != 0;
  }
  const bool caught_up = states.catches_up;
  const bool begins = finished && (states.changed || is_any_behind);
  states.catches_up = is_any_moving && (begins || states.catches_up);
  states.changed =
      states.changed || states.catches_up || caught_up || tissue.zone.went_back || tissue.zone.has_jumped;
  tissue.zone.went_back = tissue.zone.has_jumped = false;
}

}  // namespace

void answer_or_fall_back(TissueState& tissue, ToolStates& states) {
  states.changed = states.held_changed;
  states.held_changed = false;
  uint64_t ids[pack::kMostContacts];
  for (uint32_t c = 0; c < states.num_contacts; ++c) ids[c] = states.contacts[c].id;
  const ResponseKind kind = select_response(tissue, states.inputs, states.num_contacts);
  const bool is_any_served =
      kind != ResponseKind::zone ||
      is_ready(tissue, kind, states.inputs, states.num_contacts, tissue.fixed_version) ||
      serves_any(tissue, states);
  if (!is_any_served) rest_zone(*tissue.pack, tissue.zone);  // before a request copies the zone's state
  bool began = false;
  bool finished = false;
  const bool ready = prepare_within(tissue, kind, states.inputs, states.num_contacts, began, finished);
  if (began) record_begun(kind, ids, tissue, states);
  choose_answered(kind, ids, ready, finished, is_any_served, tissue, states);
  states.preparing = !ready;
  match_answered(states);
  for (uint32_t c = 0; !ready && c < states.num_contacts; ++c) {
    const uint32_t answered = states.answered_index[c];
    if (answered == kNotAnswered) continue;
    states.answered_inputs[answered] = states.inputs[c];
    if (has_turns(tissue))
      memcpy(states.answered_turns + size_t{3} * answered, states.turns + size_t{3} * c, 3 * sizeof(double));
  }
  answer_contacts(tissue, states.answered, states.answered_inputs, states.num_answered, states.answered_turns,
                  states.answered_results);
  for (uint32_t c = 0; c < states.num_contacts; ++c) {
    if (states.answered_index[c] != kNotAnswered) continue;
    const double energy = answer_alone(tissue, states.inputs[c], states.results[c]);
    // The account takes the energy of a strained contact when a set answers the contact.
    if (states.contacts[c].strain != Strain::uncounted) tissue.stored_energy += energy;
  }
  find_jumps(finished, tissue, states);
}

}  // namespace palpate
