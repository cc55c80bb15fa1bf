// Who answers the contacts that tools hold while linear_dd or a zone is being made ready for them, over as many frames
// as the budget takes: the contacts that were answered last. Those still held move, those let go stay where
// they were, and those that came later feel nothing yet. A set that was begun is finished, and answers,
// before another is begun.
#pragma once

#include "runtime/src/tools/tools.hpp"

namespace palpate {

// Answers ToolStates::inputs, if the model for them is ready or can be made so within the budget, or what
// stands in for them; sets all of ToolStates that says what was answered. Cost: that of the answer, and the
// budget.
void answer_or_fall_back(TissueState& tissue, ToolStates& states);

}  // namespace palpate
