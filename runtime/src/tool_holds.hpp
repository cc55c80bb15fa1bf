// What tools hold: a contact taken hold of by the caller (pal_tool_hold) or where a tool's tip comes near the
// surface (pal_tool_set_touch), and let go by the caller or where the tool leaves the tissue.
#pragma once

#include "runtime/src/tool_motion.hpp"

namespace palpate {

// Looks for something to take hold of. False where there is something and no room for it.
bool try_to_touch(pal_session& session, uint32_t tool, ToolState& state);

// A contact of PAL_LAW_TOUCH is let go where its tool has come out beyond where it took hold, or, if it knows
// its tip, out of the organ anywhere else.
void let_go_of_what_came_out(pal_session& session, ToolRotation& last);

}  // namespace palpate
