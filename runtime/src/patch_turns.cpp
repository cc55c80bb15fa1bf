#include "runtime/src/patch_turns.hpp"

#include <math.h>
#include <string.h>

#include "runtime/src/floating_point_mode.hpp"
#include "runtime/src/pack_view.hpp"
#include "runtime/src/pose.hpp"
#include "runtime/src/session_state.hpp"
#include "runtime/src/sized_struct.hpp"

namespace palpate {
namespace {

constexpr uint32_t kFirstTorqueBytes = 176;
static_assert(kFirstTorqueBytes == sizeof(pal_contact_torque));
constexpr double kMostTurn = 1.4142135623730951;  // 2 sin(90 degrees / 2)

// To a quarter turn at most; whether it was more.
bool shorten(double turn[3]) {
  const double size = sqrt(turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2]);
  if (!(size > kMostTurn)) return false;
  for (int i = 0; i < 3; ++i) turn[i] *= kMostTurn / size;
  return true;
}

double product(const double a[3], const double (*matrix)[kMostZoneAxes], uint32_t row, uint32_t column,
               const double b[3]) {
  double sum = 0;
  for (uint32_t i = 0; i < 3; ++i) {
    for (uint32_t j = 0; j < 3; ++j) sum += a[i] * matrix[row + i][column + j] * b[j];
  }
  return sum;
}

}  // namespace

bool has_turns(const pal_session& session) {
  return session.zone.axes_per_contact > 3;
}

bool take_turns(pal_session& session, const pal_contact* contacts, uint32_t count, const double* turns) {
  if (!has_turns(session)) return false;
  find_places(*session.pack, contacts, session.zone.answering);
  double* to = session.displacements + size_t{3} * count;
  memset(to, 0, size_t{3} * count * sizeof *to);
  bool is_any_turned = false;
  for (uint32_t c = 0; c < count && turns != nullptr; ++c, turns += 3, to += 3) {
    memcpy(to, turns, 3 * sizeof *to);
    if (shorten(to)) session.input_flags[c] |= PAL_FLAG_CLAMPED;
    is_any_turned = is_any_turned || to[0] != 0 || to[1] != 0 || to[2] != 0;
  }
  return is_any_turned;
}

void find_turn(const pal_session& session, const double orientation[4], HeldContact& contact,
               double turn[3]) {
  double in_world[3];
  turn_between(contact.unstrained_orientation, orientation, in_world);
  if (shorten(in_world)) {
    double turned[4];
    quaternion_of(in_world, turned);
    divide_quaternions(turned, orientation, contact.unstrained_orientation);
  }
  rotate_back(session.tools.organ, in_world, turn);
}

double energy_of_turns(const pal_session& session, uint32_t row, uint32_t column, const pal_contact& of_row,
                       const double* row_turn, const pal_contact& of_column, const double* column_turn) {
  const ZoneSet& set = session.zone.answering;
  const double metres = session.pack->metres;
  double row_moved[3];
  double column_moved[3];
  for (int i = 0; i < 3; ++i) {
    row_moved[i] = of_row.displacement[i] / metres;
    column_moved[i] = of_column.displacement[i] / metres;
  }
  const uint32_t behind = 3 * set.num_contacts;
  double energy =
      -0.5 * (product(row_moved, set.stiffness, 3 * row, behind + 3 * column, column_turn) +
              product(row_turn, set.stiffness, behind + 3 * row, 3 * column, column_moved) +
              product(row_turn, set.stiffness, behind + 3 * row, behind + 3 * column, column_turn));
  for (uint32_t i = 0; i < 3 && row == column; ++i) energy += set.force[behind + 3 * row + i] * row_turn[i];
  return energy * session.pack->newtons * metres;
}

}  // namespace palpate

extern "C" pal_status pal_session_set_orientations(pal_session* session, const double* orientations,
                                                   uint32_t count) noexcept {
  if (session == nullptr || (orientations == nullptr && count > 0)) return PAL_STATUS_NULL_ARGUMENT;
  if (!palpate::has_turns(*session)) return PAL_STATUS_NO_SUCH_MODEL;
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
  if (!palpate::has_turns(*session)) return PAL_STATUS_NO_SUCH_MODEL;
  if (!session->by_contacts || !session->zone.strained) return PAL_STATUS_MODEL_CANNOT_ANSWER;
  const palpate::ZoneSet& set = session->zone.answering;
  if (contact >= set.num_contacts) return PAL_STATUS_BAD_ARGUMENT;
  const palpate::FloatingPointMode mode;
  const double newtons = session->pack->newtons;
  const double metres = session->pack->metres;
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
