#include "runtime/src/tools.hpp"

#include <math.h>
#include <string.h>

#include "runtime/src/floating_point_mode.hpp"
#include "runtime/src/pack_view.hpp"
#include "runtime/src/patch_turns.hpp"
#include "runtime/src/pose.hpp"
#include "runtime/src/response.hpp"
#include "runtime/src/session_state.hpp"
#include "runtime/src/sized_struct.hpp"
#include "runtime/src/stand_in.hpp"
#include "runtime/src/surface_bvh.hpp"

namespace palpate {
namespace {

constexpr uint32_t kFirstHoldBytes = 104;
constexpr uint32_t kFirstTouchBytes = 40;
static_assert(kFirstHoldBytes == sizeof(pal_hold) && kFirstTouchBytes == sizeof(pal_touch));
// PAL_LAW_TOUCH lets go where the place that it holds would be so far outside of where it was at rest, in
// mean edges of the surface: less is the tremor of a hand.
constexpr double kReleaseHeight = 0.01;
constexpr double kLongestFrame = 1.0;  // s
// In units of the scene's largest displacement: less is rounding of poses.
constexpr double kLeastStrain = 1e-6;

// The place of a point between sites at rest, world.
void place_at_rest(const pal_session& session, const uint32_t sites[3], const double weights[3],
                   double out[3]) {
  const pal_pack& pack = *session.pack;
  double in_metres[3] = {};
  for (int corner = 0; corner < 3; ++corner) {
    if (!(weights[corner] > 0)) continue;
    const double* position = pack.rest_positions + size_t{3} * pack.site_nodes[sites[corner]];
    for (int i = 0; i < 3; ++i) in_metres[i] += weights[corner] * (position[i] * pack.metres);
  }
  rotate(session.tools.organ, in_metres, out);
  for (int i = 0; i < 3; ++i) out[i] += session.config.organ.position[i];
}

// Out of the tissue at a point between sites, organ frame.
void normal_at(const pal_pack& pack, const uint32_t sites[3], const double weights[3], double out[3]) {
  double sum[3] = {};
  for (int corner = 0; corner < 3; ++corner) {
    if (!(weights[corner] > 0)) continue;
    const float* normal = pack.site_normals + size_t{3} * sites[corner];
    for (int i = 0; i < 3; ++i) sum[i] += weights[corner] * static_cast<double>(normal[i]);
  }
  const double length = sqrt(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]);
  for (int i = 0; i < 3; ++i) out[i] = length > 0 ? sum[i] / length : 0.0;
}

// The contact there, without a displacement. Its site is the corner of the largest weight, so that rounding leaves no
// weight to a corner that has none, whose site may be any number.
pal_contact contact_between(const uint32_t sites[3], const double weights[3]) {
  int largest = 0;
  for (int i = 1; i < 3; ++i) {
    if (weights[i] > weights[largest]) largest = i;
  }
  pal_contact contact = {};
  contact.site = sites[largest];
  for (int i = 0; i < 2; ++i) {
    const int corner = (largest + 1 + i) % 3;
    contact.neighbours[i] = sites[corner];
    contact.neighbour_weights[i] = weights[corner];
  }
  return contact;
}

bool holds_anything(const pal_session& session, uint32_t tool) {
  for (uint32_t c = 0; c < session.tools.num_contacts; ++c) {
    if (session.tools.contacts[c].tool == tool) return true;
  }
  return false;
}

bool has_room(const pal_session& session) {
  return session.tools.num_contacts < session.config.max_contacts &&
         can_answer(session, session.tools.num_contacts + 1);
}

// There is room. `normal`: organ frame.
void take_hold(pal_session& session, uint32_t tool, const uint32_t sites[3], const double weights[3],
               pal_contact_law law, const pal_pose& unstrained, const double normal[3]) {
  HeldContact& contact = session.tools.contacts[session.tools.num_contacts++];
  contact.id = ++session.tools.next_id;
  session.tools.held_changed = true;
  contact.tool = tool;
  contact.place = contact_between(sites, weights);
  contact.law = law;
  contact.strain = Strain::unknown;
  memcpy(contact.unstrained, unstrained.position, sizeof contact.unstrained);
  memcpy(contact.unstrained_orientation, unstrained.orientation, sizeof contact.unstrained_orientation);
  place_at_rest(session, sites, weights, contact.unstrained_arm);
  for (int i = 0; i < 3; ++i) contact.unstrained_arm[i] -= unstrained.position[i];
  rotate_back(rotation_of(unstrained.orientation), contact.unstrained_arm, contact.arm);
  rotate(session.tools.organ, normal, contact.normal);
}

// Keeps the order of those that stay: linear_dd then need not factor anew where the last ones go.
template <typename Goes>
void let_go(pal_session& session, Goes&& goes) {
  ToolStates& states = session.tools;
  uint32_t kept = 0;
  for (uint32_t c = 0; c < states.num_contacts; ++c) {
    if (goes(states.contacts[c])) continue;
    if (kept != c) states.contacts[kept] = states.contacts[c];
    ++kept;
  }
  states.held_changed = states.held_changed || kept != states.num_contacts;
  states.num_contacts = kept;
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

// The point of the surface nearest to the tool's tip. False where there is none.
bool find_near_tip(const pal_session& session, ToolState& state, SurfaceHit& hit) {
  double tip[3];
  rotate(rotation_of(state.pose.orientation), state.touch.tip, tip);
  for (int i = 0; i < 3; ++i) tip[i] += state.pose.position[i] - session.config.organ.position[i];
  double place[3];
  rotate_back(session.tools.organ, tip, place);
  for (double& component : place) component /= session.pack->metres;
  if (!find_nearest_surface_point(*session.pack, place, state.near, hit)) return false;
  state.near = hit.primitive;
  return true;
}

// Looks for something to take hold of. False where there is something and no room for it.
bool try_to_touch(pal_session& session, uint32_t tool, ToolState& state) {
  SurfaceHit hit;
  if (!find_near_tip(session, state, hit)) return true;
  if (!(hit.distance * session.pack->metres <= state.touch.distance)) {
    state.must_leave = false;
    return true;
  }
  // Deeper it has not just come in, but is beyond a part of the organ that cannot be touched.
  if (state.must_leave || hit.distance < -session.pack->max_displacement) return true;
  if (!has_room(session)) return false;
  take_hold(session, tool, hit.sites, hit.weights, state.touch.law, state.pose, hit.normal);
  return true;
}

struct ToolRotation {
  Rotation rotation;
  uint32_t tool;  // kMostTools: of none
};

// Of a contact's tool; contacts of one tool mostly follow one another.
const Rotation& rotation_for(const pal_session& session, uint32_t tool, ToolRotation& last) {
  if (last.tool != tool) last = {rotation_of(session.tools.tools[tool].pose.orientation), tool};
  return last.rotation;
}

// How far a contact has moved from where its tool took hold, world; not at all for a tool that was never
// seen.
void movement_of(const pal_session& session, const HeldContact& contact, ToolRotation& last, double out[3]) {
  const ToolState& tool = session.tools.tools[contact.tool];
  double arm[3];
  rotate(rotation_for(session, contact.tool, last), contact.arm, arm);
  for (int i = 0; i < 3; ++i) {
    out[i] = tool.has_pose
                 ? (tool.pose.position[i] - contact.unstrained[i]) + (arm[i] - contact.unstrained_arm[i])
                 : 0.0;
  }
}

// A contact of PAL_LAW_TOUCH is let go where its tool has come out beyond where it took hold, or, if it knows
// its tip, out of the organ anywhere else.
void let_go_of_what_came_out(pal_session& session, ToolRotation& last) {
  const double height = kReleaseHeight * session.pack->mean_surface_edge * session.pack->metres;
  uint32_t is_outside = 0;  // a bit for each tool
  uint32_t is_known = 0;
  let_go(session, [&](const HeldContact& contact) {
    if (contact.law != PAL_LAW_TOUCH) return false;
    ToolState& tool = session.tools.tools[contact.tool];
    const uint32_t bit = 1u << contact.tool;
    if (tool.touches && (is_known & bit) == 0) {
      SurfaceHit hit;
      is_known |= bit;
      if (find_near_tip(session, tool, hit) &&
          hit.distance * session.pack->metres > tool.touch.distance + height)
        is_outside |= bit;
    }
    double d[3];
    movement_of(session, contact, last, d);
    const bool is_out =
        (is_outside & bit) != 0 ||
        d[0] * contact.normal[0] + d[1] * contact.normal[1] + d[2] * contact.normal[2] > height;
    if (is_out) tool.must_leave = true;
    return is_out;
  });
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

// `hold` becomes the caller's, completed. PAL_STATUS_OK where it can be held.
pal_status read_hold(const pal_session& session, const pal_hold& given, pal_hold& hold) {
  if (const pal_status status = read_sized(given, kFirstHoldBytes, hold); status != PAL_STATUS_OK)
    return status;
  int law;
  static_assert(sizeof law == sizeof hold.law);
  memcpy(&law, &hold.law, sizeof law);
  if (law != PAL_LAW_BONDED && law != PAL_LAW_TOUCH) return PAL_STATUS_BAD_ARGUMENT;
  double sum = 0;
  for (int i = 0; i < 3; ++i) {
    if (!isfinite(hold.weights[i])) return PAL_STATUS_NOT_FINITE;
    if (hold.weights[i] < 0) return PAL_STATUS_BAD_ARGUMENT;
    if (hold.weights[i] > 0 && hold.sites[i] >= session.pack->num_sites) return PAL_STATUS_NO_SUCH_SITE;
    sum += hold.weights[i];
  }
  constexpr double kRounding = 1e-6;
  if (!(fabs(sum - 1.0) <= kRounding)) return PAL_STATUS_BAD_ARGUMENT;
  if (!read_pose(hold.unstrained, hold.unstrained)) return PAL_STATUS_BAD_ARGUMENT;
  return law == PAL_LAW_TOUCH && session.pack->site_normals == nullptr ? PAL_STATUS_NO_SUCH_MODEL
                                                                       : PAL_STATUS_OK;
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
  begin_account(session);
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
  for (uint32_t tool = 0; tool < states.num_used; ++tool) {
    ToolState& state = states.tools[tool];
    pal_tool_result& result = all[tool];
    result.flags |= own_flags[tool];
    if (states.passivity.part < 1.0) reduce(states.passivity.part, wrenches[tool], result);
    const bool stale = state.has_pose && config.stale_seconds > 0 && state.age > config.stale_seconds;
    if (result.num_contacts == 0 && state.output.quiet && !stale) continue;
    result.flags |= filter_force(config, wrenches[tool], states.changed, stale, states.dt, state.output);
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

extern "C" pal_status pal_tool_hold(pal_session* session, uint32_t tool, const pal_hold* given) noexcept {
  if (session == nullptr || given == nullptr) return PAL_STATUS_NULL_ARGUMENT;
  if (tool >= session->config.max_tools) return PAL_STATUS_NO_SUCH_TOOL;
  const palpate::FloatingPointMode mode;
  pal_hold hold = {};
  if (const pal_status status = palpate::read_hold(*session, *given, hold); status != PAL_STATUS_OK)
    return status;
  const uint32_t held = session->tools.num_contacts;
  if (held >= session->config.max_contacts) return PAL_STATUS_CAPACITY_EXCEEDED;
  if (!palpate::can_answer(*session, held + 1)) return PAL_STATUS_MODEL_CANNOT_ANSWER;
  double normal[3] = {};
  if (session->pack->site_normals != nullptr)
    palpate::normal_at(*session->pack, hold.sites, hold.weights, normal);
  palpate::use_tool(session->tools, tool);
  palpate::take_hold(*session, tool, hold.sites, hold.weights, hold.law, hold.unstrained, normal);
  session->used = true;
  palpate::record_hold(*session, tool, hold);
  return PAL_STATUS_OK;
}

extern "C" pal_status pal_tool_release(pal_session* session, uint32_t tool) noexcept {
  if (session == nullptr) return PAL_STATUS_NULL_ARGUMENT;
  if (tool >= session->config.max_tools) return PAL_STATUS_NO_SUCH_TOOL;
  palpate::let_go(*session, [&](const palpate::HeldContact& contact) { return contact.tool == tool; });
  session->tools.tools[tool].must_leave = true;
  session->used = true;
  palpate::record_release(*session, tool);
  return PAL_STATUS_OK;
}

extern "C" pal_status pal_tool_set_touch(pal_session* session, uint32_t tool,
                                         const pal_touch* given) noexcept {
  if (session == nullptr) return PAL_STATUS_NULL_ARGUMENT;
  if (tool >= session->config.max_tools) return PAL_STATUS_NO_SUCH_TOOL;
  palpate::ToolState& state = session->tools.tools[tool];
  if (given == nullptr) {
    state.touches = false;
    session->used = true;
    palpate::record_touch(*session, tool, nullptr);
    return PAL_STATUS_OK;
  }
  if (session->pack->site_normals == nullptr) return PAL_STATUS_NO_SUCH_MODEL;
  const palpate::FloatingPointMode mode;
  pal_touch touch = {};
  if (const pal_status status = palpate::read_sized(*given, palpate::kFirstTouchBytes, touch);
      status != PAL_STATUS_OK)
    return status;
  int law;
  memcpy(&law, &touch.law, sizeof law);
  if (law != PAL_LAW_BONDED && law != PAL_LAW_TOUCH) return PAL_STATUS_BAD_ARGUMENT;
  for (const double number : {touch.tip[0], touch.tip[1], touch.tip[2], touch.distance}) {
    if (!(fabs(number) <= palpate::kMostPosition)) return PAL_STATUS_NOT_FINITE;
  }
  palpate::use_tool(session->tools, tool);
  state.touch = touch;
  state.touches = true;
  session->used = true;
  palpate::record_touch(*session, tool, &touch);
  return PAL_STATUS_OK;
}
