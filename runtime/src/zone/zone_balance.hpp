// The forces on the nodes of a group: of its own elements, of the exterior, and of the other groups. nonlinear_zone.hpp
// and zone_set.hpp have the equations and the names. Units of the model.
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/zone/zone_set.hpp"

namespace palpate {

// A set, and the vectors of the lane that evaluates it.
struct ZoneFrame {
  const pal_pack& pack;
  const EliminationKernel& kernel;
  ZoneWork& work;
  ZoneSet& set;
  uint32_t flags;
};

inline ZoneFrame frame_of(const pal_pack& pack, ZoneState& state) {
  return {pack, state.kernel, state.work, state.active, 0};
}

// Leaves what acts on the group where its nodes are: the forces of the elements beyond those at rest in
// ZoneWork::forces, and their energy and S w_B in the group. False where an element is inverted or nearly so, or a
// node so far away that numbers lose their meaning: what is left then is of no use, and the nodes have to go elsewhere.
bool evaluate_group(ZoneFrame& frame, ZoneGroup& group);

// ZoneGroup::exterior_force, at the group's displacements. ZoneWork::boundary := w_B.
void find_exterior_force(ZoneFrame& frame, ZoneGroup& group);

// Adds the force S_gh x on the boundary of a group by a displacement x of the boundary of another group, [stride of the
// boundary], to `force`, [stride of the boundary].
void add_coupling(const ZoneFrame& frame, const ZoneGroup& group, const ZoneGroup& other, const double* x,
                  double* force);

// ZoneGroup::coupled, at the displacements of the other groups.
void find_coupling(ZoneFrame& frame, ZoneGroup& group);

// ZoneWork::outside := the force S w + c of the exterior on the boundary (ZoneCorrection), after evaluate_group() and
// find_coupling(). ZoneWork::boundary := w_B.
void find_outside(ZoneFrame& frame, const ZoneGroup& group);

// ZoneWork::residual := the forces that are missing for balance, [unknowns], then the forces on the contacts, three
// each. After evaluate_group(); calls find_outside().
void find_residual(ZoneFrame& frame, const ZoneGroup& group);

// The group's part of the exterior's energy, after find_outside(), without the constant ZoneCorrection::energy.
double outside_energy(const ZoneFrame& frame, const ZoneGroup& group);

// What the group and the organ outside of it store, after find_residual().
double stored_energy(const ZoneFrame& frame, const ZoneGroup& group);

}  // namespace palpate
