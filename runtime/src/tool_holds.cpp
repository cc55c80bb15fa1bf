#include "runtime/src/tool_holds.hpp"

#include <math.h>
#include <string.h>

#include "runtime/src/floating_point_mode.hpp"
#include "runtime/src/pack_view.hpp"
#include "runtime/src/recording.hpp"
#include "runtime/src/response.hpp"
#include "runtime/src/sized_struct.hpp"
#include "runtime/src/surface_bvh.hpp"

namespace palpate {
namespace {

constexpr uint32_t kFirstHoldBytes = 104;
constexpr uint32_t kFirstTouchBytes = 40;
static_assert(kFirstHoldBytes == sizeof(pal_hold) && kFirstTouchBytes == sizeof(pal_touch));
// PAL_LAW_TOUCH lets go where the place that it holds would be so far outside of where it was at rest, in
// mean edges of the surface: less is the tremor of a hand.
constexpr double kReleaseHeight = 0.01;

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
