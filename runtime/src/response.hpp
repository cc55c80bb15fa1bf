// The answer to a set of contacts: which model gives it, how sure it is, and what the visual frame needs of
// it.
#pragma once

#include <palpate/palpate.h>

namespace palpate {

// Whether some model of the session can answer so many contacts with its fixed nodes.
bool can_answer(const pal_session& session, uint32_t num_contacts);

// Forces and stiffness of contacts that can be answered, at sites of the pack and by finite displacements;
// API units, organ frame. Hands the field to the visual thread. `results`: count entries, or null. Returns
// the model that answered, PAL_MODEL_AUTO for no contacts.
pal_model answer_contacts(pal_session& session, const pal_contact* contacts, uint32_t count,
                          pal_contact_result* results);

// d force of contact `row` / d displacement of contact `column`, of the answer just given: adds it to sum[9],
// API units, organ frame.
void add_coupling(const pal_session& session, pal_model answered, const pal_contact_result* results,
                  uint32_t row, uint32_t column, double* sum);

}  // namespace palpate
