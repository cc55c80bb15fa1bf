// Calls that change the tissue of a session: fixed nodes, gravity, an inclusion, orientations of contacts.
#include <math.h>
#include <string.h>

#include <palpate/palpate.h>

#include "runtime/src/base/floating_point_mode.hpp"
#include "runtime/src/base/sized_struct.hpp"
#include "runtime/src/numerics/pose.hpp"
#include "runtime/src/pack/pack_view.hpp"
#include "runtime/src/response/patch_rotation.hpp"
#include "runtime/src/response/response_kind.hpp"
#include "runtime/src/session/session_state.hpp"
#include "runtime/src/zone/zone_inclusion.hpp"

namespace palpate {
namespace {

// The limit is relative to the scene's gravity: a linear answer means nothing beyond this factor.
constexpr double kMostGravity = 10.0;
// A rotation of gravity and its inverse leave at most this relative difference.
constexpr double kGravityRounding = 1e-12;

double length(const double v[3]) {
  return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

constexpr double kLeastStiffness = 0.01;  // of an inclusion, relative to the pack's tissue
constexpr double kMostStiffness = 100;
constexpr double kLargestLength = 1e100;       // m
constexpr uint32_t kFirstInclusionBytes = 48;  // size of pal_inclusion in the first release
static_assert(sizeof(pal_inclusion) >= kFirstInclusionBytes);

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

constexpr uint32_t kFirstTorqueBytes = 176;
static_assert(kFirstTorqueBytes == sizeof(pal_contact_torque));

}  // namespace
}  // namespace palpate

extern "C" pal_status pal_session_set_fixed(pal_session* session, const uint32_t* contact_nodes,
                                            uint32_t count) noexcept {
  if (session == nullptr || (contact_nodes == nullptr && count > 0)) return PAL_STATUS_NULL_ARGUMENT;
  if (count > session->config.max_fixed) return PAL_STATUS_CAPACITY_EXCEEDED;
  for (uint32_t i = 0; i < count; ++i) {
    if (contact_nodes[i] >= session->tissue.pack->num_contact_nodes) return PAL_STATUS_NO_SUCH_NODE;
  }
  // The polynomials do not include nodes that the session fixes later.
  const bool has_linear =
      session->tissue.pack->field_compliance != nullptr && !palpate::is_nonlinear_only(session->config.model);
  if (count > session->tissue.zone.room.fixed && !has_linear) return PAL_STATUS_MODEL_CANNOT_ANSWER;
  session->used = true;
  palpate::record_fixed(*session, contact_nodes, count);
  // The field of the last frame keeps its weights: the next frame applies the change.
  bool changed = count != session->tissue.num_fixed;
  for (uint32_t i = 0; i < count; ++i) {
    changed = changed || session->tissue.fixed[i] != contact_nodes[i];
    session->tissue.fixed[i] = contact_nodes[i];
  }
  if (!changed) return PAL_STATUS_OK;
  session->tissue.num_fixed = count;
  ++session->tissue.fixed_version;
  return PAL_STATUS_OK;
}

extern "C" pal_status pal_session_set_gravity(pal_session* session, const double* acceleration) noexcept {
  if (session == nullptr) return PAL_STATUS_NULL_ARGUMENT;
  const pal_pack& pack = *session->tissue.pack;
  if (pack.contact_per_gravity == nullptr) return PAL_STATUS_NO_SUCH_MODEL;
  const palpate::FloatingPointMode mode;
  double turn[3] = {};
  if (acceleration != nullptr) {
    for (int i = 0; i < 3; ++i) {
      if (!isfinite(acceleration[i])) return PAL_STATUS_NOT_FINITE;
    }
    const double scene = palpate::length(pack.acceleration);
    double organ[3];
    palpate::rotate_back(session->tools.organ, acceleration, organ);
    for (double& component : organ) component /= pack.metres;
    if (!(palpate::length(organ) <= palpate::kMostGravity * scene)) return PAL_STATUS_BAD_ARGUMENT;
    for (int i = 0; i < 3; ++i) turn[i] = organ[i] - pack.acceleration[i];
    if (palpate::length(turn) <= palpate::kGravityRounding * scene) memset(turn, 0, sizeof turn);
  }
  const bool turned = turn[0] != 0 || turn[1] != 0 || turn[2] != 0;
  // Polynomials are sampled under the scene's gravity, and zones start from rest under the scene's gravity.
  if (turned && palpate::is_nonlinear_only(session->config.model)) return PAL_STATUS_MODEL_CANNOT_ANSWER;
  palpate::GravityTurn& gravity = session->tissue.gravity;
  for (int i = 0; i < 3; ++i) {
    gravity.has_changed = gravity.has_changed || gravity.now[i] != turn[i];
    gravity.now[i] = turn[i];
  }
  gravity.is_turned = turned;
  session->used = true;
  palpate::record_gravity(*session, acceleration);
  return PAL_STATUS_OK;
}

extern "C" pal_status pal_session_set_inclusion(pal_session* session,
                                                const pal_inclusion* inclusion) noexcept {
  if (session == nullptr) return PAL_STATUS_NULL_ARGUMENT;
  palpate::ZoneState& zone = session->tissue.zone;
  if (zone.room.contacts == 0) return PAL_STATUS_NO_SUCH_MODEL;
  const palpate::FloatingPointMode mode;
  palpate::Inclusion converted = {};
  pal_inclusion known = {};
  if (inclusion != nullptr) {
    pal_status status = palpate::read_sized(*inclusion, palpate::kFirstInclusionBytes, known);
    if (status == PAL_STATUS_OK) status = palpate::check_inclusion(*session->tissue.pack, known, converted);
    if (status != PAL_STATUS_OK) return status;
  }
  if (!palpate::is_same(converted, zone.inclusion)) ++zone.inclusion_version;
  zone.inclusion = converted;
  session->used = true;
  palpate::record_inclusion(*session, inclusion != nullptr ? &known : nullptr);
  return PAL_STATUS_OK;
}

extern "C" pal_status pal_session_set_orientations(pal_session* session, const double* orientations,
                                                   uint32_t count) noexcept {
  if (session == nullptr || (orientations == nullptr && count > 0)) return PAL_STATUS_NULL_ARGUMENT;
  if (!palpate::has_turns(session->tissue)) return PAL_STATUS_NO_SUCH_MODEL;
  if (count > session->config.max_contacts) return PAL_STATUS_CAPACITY_EXCEEDED;
  const palpate::FloatingPointMode mode;
  double turns[3 * palpate::pack::kMostContacts] = {};
  for (uint32_t c = 0; c < count; ++c) {
    constexpr double kUnturned[4] = {1, 0, 0, 0};
    pal_pose pose = {};
    memcpy(pose.orientation, orientations + size_t{4} * c, sizeof pose.orientation);
    if (!palpate::read_pose(pose, pose)) return PAL_STATUS_BAD_ARGUMENT;
    palpate::turn_between(kUnturned, pose.orientation, turns + size_t{3} * c);
  }
  memcpy(session->turns, turns, size_t{3} * session->config.max_contacts * sizeof *turns);
  session->used = true;
  palpate::record_orientations(*session, orientations, count);
  return PAL_STATUS_OK;
}

extern "C" pal_status pal_session_get_torque(const pal_session* session, uint32_t contact,
                                             pal_contact_torque* torque) noexcept {
  if (session == nullptr || torque == nullptr) return PAL_STATUS_NULL_ARGUMENT;
  if (!palpate::has_turns(session->tissue)) return PAL_STATUS_NO_SUCH_MODEL;
  if (!session->by_contacts || session->tissue.answered != palpate::ResponseKind::zone)
    return PAL_STATUS_MODEL_CANNOT_ANSWER;
  const palpate::ZoneSet& set = session->tissue.zone.active;
  if (contact >= set.num_contacts) return PAL_STATUS_BAD_ARGUMENT;
  const palpate::FloatingPointMode mode;
  const double newtons = session->tissue.pack->newtons;
  const double metres = session->tissue.pack->metres;
  const uint32_t displacement = 3 * contact;
  const uint32_t turn = 3 * (set.num_contacts + contact);
  pal_contact_torque found = {};
  for (uint32_t i = 0; i < 3; ++i) {
    found.torque[i] = set.force[turn + i] * newtons * metres;
    for (uint32_t j = 0; j < 3; ++j) {
      found.by_displacement[i][j] = set.stiffness[turn + i][displacement + j] * newtons;
      found.by_rotation[i][j] =
          (set.stiffness[turn + i][turn + j] + set.turning[contact][3 * i + j]) * newtons * metres;
    }
  }
  return palpate::write_sized(found, palpate::kFirstTorqueBytes, *torque);
}
