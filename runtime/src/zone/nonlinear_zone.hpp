// nonlinear_zone: nonlinear elements in a small zone about the contacts, with the linearised rest of the
// organ condensed onto the zone's boundary. The model needs no samples and takes several contacts at once.
//
// w: displacement from rest. P: nodal forces of the zone's elements. B, S: zone boundary and exterior
// stiffness (zone_set.hpp). f: forces on contacted nodes. d: displacements and rotations of the contacts.
//
//   P(w) - P(0) + [S w_B + c]_B = f
//   outside of V: u = u_e + U (d - d_e)
//
// U = du/dd outside of the zone (field_response.hpp). c, u_e and d_e are the correction, field and contact
// axes of the refining lane's last delivery (refinement.hpp). Before a delivery c and d_e are zero, and u_e
// is the organ's rest. The organ's weight cancels P(0). The solution is exact in three cases: small
// displacements, a zone that is the whole organ, and converged iterations of the refining lane.
//
// Newton's method solves each group with a tangent that many frames share (zone_tangent.hpp).
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/zone/field_state.hpp"
#include "runtime/src/zone/zone_set.hpp"

namespace palpate {

struct ZoneAnswer {
  uint32_t flags;
  uint32_t iterations;  // Newton iterations of the slowest group
  bool went_back;       // after its solve, a group was returned to its last equilibrium or to rest
  double energy;
  double left;  // estimated error of displacements, length unit
};

// Moves the contacts of the active set towards `displacements`, [num_axes] as ZoneSet::followed. Solves each
// group by at most `iterations` Newton iterations. The set then has displacements, forces and stiffness.
// - An accepted state has det F > 0 in every element with finite strains. A step that would invert an element
//   is shortened, and later frames move the contacts on.
// - A group without an acceptable step returns to its last equilibrium, or after many failures to rest
//   (zone_setback.hpp).
// - The forces of an unconverged group may be extrapolated from its last equilibrium.
// - `are_forces_given`: the caller compares contact forces with given forces and solves again. Otherwise a
//   refined zone whose contacts stand still is solved to a smaller error.
// Cost of an iteration for each group: m^2 multiply-adds, m = 3 x nodes, and one pass over its elements, or
// three if elements share volumes. A frame makes a tangent if a group's tangent is missing, outdated or poor.
ZoneAnswer solve_zone(const pal_pack& pack, const double* displacements, uint32_t iterations,
                      bool are_forces_given, ZoneState& state);

// Puts the active set at rest when another model answers.
void rest_zone(const pal_pack& pack, ZoneState& state);

// Writes the field of the frame just solved.
void fill_zone_field(const pal_pack& pack, const ZoneState& state, FieldState& field);

}  // namespace palpate
