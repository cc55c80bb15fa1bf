// What tools hold: a contact taken hold of by the caller (pal_tool_hold) or where a tool's tip comes near the
// surface (pal_tool_set_touch), and let go by the caller or where the tool leaves the tissue.
#pragma once

#include "runtime/src/session_state.hpp"

namespace palpate {

// The rotation of the tool that was asked for last: contacts of one tool mostly follow one another.
struct ToolRotation {
  Rotation rotation;
  uint32_t tool;  // kMostTools: of none
};

inline const Rotation& rotation_for(const pal_session& session, uint32_t tool, ToolRotation& last) {
  if (last.tool != tool) last = {rotation_of(session.tools.tools[tool].pose.orientation), tool};
  return last.rotation;
}

// How far a contact has moved from where its tool took hold, world; not at all for a tool that was never
// seen.
inline void movement_of(const pal_session& session, const HeldContact& contact, ToolRotation& last,
                        double out[3]) {
  const ToolState& tool = session.tools.tools[contact.tool];
  double arm[3];
  rotate(rotation_for(session, contact.tool, last), contact.arm, arm);
  for (int i = 0; i < 3; ++i) {
    out[i] = tool.has_pose
                 ? (tool.pose.position[i] - contact.unstrained[i]) + (arm[i] - contact.unstrained_arm[i])
                 : 0.0;
  }
}

// Looks for something to take hold of. False where there is something and no room for it.
bool try_to_touch(pal_session& session, uint32_t tool, ToolState& state);

// A contact of PAL_LAW_TOUCH is let go where its tool has come out beyond where it took hold, or, if it knows
// its tip, out of the organ anywhere else.
void let_go_of_what_came_out(pal_session& session, ToolRotation& last);

}  // namespace palpate
