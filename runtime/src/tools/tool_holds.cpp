#include "runtime/src/tools/tool_holds.hpp"

#include <math.h>
#include <string.h>

#include "runtime/src/pack/pack_view.hpp"
#include "runtime/src/pack/surface_bvh.hpp"
#include "runtime/src/response/response.hpp"

namespace palpate {
namespace {

// PAL_LAW_TOUCH releases a contact that is farther than this above its place at rest, in mean surface edges.
// A hand's tremor stays below this height.
constexpr double kReleaseHeight = 0.01;

// The rest place of a point between sites, world frame.
void place_at_rest(const TissueState& tissue, const ToolStates& states, const uint32_t sites[3],
                   const double weights[3], double out[3]) {
  const pal_pack& pack = *tissue.pack;
  double in_metres[3] = {};
  for (int corner = 0; corner < 3; ++corner) {
    if (!(weights[corner] > 0)) continue;
    const double* position = pack.rest_positions + size_t{3} * pack.site_nodes[sites[corner]];
    for (int i = 0; i < 3; ++i) in_metres[i] += weights[corner] * (position[i] * pack.metres);
  }
  rotate(states.organ, in_metres, out);
  for (int i = 0; i < 3; ++i) out[i] += tissue.config->organ.position[i];
}

// The outward normal at a point between sites, organ frame.
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

// The contact at this point, without a displacement. Its site is the corner of the largest weight: a corner
// of weight zero may name any site.
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

bool has_room(const TissueState& tissue, const ToolStates& states) {
  return states.num_contacts < tissue.config->max_contacts && can_answer(tissue, states.num_contacts + 1);
}

// The caller has checked the capacity. `normal`: organ frame.
void hold_place(const TissueState& tissue, uint32_t tool, const uint32_t sites[3], const double weights[3],
                pal_contact_law law, const pal_pose& unstrained, const double normal[3], ToolStates& states) {
  HeldContact& contact = states.contacts[states.num_contacts++];
  contact.id = ++states.next_id;
  states.held_changed = true;
  contact.tool = tool;
  contact.place = contact_between(sites, weights);
  contact.law = law;
  contact.strain = Strain::unknown;
  memcpy(contact.unstrained, unstrained.position, sizeof contact.unstrained);
  memcpy(contact.unstrained_orientation, unstrained.orientation, sizeof contact.unstrained_orientation);
  place_at_rest(tissue, states, sites, weights, contact.unstrained_arm);
  for (int i = 0; i < 3; ++i) contact.unstrained_arm[i] -= unstrained.position[i];
  rotate_back(rotation_of(unstrained.orientation), contact.unstrained_arm, contact.arm);
  rotate(states.organ, normal, contact.normal);
}

// Releases contacts and keeps the order of the remaining contacts. linear_dd then need not factor anew when
// only the last contacts leave.
template <typename IsReleased>
void release_where(ToolStates& states, IsReleased&& is_released) {
  uint32_t kept = 0;
  for (uint32_t c = 0; c < states.num_contacts; ++c) {
    if (is_released(states.contacts[c])) continue;
    if (kept != c) states.contacts[kept] = states.contacts[c];
    ++kept;
  }
  states.held_changed = states.held_changed || kept != states.num_contacts;
  states.num_contacts = kept;
}

// The surface point nearest to the tool's tip. False if the pack has no surface tree.
bool find_near_tip(const TissueState& tissue, const Rotation& organ, ToolState& state, SurfaceHit& hit) {
  double tip[3];
  rotate(rotation_of(state.pose.orientation), state.touch.tip, tip);
  for (int i = 0; i < 3; ++i) tip[i] += state.pose.position[i] - tissue.config->organ.position[i];
  double place[3];
  rotate_back(organ, tip, place);
  for (double& component : place) component /= tissue.pack->metres;
  if (!find_nearest_surface_point(*tissue.pack, place, state.near_primitive, hit)) return false;
  state.near_primitive = hit.primitive;
  return true;
}

}  // namespace

void take_hold(const TissueState& tissue, uint32_t tool, const pal_hold& hold, ToolStates& states) {
  double normal[3] = {};
  if (tissue.pack->site_normals != nullptr) normal_at(*tissue.pack, hold.sites, hold.weights, normal);
  hold_place(tissue, tool, hold.sites, hold.weights, hold.law, hold.unstrained, normal, states);
}

void release_contacts(uint32_t tool, ToolStates& states) {
  release_where(states, [&](const HeldContact& contact) { return contact.tool == tool; });
  states.tools[tool].must_leave = true;
}

bool try_to_touch(const TissueState& tissue, uint32_t tool, ToolStates& states) {
  ToolState& state = states.tools[tool];
  SurfaceHit hit;
  if (!find_near_tip(tissue, states.organ, state, hit)) return true;
  if (!(hit.distance * tissue.pack->metres <= state.touch.distance)) {
    state.must_leave = false;
    return true;
  }
  // A deeper tip has entered through a part of the organ that no tool can touch.
  if (state.must_leave || hit.distance < -tissue.pack->max_displacement) return true;
  if (!has_room(tissue, states)) return false;
  hold_place(tissue, tool, hit.sites, hit.weights, state.touch.law, state.pose, hit.normal, states);
  return true;
}

void release_departed(const TissueState& tissue, ToolRotation& last, ToolStates& states) {
  const double height = kReleaseHeight * tissue.pack->mean_surface_edge * tissue.pack->metres;
  uint32_t is_outside = 0;  // one bit a tool: the tip is outside
  uint32_t is_tested = 0;   // one bit a tool: is_outside is known
  release_where(states, [&](const HeldContact& contact) {
    if (contact.law != PAL_LAW_TOUCH) return false;
    ToolState& tool = states.tools[contact.tool];
    const uint32_t bit = 1u << contact.tool;
    if (tool.touches && (is_tested & bit) == 0) {
      SurfaceHit hit;
      is_tested |= bit;
      if (find_near_tip(tissue, states.organ, tool, hit) &&
          hit.distance * tissue.pack->metres > tool.touch.distance + height)
        is_outside |= bit;
    }
    double d[3];
    movement_of(states, contact, last, d);
    const bool is_out =
        (is_outside & bit) != 0 ||
        d[0] * contact.normal[0] + d[1] * contact.normal[1] + d[2] * contact.normal[2] > height;
    if (is_out) tool.must_leave = true;
    return is_out;
  });
}

}  // namespace palpate
