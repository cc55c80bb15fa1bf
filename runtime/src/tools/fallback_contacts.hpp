// A fallback contact set answers during a preparation: of linear_dd within the budget, or of a zone by the
// refining lane. The set that answered last is the fallback set while tools hold one of its contacts:
// - Contacts that tools still hold move with their tools.
// - Released contacts keep their last displacement.
// - linear_dd answers new contacts as if each were alone.
// Otherwise linear_dd answers the held contacts.
//
// A preparation that has begun ends, and its contact set answers, before another preparation begins.
#pragma once

#include "runtime/src/tools/tools.hpp"

namespace palpate {

// Answers ToolStates::inputs if their model is ready within the budget, else answers the fallback contact
// set. Sets the members of ToolStates that describe the answer.
void answer_or_fall_back(TissueState& tissue, ToolStates& states);

}  // namespace palpate
