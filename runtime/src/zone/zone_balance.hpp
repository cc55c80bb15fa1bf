// The forces on the nodes of a group: of its own elements, of the exterior, and of the other groups. nonlinear_zone.hpp
// and zone_set.hpp have the names. Units of the model.
//
// S has a block S_gh for each pair of groups. Zones would share one solve if group h acted on group g by S_gh w_h. Instead
// a frame takes the boundaries of the *other* groups to first order from the last delivery, which had the boundaries at
// w_h^e and the contact axes at d_e. With U_h = dw_h/dd (field_response.hpp) and d the change of the axes since,
//
//   w_h = w_h^e + U_h d,     T_g = sum of S_gh U_h over h != g,     M = sum of T_g^T U_g over g
//
// the exterior stores the energy and exerts the forces on boundaries and axes
//
//   E   = sum over g of (w_g . S_gg w_g / 2 + c_g . w_g + (w_g - w_g^e) . T_g d) - d . M d / 2 + C
//   q_g = dE/dw_g = S_gg w_g + c_g + T_g d
//   p   = dE/dd   = sum over g of T_g^T (w_g - w_g^e) - M d
//
// So each group is solved alone, and the forces are still the gradient of one energy. c and C make q_g and E exact at the
// delivery. The error of q_g is of second order in d; p, too, which is zero where the zones respond linearly.
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

// ZoneGroup::exterior.force, at the group's displacements. ZoneWork::boundary := w_B.
void find_exterior_force(ZoneFrame& frame, ZoneGroup& group);

// ZoneGroup::exterior.coupled of all groups, T d, at the axes that the set has.
void find_coupling(ZoneFrame& frame);

// The part - d . sum of T^T w^e - d . M d / 2 of the exterior's energy, which no single group has.
double coupled_energy(const ZoneFrame& frame);

// ZoneSet::coupled_force, p, at the displacements and axes that the set has.
void find_coupled_force(ZoneFrame& frame);

// Sum over groups of T^T w, [axes of the set], for displacements of the set's nodes, [max_nodes][3] from the mesh.
void find_axis_forces(ZoneFrame& frame, const double* displacement, double* forces);

// ZoneWork::outside := the force q of the exterior on the boundary, after evaluate_group() and find_coupling().
// ZoneWork::boundary := w_B.
void find_outside(ZoneFrame& frame, const ZoneGroup& group);

// ZoneWork::residual := the forces that are missing for balance, [unknowns], then the forces on the contacts, three
// each. After evaluate_group(); calls find_outside().
void find_residual(ZoneFrame& frame, const ZoneGroup& group);

// The group's part of the exterior's energy, w . S w / 2 + c . w + w . T d, after find_outside().
double outside_energy(const ZoneFrame& frame, const ZoneGroup& group);

// What the group and the organ outside of it store, after find_residual().
double stored_energy(const ZoneFrame& frame, const ZoneGroup& group);

}  // namespace palpate
