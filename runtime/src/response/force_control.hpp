// Contacts of a zone of which the force is given along some axes, and the displacement along the others.
//
// Newton's method on those axes a, the zone having come to rest before each step:
//
//   d_a += K_aa^-1 (g_a - f_a(d))       g the forces given, K = df / dd the stiffness of all contacts
//
// What a tangent says of a group, A, is of forces on the others that stay. With O, how far a force on the patch of a contact
// moves the nodes of a patch in another group in the mean, K = (A^-1 + O)^-1 = A - A O A + .., and to first order in O, which
// is all of it where all axes are given,
//
//   K_aa^-1 = A_aa^-1 + A_aa^-1 (A O A)_aa A_aa^-1
//
// where no nodes are fixed while running: O is of the organ without them.
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/response/response_at_point.hpp"
#include "runtime/src/zone/zone_set.hpp"

namespace palpate {

inline bool is_force_given(const pal_contact& contact, uint32_t axis) {
  return (contact.force_axes >> axis & 1) != 0;
}

struct ForceControl {
  bool has_ended;  // nothing was given, or all forces are what they should be to 1e-5 of the displacement
  // PAL_FLAG_CLAMPED: a force asks for more than kMostGiven of the scene's largest displacement;
  // PAL_FLAG_ILL_CONDITIONED: they cannot all act
  uint32_t flags;
};

// Of that displacement, along an axis.
inline constexpr double kMostGiven = 4.0;

// Takes displacements[contacts][3], model units, a step on. `moved`: what moves the zone's answer to each contact's
// place; `couplings`: [3 contacts][3 contacts] of its stiffness between contacts, or null.
ForceControl control_forces(const pal_pack& pack, const ZoneSet& set, const pal_contact* contacts,
                            const PointResponse* moved, const double* couplings, double* displacements);

}  // namespace palpate
