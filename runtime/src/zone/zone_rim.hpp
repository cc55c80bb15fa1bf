// The rim of a group whose contacts are near each other: the elements next to its zones and what is between them, which
// share a node with those, as far as the pack has them: all that are next to the zone of one contact.
//
// Outside of zones stand series in the loads x of the contacts (zone_exterior.hpp). Neighbours that crush what is between
// them pull the boundary in ways that no loads of their patches do; what that adds is of second order, too, and dies out
// within an edge. So the rim R is of second order in the tractions t as they are. With n2(a, b) the symmetric bilinear
// part of the forces of its elements (element_batch.hpp) and U x what the loads do to the linear organ,
//
//   v = C_RB (t - g)                      how the boundary moves the linear organ there
//   s = n2(U x, U x) - n2(v, v) = -n2(v - U x, v + U x)
//   dq = K^-1 s,   dq_B = C_BR s,   g = T dq_B
//
// is what the series has not got, and g moves the zone as forces from outside would. t is T (w_B - b), of which g is
// what moves the boundary as the rim does: about what other groups, and a set that begins where this one is, have of the
// rim. The field has t - g on B and s on R. Found with the g before: a round changes g by less than a third of what the
// one before did (0.04 to 0.32 of it on the brain's neighbours to two edges), so one a frame is enough where it moves
// little. Where that would not hold s is shortened, flagged. Where two contacts of the group add nothing to each other in the
// series there is no rim.
//
// The laws are those of elements as they are in the mesh: what the organ's weight strains them by is as much of s that is
// wrong. Elements that share volumes take no part, and with nodes fixed while running, where no loads count, none does.
// Units of the model.
//
// On the brain at nu = 0.4, pairs of neighbours pushed up to one mean edge, the largest of what is left outside of zones
// goes from 0.96 to 0.28 % of |d|, where second order of all elements outside leaves 0.25 %.
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/zone/zone_balance.hpp"
#include "runtime/src/zone/zone_set.hpp"

namespace palpate {

// Capacities and arrays of rims, once those of zones are known.
void carve_rims(const pal_pack& pack, Arena& arena, ZoneState& state);

// The elements at the boundary of a group, none of any zone, where contacts' zones are marked. False where that is more than
// the pack has declared.
bool list_rim(const pal_pack& pack, uint32_t index, ZoneState& state);

// Its compliance and moves, some nodes from state.column on. True when it has ended. Cost: for each node a block of the
// compliance for each of the boundary, and of a patch.
bool fill_rim(const pal_pack& pack, uint64_t operations, ZoneState& state, ZoneGroup& group, uint64_t& spent);

// s and g at the group's tractions and loads; none, flagged, where that is not finite. Cost: twice the rim's nodes x the
// boundary's, 9 multiply-adds each, and second order of the elements, about as their forces.
void find_rim(ZoneFrame& frame, ZoneGroup& group);

// Nothing moves it.
void rest_rim(ZoneGroup& group);

// What it stores beyond t . w / 2, as weigh_exterior_energy() has it of second order.
double rim_energy(const ZoneSet& set, const ZoneGroup& group);

}  // namespace palpate
