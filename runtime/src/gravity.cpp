#include "runtime/src/gravity.hpp"

#include <math.h>
#include <string.h>

#include "runtime/src/floating_point_mode.hpp"
#include "runtime/src/pack_view.hpp"
#include "runtime/src/session_state.hpp"

namespace palpate {
namespace {

// In units of the scene's gravity: beyond it a linear answer means nothing.
constexpr double kMostGravity = 10.0;
// A rotation there and back leaves this much.
constexpr double kRounding = 1e-12;

double length(const double v[3]) {
  return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

}  // namespace

bool fill_rest(const pal_session& session, const pal_real* turn, uint32_t first, uint32_t count,
               pal_real* rows) {
  const pal_pack& pack = *session.pack;
  if (!pack.has_gravity) return false;
  const size_t begin = size_t{first} * pack::kPanelRows;
  const size_t wanted = size_t{count} * pack::kPanelRows;
  const size_t left = size_t{3} * pack.num_nodes - begin;
  const size_t given = left < wanted ? left : wanted;
  for (size_t i = 0; i < given; ++i) {
    const size_t dof = begin + i;
    rows[i] = static_cast<pal_real>((pack.rest_positions[dof] - pack.positions[dof]) * pack.metres);
  }
  memset(rows + given, 0, (wanted - given) * sizeof *rows);
  for (uint32_t panel = 0; panel < count && turn != nullptr; ++panel) {
    session.kernel.add_columns(pack.field_per_gravity + size_t{3} * (first + panel) * pack::kPanelRows,
                               pack::kPanelRows, turn, 3, true, rows + size_t{panel} * pack::kPanelRows);
  }
  return true;
}

void add_rest(const pal_session& session, const pal_real* turn, uint32_t node, pal_real* rows) {
  const pal_pack& pack = *session.pack;
  if (!pack.has_gravity) return;
  for (uint32_t i = 0; i < 3; ++i) {
    const size_t dof = size_t{3} * node + i;
    rows[i] += static_cast<pal_real>((pack.rest_positions[dof] - pack.positions[dof]) * pack.metres);
    for (uint32_t axis = 0; axis < 3 && turn != nullptr; ++axis) {
      rows[i] += turn[axis] * pack.field_per_gravity[(dof / pack::kPanelRows * 3 + axis) * pack::kPanelRows +
                                                     dof % pack::kPanelRows];
    }
  }
}

}  // namespace palpate

extern "C" pal_status pal_session_set_gravity(pal_session* session, const double* acceleration) noexcept {
  if (session == nullptr) return PAL_STATUS_NULL_ARGUMENT;
  const pal_pack& pack = *session->pack;
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
    if (palpate::length(turn) <= palpate::kRounding * scene) memset(turn, 0, sizeof turn);
  }
  const bool turned = turn[0] != 0 || turn[1] != 0 || turn[2] != 0;
  // The polynomials know only the gravity that they were sampled in, a zone that of rest.
  if (turned && palpate::is_nonlinear_alone(session->config.model)) return PAL_STATUS_MODEL_CANNOT_ANSWER;
  for (int i = 0; i < 3; ++i) {
    session->gravity_changed = session->gravity_changed || session->gravity_turn[i] != turn[i];
    session->gravity_turn[i] = turn[i];
  }
  session->gravity_turned = turned;
  session->used = true;
  palpate::record_gravity(*session, acceleration);
  return PAL_STATUS_OK;
}
