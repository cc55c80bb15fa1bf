// The fallback contact set answers while linear_dd or a zone is prepared for the held contacts. Preparation
// takes as many frames as the budget needs. The fallback set is the contact set that answered last:
// - Contacts that tools still hold move with their tools.
// - Released contacts keep their last displacement.
// - New contacts feel no force yet.
//
// A preparation that has begun ends, and its contact set answers, before another preparation begins.
#pragma once

#include "runtime/src/tools/tools.hpp"

namespace palpate {

// Answers ToolStates::inputs if their model is ready within the budget, else answers the fallback contact
// set. Sets the members of ToolStates that describe the answer.
void answer_or_fall_back(TissueState& tissue, ToolStates& states);

}  // namespace palpate
