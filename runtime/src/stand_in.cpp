#include "runtime/src/stand_in.hpp"

#include <math.h>
#include <string.h>

#include <algorithm>

#include "runtime/src/patch_turns.hpp"
#include "runtime/src/response.hpp"
#include "runtime/src/session_state.hpp"

namespace palpate {
namespace {

// Which of the contacts that are answered each contact held is. Both rise by their ids.
void match_answered(ToolStates& states) {
  uint32_t i = 0;
  for (uint32_t c = 0; c < states.num_contacts; ++c) {
    const uint64_t id = states.contacts[c].id;
    while (i < states.num_answered && states.answered_ids[i] < id) ++i;
    states.answered_of[c] = i < states.num_answered && states.answered_ids[i] == id ? i : kNotAnswered;
  }
}

// Whether a contact has not got to where it is held.
bool is_behind(const double displacement[3], const double given[3]) {
  constexpr double kAsGood = 0.01;
  double largest = 0;
  double missing = 0;
  for (int i = 0; i < 3; ++i) {
    largest = std::max(largest, fabs(given[i]));
    missing = std::max(missing, fabs(given[i] - displacement[i]));
  }
  return missing > kAsGood * largest;
}

// What answers from now on: the contacts held, or those for which it was begun earlier.
void set_answered(Answering answering, uint32_t count, const uint64_t* ids, const pal_contact* inputs,
                  const double* turns, uint32_t fixed_version, pal_session& session) {
  ToolStates& states = session.tools;
  states.changed = states.changed || answering != states.answered || count != states.num_answered ||
                   fixed_version != states.answered_fixed;
  for (uint32_t i = 0; i < count; ++i) {
    const uint32_t site = answering == Answering::zone ? session.zone.answering.sites[i] : 0;
    states.changed = states.changed || states.answered_ids[i] != ids[i] || states.answered_sites[i] != site;
    states.answered_ids[i] = ids[i];
    states.answered_sites[i] = site;
    states.answered_inputs[i] = inputs[i];
  }
  if (has_turns(session) && count > 0)
    memcpy(states.answered_turns, turns, size_t{3} * count * sizeof *turns);
  states.answered = answering;
  states.num_answered = count;
  states.answered_fixed = fixed_version;
}

}  // namespace

void answer_or_stand_in(pal_session& session) {
  ToolStates& states = session.tools;
  states.changed = states.held_changed;
  states.held_changed = false;
  uint64_t ids[pack::kMostContacts];
  for (uint32_t c = 0; c < states.num_contacts; ++c) ids[c] = states.contacts[c].id;
  const Answering answering = answering_for(session, states.inputs, states.num_contacts);
  bool began = false;
  bool finished = false;
  const bool ready =
      make_ready_within(session, answering, states.inputs, states.num_contacts, began, finished);
  if (began) {
    states.begun = answering;
    states.num_begun = states.num_contacts;
    states.begun_fixed = session.fixed_version;
    memcpy(states.begun_ids, ids, states.num_contacts * sizeof *ids);
    memcpy(static_cast<void*>(states.begun_inputs), states.inputs,
           states.num_contacts * sizeof *states.inputs);
    if (has_turns(session))
      memcpy(states.begun_turns, states.turns, size_t{3} * states.num_contacts * sizeof *states.turns);
  }
  if (ready) {
    set_answered(answering, states.num_contacts, ids, states.inputs, states.turns, session.fixed_version,
                 session);
  } else if (finished) {
    set_answered(states.begun, states.num_begun, states.begun_ids, states.begun_inputs, states.begun_turns,
                 states.begun_fixed, session);
  } else if (!is_ready(session, states.answered, states.answered_inputs, states.num_answered,
                       states.answered_fixed)) {
    // pal_contact_frame has made it ready for contacts of its own.
    set_answered(Answering::nothing, 0, nullptr, nullptr, nullptr, session.fixed_version, session);
  }
  states.preparing = !ready;
  match_answered(states);
  for (uint32_t c = 0; !ready && c < states.num_contacts; ++c) {
    const uint32_t answered = states.answered_of[c];
    if (answered == kNotAnswered) continue;
    states.answered_inputs[answered] = states.inputs[c];
    if (has_turns(session))
      memcpy(states.answered_turns + size_t{3} * answered, states.turns + size_t{3} * c, 3 * sizeof(double));
  }
  answer_contacts(session, states.answered, states.answered_inputs, states.num_answered,
                  states.answered_turns, states.answered_results);
  // A zone that was made anew goes on from where the linear organ would be: while it catches up with the
  // tools it jumps, and on its way to balance it may answer several times what it comes to. So does, once, what has gone
  // back for want of a way, in this frame or in contact frames since the last: from there it follows in short steps, or
  // not at all.
  bool is_any_behind = has_turns(session);  // it may be in its turn alone
  bool is_any_moving = false;
  for (uint32_t i = 0; i < states.num_answered; ++i) {
    is_any_behind = is_any_behind || is_behind(states.answered_results[i].displacement,
                                               states.answered_inputs[i].displacement);
    is_any_moving = is_any_moving || (states.answered_results[i].flags & PAL_FLAG_UNCONVERGED) != 0;
  }
  const bool caught_up = states.catches_up;
  const bool begins = finished && (states.changed || is_any_behind);
  states.catches_up = is_any_moving && (begins || states.catches_up);
  states.changed = states.changed || states.catches_up || caught_up || session.zone.went_back;
  session.zone.went_back = false;
}

}  // namespace palpate
