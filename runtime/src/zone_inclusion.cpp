#include "runtime/src/zone_inclusion.hpp"

#include <math.h>
#include <string.h>

#include <algorithm>

#include "runtime/src/floating_point_mode.hpp"
#include "runtime/src/pack_view.hpp"
#include "runtime/src/session_state.hpp"
#include "runtime/src/sized_struct.hpp"

namespace palpate {
namespace {

constexpr double kLeastStiffness = 0.01;
constexpr double kMostStiffness = 100;
constexpr double kLargestLength = 1e100;
constexpr uint32_t kFirstInclusionBytes = 48;  // of pal_inclusion in the first release
static_assert(sizeof(pal_inclusion) >= kFirstInclusionBytes);

// s, of the file's comment.
double stiffness_at(const pal_pack& pack, const Inclusion& inclusion, const double point[3]) {
  double square = 0;
  for (int i = 0; i < 3; ++i) {
    const double offset = point[i] - inclusion.centre[i];
    square += offset * offset;
  }
  const double outside = (sqrt(square) - inclusion.radius) / pack.mean_surface_edge + 0.5;
  const double t = std::min(1.0, std::max(0.0, 1.0 - outside));
  return 1.0 + (inclusion.stiffness - 1.0) * t * t * (3.0 - 2.0 * t);
}

// Of a lane's element.
double stiffness_of(const pal_pack& pack, const ZoneState& state, const std::array<int, kLanes>* corners,
                    int lane) {
  if (!state.inclusion.is_present) return 1;
  double centre[3] = {};
  for (size_t corner = 0; corner < 4; ++corner) {
    const uint32_t place = static_cast<uint32_t>(corners[corner][static_cast<size_t>(lane)]);
    const pack::ZoneNode& node = pack.zone_nodes[state.answering.nodes[place]];
    for (int i = 0; i < 3; ++i) centre[i] += 0.25 * (node.position[i] + node.displacement[i]);
  }
  return stiffness_at(pack, state.inclusion, centre);
}

// The largest change of a stiffness, of the larger.
double change_of(const pal_pack& pack, const ZoneState& state, const ZoneBatches& batches) {
  double largest = 0;
  for_each_lanes(batches, [&](const ZoneLanes& lanes, const std::array<int, kLanes>* corners) {
    for (int lane = 0; lane < lanes.count; ++lane) {
      const double to = stiffness_of(pack, state, corners, lane);
      largest = std::max(largest, fabs(to - lanes.stiffness[lane]) / std::max(to, lanes.stiffness[lane]));
    }
  });
  return largest;
}

void set_stiffness(const pal_pack& pack, const ZoneState& state, const ZoneBatches& batches) {
  for_each_lanes(batches, [&](ZoneLanes& lanes, const std::array<int, kLanes>* corners) {
    for (int lane = 0; lane < kLanes; ++lane)
      lanes.stiffness[lane] = stiffness_of(pack, state, corners, lane);
  });
  scale_volumes(batches);
}

// What a group's elements store beyond the work of their forces at rest.
double element_energy(const ZoneSet& set, const ZoneGroup& group, const pal_pack& pack, double* scratch) {
  double energy = add_zone_forces(group.batches, set.displacement, scratch).energy;
  for (uint32_t place = group.first_node; place < group.first_node + group.num_nodes; ++place) {
    for (uint32_t axis = 0; axis < 3; ++axis) {
      const uint32_t i = 3 * place + axis;
      energy -=
          set.rest_force[i] * (set.displacement[i] - pack.zone_nodes[set.nodes[place]].displacement[axis]);
    }
  }
  return energy;
}

void find_rest_force(const pal_pack& pack, ZoneState& state, const ZoneGroup& group) {
  ZoneSet& set = state.answering;
  const size_t first = size_t{3} * group.first_node;
  memset(set.rest_force + first, 0, size_t{3} * group.num_nodes * sizeof(double));
  for (uint32_t place = group.first_node; place < group.first_node + group.num_nodes; ++place)
    memcpy(state.saved + size_t{3} * place, pack.zone_nodes[set.nodes[place]].displacement,
           3 * sizeof(double));
  add_zone_forces(group.batches, state.saved, set.rest_force);
}

pal_status check_inclusion(const pal_pack& pack, const pal_inclusion& given, Inclusion& inclusion) {
  for (int i = 0; i < 3; ++i) {
    if (!(fabs(given.centre[i]) <= kLargestLength)) return PAL_STATUS_NOT_FINITE;
    inclusion.centre[i] = given.centre[i] / pack.metres;
  }
  if (!isfinite(given.radius) || !isfinite(given.stiffness)) return PAL_STATUS_NOT_FINITE;
  if (!(given.radius > 0 && given.radius <= kLargestLength && given.stiffness >= kLeastStiffness &&
        given.stiffness <= kMostStiffness && given.reserved == 0))
    return PAL_STATUS_BAD_ARGUMENT;
  inclusion.radius = given.radius / pack.metres;
  inclusion.stiffness = given.stiffness;
  inclusion.is_present = true;
  return PAL_STATUS_OK;
}

bool is_same(const Inclusion& one, const Inclusion& other) {
  return one.is_present == other.is_present && one.radius == other.radius &&
         one.stiffness == other.stiffness && one.centre[0] == other.centre[0] &&
         one.centre[1] == other.centre[1] && one.centre[2] == other.centre[2];
}

}  // namespace

void take_inclusion(const pal_pack& pack, ZoneState& state) {
  ZoneSet& set = state.answering;
  if (set.inclusion_version == state.inclusion_version) return;
  // What a set that was just made has of it, it has from the start.
  const bool is_new = set.inclusion_version == kNoInclusion;
  if (is_new) state.inclusion_energy = 0;
  set.inclusion_version = state.inclusion_version;
  for (uint32_t g = 0; g < set.num_groups; ++g) {
    ZoneGroup& group = set.groups[g];
    ZoneBatches& batches = group.batches;
    const double change = change_of(pack, state, batches);
    if (change == 0) continue;
    const double before = is_new ? 0 : element_energy(set, group, pack, state.forces);
    set_stiffness(pack, state, batches);
    find_rest_force(pack, state, group);
    for (uint32_t p = 0; p < batches.num_patches; ++p)
      batches.patches[p].at_rest = batches.patches[p].pressure;
    group.has_balance = false;
    group.elsewhere = 0;
    // A tangent of other tissue is as far off as one of tissue that has been strained as much.
    group.moved += 0.5 * change * pack.mean_surface_edge;
    group.moved_since += 0.5 * change * pack.mean_surface_edge;
    if (!is_new) state.inclusion_energy += element_energy(set, group, pack, state.forces) - before;
  }
}

}  // namespace palpate

extern "C" pal_status pal_session_set_inclusion(pal_session* session,
                                                const pal_inclusion* inclusion) noexcept {
  if (session == nullptr) return PAL_STATUS_NULL_ARGUMENT;
  palpate::ZoneState& zone = session->zone;
  if (zone.max_contacts == 0) return PAL_STATUS_NO_SUCH_MODEL;
  const palpate::FloatingPointMode mode;
  palpate::Inclusion made = {};
  pal_inclusion known = {};
  if (inclusion != nullptr) {
    pal_status status = palpate::read_sized(*inclusion, palpate::kFirstInclusionBytes, known);
    if (status == PAL_STATUS_OK) status = palpate::check_inclusion(*session->pack, known, made);
    if (status != PAL_STATUS_OK) return status;
  }
  if (!palpate::is_same(made, zone.inclusion)) ++zone.inclusion_version;
  zone.inclusion = made;
  session->used = true;
  palpate::record_inclusion(*session, inclusion != nullptr ? &known : nullptr);
  return PAL_STATUS_OK;
}
