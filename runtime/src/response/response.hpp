// The answer to a set of contacts: which model gives it, how sure it is, and what the visual frame needs of
// it.
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/response/response_kind.hpp"
#include "runtime/src/response/tissue_state.hpp"

namespace palpate {

// Whether some model of the session can answer so many contacts with its fixed nodes. `forces_given`: along
// some axis, instead of the displacement.
bool can_answer(const TissueState& tissue, uint32_t num_contacts, bool forces_given = false);

// What answers these contacts, which some model can.
ResponseKind select_response(const TissueState& tissue, const pal_contact* contacts, uint32_t count,
                             bool forces_given = false);

// Makes what answers ready for these contacts, whatever it takes: ResponseKind::linear and ResponseKind::zone have to be.
void prepare(TissueState& tissue, ResponseKind kind, const pal_contact* contacts, uint32_t count);

// The same with about as many multiply-adds as the session's budget allows: call it again in the next frame until it
// is true. Work that was begun for others is finished first, so that contacts which change all the time are answered
// too, if late; `finished` says that it now answers them.
bool prepare_within(TissueState& tissue, ResponseKind kind, const pal_contact* contacts, uint32_t count,
                    bool& began, bool& finished);

// Whether what answered these contacts still can; of two blends that one then answers.
bool is_ready(TissueState& tissue, ResponseKind kind, const pal_contact* contacts, uint32_t count,
              uint32_t fixed_version);

// Forces and stiffness of contacts by what is ready for them, for finite displacements; API units,
// organ frame. Leaves their energy in pal_session::stored_energy and hands the field to the visual thread.
// `turns`: [count][3] (patch_turns.hpp), of zones whose patches turn. `results`: count entries, or null.
void answer_contacts(TissueState& tissue, ResponseKind kind, const pal_contact* contacts, uint32_t count,
                     const double* turns, pal_contact_result* results);

// d force of contact `row` / d displacement of contact `column`, of the answer just given: adds it to sum[9],
// API units, organ frame.
void add_coupling(const TissueState& tissue, ResponseKind answered, const pal_contact_result* results,
                  uint32_t row, uint32_t column, double* sum);

}  // namespace palpate
