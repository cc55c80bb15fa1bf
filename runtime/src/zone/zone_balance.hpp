// The forces on the nodes of a group: of its own elements, of the exterior, and of the other groups. nonlinear_zone.hpp
// has the equations and the names. Units of the model.
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

// ZoneGroup::coupled and coupled_change, at the tractions of the other groups.
void find_coupling(ZoneFrame& frame, ZoneGroup& group);

// ZoneState::outside := the force s + c of the exterior on the boundary (ZoneCorrection), s = S w_B - T b, after
// evaluate_group(). ZoneState::boundary := w_B.
void find_outside(ZoneFrame& frame, const ZoneGroup& group);

// ZoneState::residual := the forces that are missing for balance, [unknowns], then what holds the contacts, three
// each. After evaluate_group(); calls find_outside().
void find_residual(ZoneFrame& frame, const ZoneGroup& group);

// The group's tractions, of the find_residual() before.
void find_traction(ZoneFrame& frame, const ZoneGroup& group);

// The energy of the exterior of the group, after find_outside() and find_traction(), without the constant
// ZoneCorrection::energy of all groups.
double outside_energy(const ZoneFrame& frame, const ZoneGroup& group);

// What the group and the organ outside of it store, after find_residual() and find_traction().
double stored_energy(const ZoneFrame& frame, const ZoneGroup& group);

}  // namespace palpate
