// The forces on the nodes of a group: of its own elements, of the exterior, and of the other groups. nonlinear_zone.hpp
// and zone_set.hpp have the equations and the names. Units of the model.
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/zone/zone_set.hpp"

namespace palpate {

struct ZoneFrame {
  const pal_pack& pack;
  ZoneState& state;
  ZoneSet& set;
  uint32_t flags;
};

// Leaves what acts on the group where its nodes are: the forces of the elements beyond those at rest in
// ZoneState::forces, and their energy and S w_B in the group. False where an element is inverted or nearly so, or a
// node so far away that numbers lose their meaning: what is left then is of no use, and the nodes have to go elsewhere.
bool evaluate_group(ZoneFrame& frame, ZoneGroup& group);

// ZoneGroup::exterior_force, at the group's displacements. ZoneState::boundary := w_B.
void find_exterior_force(ZoneFrame& frame, ZoneGroup& group);

// ZoneGroup::coupled, at the displacements of the other groups. Before the first delivery, where the forces t' of the other
// groups' boundaries on the linear organ move this one by b:
//
//   -T b,   b = sum of C t',   T = S + S_int
void find_coupling(ZoneFrame& frame, ZoneGroup& group);

// ZoneState::outside := the force S w + c of the exterior on the boundary (ZoneCorrection), after evaluate_group() and
// find_coupling(). ZoneState::boundary := w_B.
void find_outside(ZoneFrame& frame, const ZoneGroup& group);

// ZoneState::residual := the forces that are missing for balance, [unknowns], then what holds the contacts, three
// each. After evaluate_group(); calls find_outside().
void find_residual(ZoneFrame& frame, const ZoneGroup& group);

// ZoneSet::traction of the group: t = T (w_B - b), of the organ at rest; `since_delivery`: with the delivery's S, from where
// its w_B was, t = S_int dw + S dw of all groups. Overwrites ZoneState::boundary, residual and vector.
void find_traction(ZoneFrame& frame, const ZoneGroup& group, bool since_delivery);

// The tractions of all groups from rest, and ZoneGroup::moved_by_others, by a few sweeps.
void find_tractions_from_rest(ZoneFrame& frame);

// The group's part of the exterior's energy, after find_outside(), without the constant ZoneCorrection::energy.
double outside_energy(const ZoneFrame& frame, const ZoneGroup& group);

// What the group and the organ outside of it store, after find_residual().
double stored_energy(const ZoneFrame& frame, const ZoneGroup& group);

}  // namespace palpate
