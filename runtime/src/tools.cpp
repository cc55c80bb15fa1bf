#include "runtime/src/tools.hpp"

#include <math.h>
#include <string.h>

#include <algorithm>

#include "runtime/src/pack_view.hpp"
#include "runtime/src/patch_turns.hpp"
#include "runtime/src/response.hpp"
#include "runtime/src/stand_in.hpp"
#include "runtime/src/tool_holds.hpp"
#include "runtime/src/tool_motion.hpp"

namespace palpate {
namespace {

constexpr double kLongestFrame = 1.0;  // s
// In units of the scene's largest displacement: less is rounding of poses.
constexpr double kLeastStrain = 1e-6;

bool holds_anything(const pal_session& session, uint32_t tool) {
  for (uint32_t c = 0; c < session.tools.num_contacts; ++c) {
    if (session.tools.contacts[c].tool == tool) return true;
  }
  return false;
}

// Takes in a tool's pose and its age. False where they make no sense, or are not there: the last pose then
// ages.
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

// The displacement of every contact held, and how it is turned, organ frame.
void fill_inputs(pal_session& session, ToolRotation& last) {
  for (uint32_t c = 0; c < session.tools.num_contacts; ++c) {
    HeldContact& contact = session.tools.contacts[c];
    const ToolState& tool = session.tools.tools[contact.tool];
    double d[3];
    movement_of(session, contact, last, d);
    bool is_turned = false;
    if (has_turns(session)) {
      double* turn = session.tools.turns + size_t{3} * c;
      memset(turn, 0, 3 * sizeof *turn);
      if (tool.has_pose) find_turn(session, tool.pose.orientation, contact, turn);
      for (int i = 0; i < 3; ++i) is_turned = is_turned || fabs(turn[i]) > kLeastStrain;
    }
    if (contact.strain == Strain::unknown && tool.has_pose) {
      const double least = kLeastStrain * session.pack->max_displacement * session.pack->metres;
      // Where gravity has turned, tissue is not where it rests under the scene's.
      const bool is_strained =
          session.gravity_turned || is_turned || d[0] * d[0] + d[1] * d[1] + d[2] * d[2] > least * least;
      contact.strain = is_strained ? Strain::brought : Strain::none;
      if (is_strained) session.tools.held_changed = true;  // as where the tool was seen late
    }
    session.tools.inputs[c] = contact.place;
    rotate_back(session.tools.organ, d, session.tools.inputs[c].displacement);
  }
}

// Adds what the model says of one contact to the force of its tool and to all but that of its result, world.
void add_contact(const pal_session& session, uint32_t index, const Rotation& own, Wrench& wrench,
                 pal_tool_result& result) {
  const ToolStates& states = session.tools;
  const HeldContact& contact = states.contacts[index];
  const uint32_t answered = states.answered_of[index];
  if (result.num_contacts++ == 0) result.site = contact.place.site;
  if (states.preparing) result.flags |= PAL_FLAG_PREPARING;
  if (answered == kNotAnswered) {
    result.displacement_error = result.force_error = 1.0;
    return;
  }
  const pal_contact_result& answer = states.answered_results[answered];
  double force[3];
  double arm[3];
  rotate(states.organ, answer.force, force);
  rotate(own, contact.arm, arm);
  for (int i = 0; i < 3; ++i) wrench.v[i] += force[i];
  add_cross(arm, force, wrench.v + 3);
  if (has_turns(session) && states.answered == Answering::zone) {
    const ZoneSet& set = session.zone.answering;
    double torque[3];
    rotate(states.organ, set.force + size_t{3} * (set.num_contacts + answered), torque);
    for (int i = 0; i < 3; ++i) wrench.v[3 + i] += torque[i] * (session.pack->newtons * session.pack->metres);
  }

  double stiffness[9];
  memcpy(stiffness, answer.stiffness, sizeof stiffness);
  for (uint32_t other = 0; other < states.num_contacts; ++other) {
    if (other == index || states.contacts[other].tool != contact.tool) continue;
    const uint32_t column = states.answered_of[other];
    if (column != kNotAnswered)
      add_coupling(session, states.answered, states.answered_results, answered, column, stiffness);
  }
  double turned[9];
  rotate_matrix(states.organ, stiffness, turned);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) result.stiffness[i][j] += turned[3 * i + j];
  }
  result.flags |= answer.flags;
  result.model = answer.model;
  if (answer.displacement_error > result.displacement_error)
    result.displacement_error = answer.displacement_error;
  if (answer.force_error > result.force_error) result.force_error = answer.force_error;
}

void reduce(double part, Wrench& wrench, pal_tool_result& result) {
  if (result.num_contacts == 0) return;
  for (double& component : wrench.v) component *= part;
  for (auto& row : result.stiffness) {
    for (double& component : row) component *= part;
  }
  result.flags |= PAL_FLAG_REDUCED;
}

// Whether the models' force on a tool is good. It may have any value where flags say so, and from the frame in which a zone
// of the tool's contacts jams, which is when no step of theirs leaves all elements upright, until the zone has converged.
bool is_reliable(const pal_session& session, uint32_t tool, uint32_t flags) {
  if ((flags & (PAL_FLAG_ILL_CONDITIONED | PAL_FLAG_NOT_FINITE)) != 0) return false;
  if ((flags & PAL_FLAG_UNCONVERGED) == 0) return true;
  const ToolStates& states = session.tools;
  if (states.tools[tool].output.held) return false;
  const ZoneSet& set = session.zone.answering;
  for (uint32_t g = 0; g < set.num_groups; ++g) {
    const ZoneGroup& group = set.groups[g];
    for (uint32_t c = 0; c < states.num_contacts && group.jammed > 0; ++c) {
      const uint32_t* end = group.contacts + group.num_contacts;
      if (states.contacts[c].tool == tool && std::find(group.contacts, end, states.answered_of[c]) != end)
        return false;
    }
  }
  return true;
}

// Frames in which some tool had a flag.
void count_frame(const pal_tool_result* results, uint32_t count, bool switched, pal_counters& counters) {
  uint32_t flags = 0;
  for (uint32_t tool = 0; tool < count; ++tool) flags |= results[tool].flags;
  ++counters.frames;
  counters.switches += switched ? 1 : 0;
  if (flags == 0) return;
  const auto has = [&](uint32_t flag) -> uint64_t { return (flags & flag) != 0 ? 1 : 0; };
  counters.preparing += has(PAL_FLAG_PREPARING);
  counters.extrapolated += has(PAL_FLAG_EXTRAPOLATED);
  counters.bad_input += has(PAL_FLAG_BAD_INPUT);
  counters.stale += has(PAL_FLAG_STALE);
  counters.limited += has(PAL_FLAG_LIMITED);
  counters.reduced += has(PAL_FLAG_REDUCED);
}

}  // namespace

void reset_tool(ToolState& state) {
  state = {};
  state.pose.orientation[0] = 1;
  reset_output(state.output);
}

// Once a session: small.
[[gnu::cold]] void carve_tools(const pal_session_config& config, Arena& arena, ToolStates& states) {
  states.contacts = arena.take<HeldContact>(config.max_contacts);
  states.tools = arena.take<ToolState>(config.max_tools);
  states.inputs = arena.take<pal_contact>(config.max_contacts);
  const size_t turns = config.patches_turn != 0 ? size_t{3} * config.max_contacts : 0;
  states.turns = arena.take<double>(turns);
  states.answered_turns = arena.take<double>(turns);
  states.begun_turns = arena.take<double>(turns);
  states.results = arena.take<pal_contact_result>(config.max_contacts);
  states.answered_of = arena.take<uint32_t>(config.max_contacts);
  states.begun_ids = arena.take<uint64_t>(config.max_contacts);
  states.begun_inputs = arena.take<pal_contact>(config.max_contacts);
  states.answered_ids = arena.take<uint64_t>(config.max_contacts);
  states.answered_inputs = arena.take<pal_contact>(config.max_contacts);
  states.answered_sites = arena.take<uint32_t>(config.max_contacts);
  states.answered_results = arena.take<pal_contact_result>(config.max_contacts);
  states.organ = rotation_of(config.organ.orientation);
}

void answer_tools(pal_session& session, const pal_haptic_input& input, pal_tool_result* results) {
  ToolStates& states = session.tools;
  const pal_session_config& config = session.config;
  const bool dt_is_bad = !(input.dt >= 0 && input.dt <= kLongestFrame);
  if (input.dt >= 0) states.dt = input.dt <= kLongestFrame ? input.dt : kLongestFrame;

  if (input.num_tools > 0) use_tool(states, input.num_tools - 1);
  uint32_t own_flags[kMostTools] = {};
  for (uint32_t tool = 0; tool < states.num_used; ++tool) {
    const bool read = read_input(input, tool, states.dt, states.tools[tool]);
    own_flags[tool] = !read || dt_is_bad ? PAL_FLAG_BAD_INPUT : 0;
  }
  ToolRotation last = {{}, kMostTools};
  let_go_of_what_came_out(session, last);
  for (uint32_t tool = 0; tool < states.num_used; ++tool) {
    ToolState& state = states.tools[tool];
    if (!state.touches || !state.has_pose || holds_anything(session, tool)) continue;
    if (!try_to_touch(session, tool, state)) own_flags[tool] |= PAL_FLAG_NO_ROOM;
  }
  fill_inputs(session, last);
  answer_or_stand_in(session);
  session.energy_brought += session.zone.inclusion_energy * session.pack->newtons * session.pack->metres;
  session.zone.inclusion_energy = 0;
  memcpy(session.turn_before, session.gravity_turn, sizeof session.turn_before);
  session.gravity_changed = false;

  pal_tool_result local[kMostTools];
  const uint32_t num_results = results == nullptr                     ? 0
                               : input.num_results < config.max_tools ? input.num_results
                                                                      : config.max_tools;
  // Where the caller has room for all of ours, they are made in their place.
  const bool in_place =
      results != nullptr && input.result_bytes == sizeof *results && num_results == config.max_tools;
  pal_tool_result* all = in_place ? results : local;
  Wrench wrenches[kMostTools];
  memset(static_cast<void*>(all), 0, config.max_tools * sizeof *all);
  memset(static_cast<void*>(wrenches), 0, states.num_used * sizeof *wrenches);
  for (uint32_t c = 0; c < states.num_contacts; ++c) {
    const uint32_t tool = states.contacts[c].tool;
    add_contact(session, c, rotation_for(session, tool, last), wrenches[tool], all[tool]);
  }
  begin_account(session, wrenches);
  for (uint32_t tool = 0; tool < states.num_used; ++tool) {
    ToolState& state = states.tools[tool];
    pal_tool_result& result = all[tool];
    result.flags |= own_flags[tool];
    if (states.passivity.part < 1.0) reduce(states.passivity.part, wrenches[tool], result);
    const bool stale = state.has_pose && config.stale_seconds > 0 && state.age > config.stale_seconds;
    if (result.num_contacts == 0 && state.output.quiet && !stale) continue;
    const bool reliable = is_reliable(session, tool, result.flags);
    result.flags |=
        filter_force(config, wrenches[tool], reliable, states.changed, stale, states.dt, state.output);
    if (state.output.held) memset(result.stiffness, 0, sizeof result.stiffness);
    memcpy(result.force, state.output.out.v, sizeof result.force);
    memcpy(result.torque, state.output.out.v + 3, sizeof result.torque);
  }
  end_account(session);
  count_frame(all, states.num_used, states.changed, session.counters);
  record_haptic_frame(session, input, all);
  if (in_place) return;
  unsigned char* to = reinterpret_cast<unsigned char*>(results);
  for (uint32_t tool = 0; tool < num_results; ++tool, to += input.result_bytes) {
    memcpy(to, all + tool, sizeof *all);
    if (input.result_bytes > sizeof *all) memset(to + sizeof *all, 0, input.result_bytes - sizeof *all);
  }
}

}  // namespace palpate
