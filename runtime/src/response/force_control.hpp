// Zone contacts with a given force along some axes, and a given displacement along the other axes.
//
// Newton's method on the axes a of given force, with the zone in equilibrium before each step:
//
//   d_a += K_aa^-1 (g_a - f_a(d))       g the given forces, K = df / dd the stiffness of all contacts
//
// K holds the boundaries of other groups fixed, so with several groups the steps converge linearly.
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/response/response_at_point.hpp"
#include "runtime/src/zone/zone_set.hpp"

namespace palpate {

inline bool is_force_given(const pal_contact& contact, uint32_t axis) {
  return (contact.force_axes >> axis & 1) != 0;
}

struct ForceControl {
  bool has_ended;  // no force is given, or the next step is negligible
  // - PAL_FLAG_CLAMPED: a force needs more than kMostGiven times the scene's largest displacement.
  // - PAL_FLAG_ILL_CONDITIONED: the given forces cannot all act.
  uint32_t flags;
};

// Limit of displacements under given forces along an axis, relative to the scene's largest displacement.
inline constexpr double kMostGiven = 4.0;

// Takes one step on displacements[contacts][3], model units. `transfer`: from the zone's answer to each
// contact's place. `couplings`: [3 contacts][3 contacts] transferred stiffness between contacts, or null.
ForceControl control_forces(const pal_pack& pack, const ZoneSet& set, const pal_contact* contacts,
                            const PointResponse* transfer, const double* couplings, double* displacements);

}  // namespace palpate
