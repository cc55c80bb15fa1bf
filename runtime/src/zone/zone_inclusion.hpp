// Tissue whose stiffness is changed while running: an inclusion, in the nonlinear zones that it reaches.
//
// With W_e what an element stores,
//
//   W_e -> s(X_e) W_e,   s(X) = 1 + (stiffness - 1) w(|X - centre|),
//
// X_e the centre of its corners where the organ rests; w is 1 inside of the ball and 0 outside, a cubic over a mean
// edge of the surface about the ball's own, so that force and field stay continuous as it moves. All of an element's
// forces and stiffness scale with it: the volumes that its integration points stand for are what is scaled, and those
// of volumes that elements share are their sums. Where it rests tissue stays at rest, whatever its weight: what the
// elements of the changed tissue pull with there is taken out, as that of the others is.
//
// The refining lane gives the elements outside of the zone the same stiffness, in its next delivery.
#pragma once

#include "runtime/src/elements/organ_elements.hpp"
#include "runtime/src/zone/zone_set.hpp"

namespace palpate {

// Gives the elements of the set that answers the stiffness that they are to have, where that has changed, and counts
// what this adds to the energy that they store where they are. Cost where it has: three evaluations of the elements.
void take_inclusion(const pal_pack& pack, ZoneState& state);

// Gives all elements of the organ the stiffness that an inclusion gives them.
void set_organ_stiffness(const pal_pack& pack, const Inclusion& inclusion, const OrganElements& elements);

}  // namespace palpate
