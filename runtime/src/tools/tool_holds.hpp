// What tools hold: a contact taken hold of by the caller (pal_tool_hold) or where a tool's tip comes near the
// surface (pal_tool_set_touch), and let go by the caller or where the tool leaves the tissue.
#pragma once

#include "runtime/src/tools/tool_motion.hpp"

namespace palpate {

// Makes the tool hold one more contact, for which there is room.
void take_hold(const TissueState& tissue, uint32_t tool, const pal_hold& hold, ToolStates& states);

// Lets go of all contacts of the tool.
void let_go_of_all(uint32_t tool, ToolStates& states);

// Looks for something to take hold of. False where there is something and no room for it.
bool try_to_touch(const TissueState& tissue, uint32_t tool, ToolStates& states);

// A contact of PAL_LAW_TOUCH is let go where its tool has come out beyond where it took hold, or, if it knows
// its tip, out of the organ anywhere else.
void let_go_of_what_came_out(const TissueState& tissue, ToolRotation& last, ToolStates& states);

}  // namespace palpate
