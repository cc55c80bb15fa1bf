// Tools: where they are, what they hold there (tool_holds.hpp takes hold and lets go), and the force that each feels.
//
// A contact is welded to its tool. With the tool at the pose (p0, R0) where the contact is unstrained and the
// contact's place x at rest, its arm is a = R0^T (x - p0) in the tool's frame, and at the pose (p, R) it has
// moved by
//
//   d = (p - p0) + (R a - R0 a)
//
// and exerts the force f on the tissue, of torque (R a) x f about the tool's position. Where patches turn
// (patch_turns.hpp), its own turns by R R0^T, and what that takes is a torque of its own.
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

// Whether a contact was displaced when it was taken hold of. `brought` becomes `none` once the account has
// its energy.
enum class Strain : uint8_t { unknown, none, brought };

struct HeldContact {
  uint64_t id;  // no two contacts of a session have the same
  uint32_t tool;
  pal_contact_law law;
  pal_contact place;  // where it acts, without a displacement; `site` weighs most
  Strain strain;
  double unstrained[3];              // p0
  double unstrained_orientation[4];  // R0, and where it has slipped to (patch_turns.hpp)
  double unstrained_arm[3];          // R0 a, world
  double arm[3];                     // a, in the tool's frame
  double normal[3];                  // out of the tissue at rest, world; only of PAL_LAW_TOUCH
};

struct ToolState {
  pal_pose pose;    // the last that made sense
  pal_pose before;  // of the frame before
  bool has_pose;
  bool touches;
  bool must_leave;  // let go: it takes hold again only when it has been off the surface
  double age;       // s, of `pose`
  pal_touch touch;
  uint32_t near;  // where the last search for something to touch ended
  ForceOutput output;
};

struct ToolStates {
  Rotation organ;  // of pal_session_config::organ
  uint32_t num_contacts;
  HeldContact* contacts;        // [max_contacts] in the order in which they were taken hold of
  ToolState* tools;             // [max_tools]
  uint32_t num_used;            // of them: those behind were never seen, and cost a frame nothing
  pal_contact* inputs;          // [max_contacts] of the frame at hand
  double* turns;                // [max_contacts][3] of these, where patches turn (patch_turns.hpp)
  pal_contact_result* results;  // [max_contacts] of pal_contact_frame for who wants none
  uint64_t next_id;
  // The contacts that the last frame answered, by what, and of which contact held each is
  ResponseKind answered;
  uint32_t num_answered;
  uint64_t* answered_ids;                // [max_contacts]
  pal_contact* answered_inputs;          // [max_contacts]
  double* answered_turns;                // [max_contacts][3]
  uint32_t* answered_sites;              // [max_contacts] that the answers are about, where they jump with it
  pal_contact_result* answered_results;  // [max_contacts]
  uint32_t answered_fixed;               // pal_session::fixed_version then
  uint32_t* answered_of;  // [max_contacts] which of these each contact held is, or kNotAnswered
  // The contacts for which linear_dd or a zone is being made ready
  ResponseKind begun;
  uint32_t num_begun;
  uint64_t* begun_ids;        // [max_contacts]
  pal_contact* begun_inputs;  // [max_contacts]
  double* begun_turns;        // [max_contacts][3]
  uint32_t begun_fixed;
  bool held_changed;  // since the last frame: a contact was taken hold of or let go
  bool preparing;     // not all contacts held are answered, or not with the nodes that are fixed now
  bool changed;       // what answers, in this frame
  bool catches_up;    // a zone that was made anew has not got to where the tools are
  double dt;          // of the last frame in which it made sense
  Passivity passivity;
};

// A tool is about to be used.
inline void use_tool(ToolStates& states, uint32_t tool) {
  if (states.num_used <= tool) states.num_used = tool + 1;
}

// A tool that was never seen and holds nothing.
void reset_tool(ToolState& state);

// Takes the arrays of a session with this config.
void carve_tools(const pal_session_config& config, Arena& arena, ToolStates& states);

// One frame of all tools. `input` is complete and its pointers are valid. `results`: [max_tools].
void answer_tools(const pal_haptic_input& input, TissueState& tissue, ToolStates& states,
                  pal_tool_result* results);

}  // namespace palpate
