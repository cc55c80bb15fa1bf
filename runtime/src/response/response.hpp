// The answer to a contact set: response selection, preparation, evaluation and error estimates.
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/response/response_kind.hpp"
#include "runtime/src/response/tissue_state.hpp"

namespace palpate {

// Whether some model can answer this number of contacts with the session's fixed nodes. `forces_given`: a
// force replaces the displacement along some axis.
bool can_answer(const TissueState& tissue, uint32_t num_contacts, bool forces_given = false);

// Selects the response for contacts that some model can answer.
ResponseKind select_response(const TissueState& tissue, const pal_contact* contacts, uint32_t count,
                             bool forces_given = false);

// Selects the linear response for contacts without a prepared zone.
ResponseKind select_linear(const TissueState& tissue, const pal_contact* contacts, uint32_t count,
                           bool forces_given = false);

// Takes the delivery of the refining lane, if any. Each frame calls this function first.
void take_from_lane(TissueState& tissue);

// Prepares the response for these contacts without a limit of work. Returns false for a zone that is not
// prepared yet, and requests the zone from the refining lane.
bool prepare(TissueState& tissue, ResponseKind kind, const pal_contact* contacts, uint32_t count);

// Prepares the response within the session's budget of multiply-adds a frame. Call this function in each
// frame until it returns true. A preparation for another contact set ends first, so that contacts that change
// in every frame still get an answer.
// - `began`: this call began the preparation. For a zone, the refining lane accepted the request.
// - `finished`: a preparation ended, and its contact set can answer.
bool prepare_within(TissueState& tissue, ResponseKind kind, const pal_contact* contacts, uint32_t count,
                    bool& began, bool& finished);

// Whether a response is ready for these contacts. May swap the two blends of linear_dd (linear_blend.hpp).
bool is_ready(TissueState& tissue, ResponseKind kind, const pal_contact* contacts, uint32_t count,
              uint32_t fixed_version);

// Evaluates the ready response for finite displacements; API units, organ frame. Stores the energy in
// TissueState::stored_energy and publishes the field to the visual thread.
// - `turns`: [count][3] rotations (patch_rotation.hpp), for zones whose patches rotate.
// - `results`: [count], or null.
// - `awaits_zone`: the next zone starts from the last zone. Else another model resets the last zone to rest.
void answer_contacts(TissueState& tissue, ResponseKind kind, const pal_contact* contacts, uint32_t count,
                     const double* turns, pal_contact_result* results, bool awaits_zone = false);

// Answers one contact by linear_dd as if it were alone, without a field. Returns the energy. API units.
double answer_alone(const TissueState& tissue, const pal_contact& contact, pal_contact_result& result);

// Adds d force of contact `row` / d displacement of contact `column`, by the last answer, to sum[3][3]. API
// units, organ frame.
void add_coupling(const TissueState& tissue, ResponseKind answered, const pal_contact_result* results,
                  uint32_t row, uint32_t column, double* sum);

}  // namespace palpate
