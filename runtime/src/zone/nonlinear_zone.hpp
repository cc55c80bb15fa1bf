// nonlinear_zone: full nonlinear elements in a small zone around the contacts, the rest of the organ, linearised, condensed
// exactly onto it; St. Venant's principle taken at its word. Any contacts, several at once, no samples.
//
// With w the displacement from rest, P the nodal forces of the zone's elements, B its boundary, S as in
// zone_set.hpp, f the forces that hold contacted nodes:
//
//   P(w) - P(0) + [S w_B + c]_B = f
//   outside of V: u = u_e + U (d - d_e)
//
// d are the displacements and turns of the contacts, and U says how the organ follows them (field_response.hpp). c: the
// correction of the refining lane, and u_e, d_e the field and the contacts of its last delivery (refinement.hpp); all zero
// at rest. zone_balance.hpp adds how zones act on each other. Under gravity the elements' weight and P(0)
// cancel. The answer is exact for small displacements, where the zone is the whole organ, and where the lane's iterations have
// converged.
//
// Each group is solved by Newton's method with a tangent that is kept while it is good (zone_tangent.hpp).
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/zone/field_state.hpp"
#include "runtime/src/zone/zone_set.hpp"

namespace palpate {

struct ZoneAnswer {
  uint32_t flags;
  uint32_t iterations;  // that it took
  bool went_back;       // a group found no way on, and is where it was in balance last, or at rest
  double energy;
  double left;  // of the error of displacements, as far as steps and rounds tell: length unit
};

// Moves the contacts of the set that answers to these displacements from rest and, where patches turn,
// rotations, as ZoneSet::followed, and solves, model units; at most so many Newton iterations. No element is
// ever accepted inverted, but of small strains, which know no inversion: where the way there would do so, the contacts
// follow as far as they can, and go on in the next frame. Where there is no way on, or one that leads astray, they are back
// where the zone was in balance last, and follow from there in shorter steps; where that fails for long and rest is nearer,
// or no part of a step is left to take, at rest. Cost of an iteration, for each group: m^2 multiply-adds and the
// forces of its elements, m = 3 x its nodes, three times where they share volumes. A frame that cannot wait for the tangent
// of the refining lane makes one (zone_tangent.hpp).
// Leaves displacements, forces and stiffness of the contacts in the set; on the way to a balance perhaps the forces that the
// last one and its stiffness tell of.
// `are_forces_given`: the caller compares the contacts' forces with given ones, and solves again. Else contacts of a refined
// zone that stand still are solved as exactly as the iterations allow.
ZoneAnswer solve_zone(const pal_pack& pack, const double* displacements, uint32_t iterations,
                      bool are_forces_given, ZoneState& state);

// Something else answers: the set that did is at rest when it next does.
void rest_zone(const pal_pack& pack, ZoneState& state);

// Leaves the field of the frame just solved.
void fill_zone_field(const pal_pack& pack, const ZoneState& state, FieldState& field);

}  // namespace palpate
