#include "runtime/src/tools/tools.hpp"

#include <math.h>
#include <string.h>

#include <algorithm>

#include "runtime/src/pack/pack_view.hpp"
#include "runtime/src/response/patch_rotation.hpp"
#include "runtime/src/response/response.hpp"
#include "runtime/src/tools/fallback_contacts.hpp"
#include "runtime/src/tools/tool_holds.hpp"
#include "runtime/src/tools/tool_motion.hpp"

namespace palpate {
namespace {

constexpr double kLongestFrame = 1.0;  // s
// A strain below this fraction of the scene's largest displacement is rounding of poses.
constexpr double kLeastStrain = 1e-6;

// Keeps the larger of two error estimates. An estimate that is not a number counts as 1 (unknown).
void keep_worse(double estimate, double& worst) {
  if (!(estimate <= worst)) worst = isnan(estimate) ? 1.0 : estimate;
}

bool is_finite(const double (&matrix)[3][3]) {
  double zero = 0;
  for (const auto& row : matrix) {
    for (const double entry : row) zero += entry - entry;
  }
  return zero == 0;
}

bool holds_anything(const ToolStates& states, uint32_t tool) {
  for (uint32_t c = 0; c < states.num_contacts; ++c) {
    if (states.contacts[c].tool == tool) return true;
  }
  return false;
}

// Reads a tool's pose and age; without valid input the last pose ages. Returns false for invalid input.
bool read_input(const pal_haptic_input& input, uint32_t tool, double dt, ToolState& state) {
  const double age = input.ages != nullptr && tool < input.num_tools ? input.ages[tool] : 0.0;
  state.before = state.pose;
  if (tool < input.num_tools && age >= 0 && isfinite(age) && read_pose(input.poses[tool], state.pose)) {
    if (!state.has_pose) state.before = state.pose;
    state.has_pose = true;
    state.age = age;
    return true;
  }
  state.age += dt;
  return tool >= input.num_tools;
}

// Fills in the displacement and the rotation of every held contact, organ frame.
void fill_inputs(TissueState& tissue, ToolStates& states, ToolRotation& last) {
  for (uint32_t c = 0; c < states.num_contacts; ++c) {
    HeldContact& contact = states.contacts[c];
    const ToolState& tool = states.tools[contact.tool];
    double d[3];
    movement_of(states, contact, last, d);
    bool is_turned = false;
    if (has_turns(tissue)) {
      double* turn = states.turns + size_t{3} * c;
      memset(turn, 0, 3 * sizeof *turn);
      if (tool.has_pose) find_turn(states, tool.pose.orientation, contact, turn);
      for (int i = 0; i < 3; ++i) is_turned = is_turned || fabs(turn[i]) > kLeastStrain;
    }
    if (contact.strain == Strain::unknown && tool.has_pose) {
      const double least = kLeastStrain * tissue.pack->max_displacement * tissue.pack->metres;
      // Under turned gravity the tissue is away from its rest under the scene's gravity.
      const bool is_strained =
          tissue.gravity.is_turned || is_turned || d[0] * d[0] + d[1] * d[1] + d[2] * d[2] > least * least;
      contact.strain = is_strained ? Strain::uncounted : Strain::none;
      if (is_strained) states.held_changed = true;  // blends the force, as at the begin of a hold
    }
    states.inputs[c] = contact.place;
    rotate_back(states.organ, d, states.inputs[c].displacement);
  }
}

// Adds one contact's answer to its tool's wrench, and to its tool's result except the force, world frame.
void add_contact(const TissueState& tissue, const ToolStates& states, uint32_t index,
                 const Rotation& tool_rotation, Wrench& wrench, pal_tool_result& result) {
  const HeldContact& contact = states.contacts[index];
  const uint32_t answered = states.answered_index[index];
  if (result.num_contacts++ == 0) result.site = contact.place.site;
  if (states.preparing) result.flags |= PAL_FLAG_PREPARING;
  const bool is_alone = answered == kNotAnswered;
  const pal_contact_result& answer = is_alone ? states.results[index] : states.answered_results[answered];
  double force[3];
  double arm[3];
  rotate(states.organ, answer.force, force);
  rotate(tool_rotation, contact.arm, arm);
  for (int i = 0; i < 3; ++i) wrench.v[i] += force[i];
  add_cross(arm, force, wrench.v + 3);
  if (!is_alone && has_turns(tissue) && states.answered == ResponseKind::zone) {
    const ZoneSet& set = tissue.zone.active;
    double torque[3];
    rotate(states.organ, set.force + size_t{3} * (set.num_contacts + answered), torque);
    for (int i = 0; i < 3; ++i) wrench.v[3 + i] += torque[i] * (tissue.pack->newtons * tissue.pack->metres);
  }

  double stiffness[9];
  memcpy(stiffness, answer.stiffness, sizeof stiffness);
  for (uint32_t other = 0; other < states.num_contacts && !is_alone; ++other) {
    if (other == index || states.contacts[other].tool != contact.tool) continue;
    const uint32_t column = states.answered_index[other];
    if (column != kNotAnswered)
      add_coupling(tissue, states.answered, states.answered_results, answered, column, stiffness);
  }
  double turned[9];
  rotate_matrix(states.organ, stiffness, turned);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) result.stiffness[i][j] += turned[3 * i + j];
  }
  result.flags |= answer.flags;
  result.model = answer.model;
  keep_worse(answer.displacement_error, result.displacement_error);
  keep_worse(answer.force_error, result.force_error);
}

// Reduces the stiffness of a tool whose force is multiplied by `part`, and flags the result.
void reduce(double part, pal_tool_result& result) {
  if (part == 1.0 || result.num_contacts == 0) return;
  for (auto& row : result.stiffness) {
    for (double& component : row) component *= part;
  }
  result.flags |= PAL_FLAG_REDUCED;
}

// Whether the models' force on a tool is good. The force is unreliable in two cases:
// - A flag reports an ill-conditioned or non-finite answer.
// - A zone of its contacts has jammed (every step inverted an element) and has not converged since.
bool is_reliable(const ToolStates& states, const ZoneSet& set, uint32_t tool, uint32_t flags) {
  if ((flags & (PAL_FLAG_ILL_CONDITIONED | PAL_FLAG_NOT_FINITE)) != 0) return false;
  if ((flags & PAL_FLAG_UNCONVERGED) == 0) return true;
  if (states.tools[tool].output.held) return false;
  for (uint32_t g = 0; g < set.num_groups; ++g) {
    const ZoneGroup& group = set.groups[g];
    if (group.setbacks.jammed == 0) continue;
    for (uint32_t c = 0; c < states.num_contacts; ++c) {
      const uint32_t* end = group.contacts + group.num_contacts;
      if (states.contacts[c].tool == tool && std::find(group.contacts, end, states.answered_index[c]) != end)
        return false;
    }
  }
  return true;
}

// Holds the tissue at each tool that touches without a contact. Flags a tool that finds no room.
void begin_touches(const TissueState& tissue, ToolStates& states, uint32_t* tool_flags) {
  for (uint32_t tool = 0; tool < states.num_used; ++tool) {
    const ToolState& state = states.tools[tool];
    if (!state.touches || !state.has_pose || holds_anything(states, tool)) continue;
    if (!try_to_touch(tissue, tool, states)) tool_flags[tool] |= PAL_FLAG_NO_ROOM;
  }
}

// Multiplies the models' forces `wrenches` by Passivity::part, and holds and blends them.
void blend_forces(const TissueState& tissue, double dt, const bool* is_stale, Wrench* wrenches,
                  ToolStates& states, pal_tool_result* results) {
  for (uint32_t tool = 0; tool < states.num_used; ++tool) {
    ForceOutput& output = states.tools[tool].output;
    pal_tool_result& result = results[tool];
    reduce(states.passivity.part, result);
    for (double& component : wrenches[tool].v) component *= states.passivity.part;
    const bool reliable =
        is_finite(result.stiffness) && is_reliable(states, tissue.zone.active, tool, result.flags);
    result.flags |=
        blend_force(*tissue.config, reliable, states.changed, is_stale[tool], dt, wrenches[tool], output);
    if (output.held) memset(result.stiffness, 0, sizeof result.stiffness);
  }
}

// Limits and fades the blended forces `wrenches`, and fills in the forces of the results.
void output_forces(const pal_session_config& config, double dt, const bool* is_stale, Wrench* wrenches,
                   ToolStates& states, pal_tool_result* results) {
  const double share = limit_energy(states, wrenches);
  for (uint32_t tool = 0; tool < states.num_used; ++tool) {
    ForceOutput& output = states.tools[tool].output;
    pal_tool_result& result = results[tool];
    reduce(share, result);
    const bool is_model = (result.flags & (PAL_FLAG_BLENDING | PAL_FLAG_HELD | PAL_FLAG_REDUCED)) == 0;
    result.flags |= limit_force(config, is_model, is_stale[tool], dt, wrenches[tool], output);
    memcpy(result.force, output.out.v, sizeof result.force);
    memcpy(result.torque, output.out.v + 3, sizeof result.torque);
  }
}

}  // namespace

void reset_tool(ToolState& state) {
  state = {};
  state.pose.orientation[0] = 1;
  reset_output(state.output);
}

void carve_tools(const pal_session_config& config, Arena& arena, ToolStates& states) {
  states.contacts = arena.take<HeldContact>(config.max_contacts);
  states.tools = arena.take<ToolState>(config.max_tools);
  states.inputs = arena.take<pal_contact>(config.max_contacts);
  const size_t turns = config.patches_turn != 0 ? size_t{3} * config.max_contacts : 0;
  states.turns = arena.take<double>(turns);
  states.answered_turns = arena.take<double>(turns);
  states.begun_turns = arena.take<double>(turns);
  states.results = arena.take<pal_contact_result>(config.max_contacts);
  states.answered_index = arena.take<uint32_t>(config.max_contacts);
  states.begun_ids = arena.take<uint64_t>(config.max_contacts);
  states.begun_inputs = arena.take<pal_contact>(config.max_contacts);
  states.answered_ids = arena.take<uint64_t>(config.max_contacts);
  states.answered_inputs = arena.take<pal_contact>(config.max_contacts);
  states.answered_results = arena.take<pal_contact_result>(config.max_contacts);
  states.organ = rotation_of(config.organ.orientation);
}

void answer_tools(const pal_haptic_input& input, TissueState& tissue, ToolStates& states,
                  pal_tool_result* results) {
  const pal_session_config& config = *tissue.config;
  const bool dt_is_bad = !(input.dt >= 0 && input.dt <= kLongestFrame);
  if (!dt_is_bad) states.dt = input.dt;
  // A dt above kLongestFrame counts as kLongestFrame in this frame. Other bad dt count as the last valid dt.
  const double dt = isfinite(input.dt) && input.dt > kLongestFrame ? kLongestFrame : states.dt;

  if (input.num_tools > 0) use_tool(states, input.num_tools - 1);
  uint32_t tool_flags[kMostTools] = {};
  for (uint32_t tool = 0; tool < states.num_used; ++tool) {
    const bool read = read_input(input, tool, dt, states.tools[tool]);
    tool_flags[tool] = !read || dt_is_bad ? PAL_FLAG_BAD_INPUT : 0;
  }
  ToolRotation last = {{}, kMostTools};
  release_departed(tissue, last, states);
  begin_touches(tissue, states, tool_flags);
  fill_inputs(tissue, states, last);
  take_from_lane(tissue);
  answer_or_fall_back(tissue, states);
  tissue.energy_brought += tissue.zone.inclusion_energy * tissue.pack->newtons * tissue.pack->metres;
  tissue.zone.inclusion_energy = 0;
  states.energy_corrected = tissue.zone.corrected_energy * tissue.pack->newtons * tissue.pack->metres;
  tissue.zone.corrected_energy = 0;
  memcpy(tissue.gravity.before, tissue.gravity.now, sizeof tissue.gravity.before);
  tissue.gravity.has_changed = false;

  Wrench wrenches[kMostTools];
  memset(static_cast<void*>(results), 0, config.max_tools * sizeof *results);
  memset(static_cast<void*>(wrenches), 0, states.num_used * sizeof *wrenches);
  for (uint32_t c = 0; c < states.num_contacts; ++c) {
    const uint32_t tool = states.contacts[c].tool;
    add_contact(tissue, states, c, rotation_for(states, tool, last), wrenches[tool], results[tool]);
  }
  begin_account(tissue, states, wrenches);
  bool is_stale[kMostTools];
  for (uint32_t tool = 0; tool < states.num_used; ++tool) {
    const ToolState& state = states.tools[tool];
    results[tool].flags |= tool_flags[tool];
    is_stale[tool] = state.has_pose && config.stale_seconds > 0 && state.age > config.stale_seconds;
  }
  blend_forces(tissue, dt, is_stale, wrenches, states, results);
  output_forces(config, dt, is_stale, wrenches, states, results);
  end_account(states);
}

}  // namespace palpate
