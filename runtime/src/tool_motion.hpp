// How far what tools hold has moved with them.
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

}  // namespace palpate
