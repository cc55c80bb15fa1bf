// An inclusion: a ball in which the stiffness of the tissue changes while running.
//
// The energy W_e of element e becomes
//
//   W_e -> s(X_e) W_e,   s(X) = 1 + (stiffness - 1) w(|X - centre|).
//
// X_e: mean of the element's corners at rest. Over one mean surface edge about the ball's surface, w falls
// from 1 to 0 by a cubic. Force and field are therefore continuous as the ball moves. s scales the volumes of
// the element's integration points, and thereby forces and stiffness. A volume patch has the sum of the
// scaled volumes of its elements. Tissue at rest stays at rest: take_inclusion() recomputes the forces at
// rest, which the residual subtracts.
//
// The refining lane scales all elements of the organ likewise (set_organ_stiffness()).
#pragma once

#include "runtime/src/elements/organ_elements.hpp"
#include "runtime/src/zone/zone_set.hpp"

namespace palpate {

// Updates the stiffness of the active set's elements after a change of the inclusion, and adds the change of
// their energy to ZoneState::inclusion_energy. Cost for a changed group: three evaluations of the elements.
void take_inclusion(const pal_pack& pack, ZoneState& state);

// Sets the stiffness of all elements of the organ.
void set_organ_stiffness(const pal_pack& pack, const Inclusion& inclusion, const OrganElements& elements);

}  // namespace palpate
