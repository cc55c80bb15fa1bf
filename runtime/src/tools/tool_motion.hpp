// The motion of held contacts with their tools.
#pragma once

#include "runtime/src/response/patch_rotation.hpp"
#include "runtime/src/tools/tools.hpp"

namespace palpate {

// Cache of the last tool's rotation: contacts of one tool are mostly neighbours in the list.
struct ToolRotation {
  Rotation rotation;
  uint32_t tool;  // kMostTools: empty
};

inline const Rotation& rotation_for(const ToolStates& states, uint32_t tool, ToolRotation& last) {
  if (last.tool != tool) last = {rotation_of(states.tools[tool].pose.orientation), tool};
  return last.rotation;
}

// The displacement of a contact since its hold began, world frame. Zero for a tool without a pose.
inline void movement_of(const ToolStates& states, const HeldContact& contact, ToolRotation& last,
                        double out[3]) {
  const ToolState& tool = states.tools[contact.tool];
  double arm[3];
  rotate(rotation_for(states, contact.tool, last), contact.arm, arm);
  for (int i = 0; i < 3; ++i) {
    out[i] = tool.has_pose
                 ? (tool.pose.position[i] - contact.unstrained[i]) + (arm[i] - contact.unstrained_arm[i])
                 : 0.0;
  }
}

// The rotation of a contact in the organ frame, for a tool of this orientation. Beyond a quarter turn the
// contact slips: its unstrained orientation rotates along, so that the torque does not jump.
inline void find_turn(const ToolStates& states, const double orientation[4], HeldContact& contact,
                      double turn[3]) {
  double in_world[3];
  turn_between(contact.unstrained_orientation, orientation, in_world);
  if (shorten_turn(in_world)) {
    double turned[4];
    quaternion_of(in_world, turned);
    divide_quaternions(turned, orientation, contact.unstrained_orientation);
  }
  rotate_back(states.organ, in_world, turn);
}

}  // namespace palpate
