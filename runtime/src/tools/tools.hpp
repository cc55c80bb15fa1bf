// Tools: their poses, their contacts (tool_holds.hpp) and the force on each.
//
// A contact is welded to its tool. Let (p0, R0) be the tool's pose where the contact is unstrained, and x the
// contact's place at rest. The contact's arm in the tool's frame is a = R0^T (x - p0). At the pose (p, R) the
// contact has moved by
//
//    d = (p - p0) + (R a - R0 a).
//
// The contact exerts the force f on the tissue, and the torque (R a) x f about the tool's position. If
// patches rotate (patch_rotation.hpp), the patch rotates by R R0^T and adds its own torque.
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/base/arena.hpp"
#include "runtime/src/numerics/pose.hpp"
#include "runtime/src/response/response_kind.hpp"
#include "runtime/src/response/tissue_state.hpp"
#include "runtime/src/tools/force_output.hpp"
#include "runtime/src/tools/passivity.hpp"

namespace palpate {

inline constexpr uint32_t kMostTools = 16;
inline constexpr uint32_t kNotAnswered = UINT32_MAX;

// Whether a contact was displaced when its hold began: `uncounted` until the energy account (passivity.hpp)
// has the contact's energy, then `none`.
enum class Strain : uint8_t { unknown, none, uncounted };

struct HeldContact {
  uint64_t id;  // unique in the session
  uint32_t tool;
  pal_contact_law law;
  pal_contact place;  // place of the contact, without a displacement; `site` has the largest weight
  Strain strain;
  double unstrained[3];              // p0
  double unstrained_orientation[4];  // R0, after any slip (find_turn())
  double unstrained_arm[3];          // R0 a, world
  double arm[3];                     // a, in the tool's frame
  double normal[3];                  // outward normal of the tissue at rest, world; only for PAL_LAW_TOUCH
};

struct ToolState {
  pal_pose pose;       // the last valid pose
  pal_pose before;     // pose in the last frame
  Motion motion;       // from `before` to `pose`
  Motion last_motion;  // the last translation and turn that were not zero
  bool has_pose;
  bool touches;
  bool must_leave;  // after a release, the tool must leave the surface before its next hold
  double age;       // s, of `pose`
  pal_touch touch;
  uint32_t near_primitive;  // primitive of the last surface point, where the next search starts
  ForceOutput output;
};

struct ToolStates {
  Rotation organ;  // rotation of pal_session_config::organ
  uint32_t num_contacts;
  HeldContact* contacts;  // [max_contacts] in order of id
  ToolState* tools;       // [max_tools]
  uint32_t num_used;      // tools seen so far: tools at and beyond this index cost a frame nothing
  pal_contact* inputs;    // [max_contacts] contacts of this frame
  double* turns;          // [max_contacts][3] rotations of `inputs`, if patches rotate (patch_rotation.hpp)
  // [max_contacts] answers as if alone, for contacts outside the answered set. pal_contact_frame uses the
  // array if the caller gives no results.
  pal_contact_result* results;
  uint64_t next_id;
  double energy_corrected;  // J: change of W by deliveries of the refining lane since the last frame
  // The contacts that the last frame answered, their model, and their match with the held contacts:
  ResponseKind answered;
  uint32_t num_answered;
  uint64_t* answered_ids;                // [max_contacts]
  pal_contact* answered_inputs;          // [max_contacts]
  double* answered_turns;                // [max_contacts][3]
  uint64_t answered_zone;                // number of the zone's set: the answer jumps when the set changes
  pal_contact_result* answered_results;  // [max_contacts]
  uint32_t answered_fixed;               // TissueState::fixed_version at that time
  uint32_t* answered_index;  // [max_contacts] index of a held contact in the answered set, or kNotAnswered
  // The contacts for which linear_dd or, in a session with zones, a zone is in preparation:
  ResponseKind begun;
  uint32_t num_begun;
  uint64_t* begun_ids;        // [max_contacts]
  pal_contact* begun_inputs;  // [max_contacts]
  double* begun_turns;        // [max_contacts][3]
  uint32_t begun_fixed;
  bool held_changed;  // a hold began or ended since the last frame
  bool preparing;     // some held contact or fixed node is not part of the answer yet
  bool changed;       // the response has changed in this frame
  bool catches_up;    // a new zone has not reached the tools yet
  double dt;          // last valid time step, s
  Passivity passivity;
};

// Counts a tool as used.
inline void use_tool(ToolStates& states, uint32_t tool) {
  if (states.num_used <= tool) states.num_used = tool + 1;
}

// Resets a tool to the state without pose and touch.
void reset_tool(ToolState& state);

// Takes the arrays for this config from the arena.
void carve_tools(const pal_session_config& config, Arena& arena, ToolStates& states);

// Computes one frame of all tools. `input` is complete and its pointers are valid. `results`: [max_tools].
void answer_tools(const pal_haptic_input& input, TissueState& tissue, ToolStates& states,
                  pal_tool_result* results);

}  // namespace palpate
