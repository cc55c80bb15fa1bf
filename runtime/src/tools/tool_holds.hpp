// Contacts that tools hold. A contact begins by pal_tool_hold, or when a tip comes near the surface
// (pal_tool_set_touch). A contact ends by the caller's release, or when its tool leaves the tissue.
#pragma once

#include "runtime/src/tools/tool_motion.hpp"

namespace palpate {

// Adds a contact to the tool. The caller has checked the capacity.
void take_hold(const TissueState& tissue, uint32_t tool, const pal_hold& hold, ToolStates& states);

void release_contacts(uint32_t tool, ToolStates& states);

// Holds the surface near the tool's tip, if any. False if the tool found a contact and the session has no
// room.
bool try_to_touch(const TissueState& tissue, uint32_t tool, ToolStates& states);

// Releases contacts of PAL_LAW_TOUCH in two cases:
// - The tool has come out beyond the place where the contact began.
// - The tool has a known tip, and this tip is outside the organ.
void release_departed(const TissueState& tissue, ToolRotation& last, ToolStates& states);

}  // namespace palpate
