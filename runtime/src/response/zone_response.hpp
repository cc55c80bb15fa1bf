// The answer of a zone: its Newton iterations, the transfer to the contacts' places, and the error estimates.
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/response/tissue_state.hpp"

namespace palpate {

// Whether one of the two blends is ready for these contacts. Makes this blend the active blend.
bool find_ready_blend(LinearState& linear, const pal_contact* contacts, uint32_t count,
                      uint32_t fixed_version);

// Whether a zone needs linear_dd of all contacts for its transfer to their places (response_at_point.hpp).
bool needs_joint_transfer(const pal_contact* contacts, uint32_t count, uint32_t num_fixed);

// Answers zone contacts, with the input in TissueState::displacements. `turns`: [count][3], or null.
// `results`: [count], or null.
void answer_zone(TissueState& tissue, const pal_contact* contacts, uint32_t count, const double* turns,
                 pal_contact_result* results);

}  // namespace palpate
