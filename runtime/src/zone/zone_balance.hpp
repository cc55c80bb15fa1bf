// The forces on the nodes of a group, from the group's elements, the exterior and the other groups. Units of
// the model. nonlinear_zone.hpp and zone_set.hpp define P, w, B, S and c.
//
// S has a block S_gh for each pair of groups. The exact force S_gh w_h of group h on group g would couple all
// groups in one solve. A frame instead linearises the *other* groups about the boundary displacements w_h^e
// of the last delivery. With U_h = dw_h/dd (field_response.hpp), and d the change of the axes since then,
//
//   w_h = w_h^e + U_h d,     T_g = sum of S_gh U_h over h != g,     M = sum of T_g^T U_g over g
//
// the exterior stores the energy and exerts the forces on boundaries and axes
//
//   E   = sum over g of (w_g . S_gg w_g / 2 + c_g . w_g + (w_g - w_g^e) . T_g d) - d . M d / 2 + C
//   q_g = dE/dw_g = S_gg w_g + c_g + T_g d
//   p   = dE/dd   = sum over g of T_g^T (w_g - w_g^e) - M d
//
// Each group is solved alone, and the forces are still the gradient of one energy. c and C make q_g and E
// exact at the delivery. Errors of q_g and p are of second order in d. p is zero for a linear response.
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/zone/zone_set.hpp"

namespace palpate {

// A set, and the vectors of the lane that evaluates it. Not a haptic frame: the refining lane has one too.
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

// Computes P(w) - P(0) in ZoneWork::forces, and the elements' energy and S w_B in the group. Returns false,
// with invalid results, if an element is inverted or nearly so, or if a node is absurdly far away.
bool evaluate_group(ZoneFrame& frame, ZoneGroup& group);

// ZoneSet::rest_force := the forces of the group's elements at rest, with the pressures of shared volumes
// there. `rest`: [max_nodes][3] scratch for displacements at rest.
void find_rest_force(const pal_pack& pack, double* rest, ZoneSet& set, const ZoneGroup& group);

// GroupExterior::force := S w_B, and ZoneWork::boundary := w_B.
void find_exterior_force(ZoneFrame& frame, ZoneGroup& group);

// GroupExterior::coupled := T d of all groups.
void find_coupling(ZoneFrame& frame);

// Returns - d . (sum of T_g^T w_g^e) - d . M d / 2, the part of E, besides C, that no group has.
double coupled_energy(const ZoneFrame& frame);

// ZoneSet::coupled_force := p.
void find_coupled_force(ZoneFrame& frame);

// forces[axes of the set] := sum over groups of T^T w. displacement[max_nodes][3]: from the mesh.
void find_axis_forces(ZoneFrame& frame, const double* displacement, double* forces);

// ZoneWork::outside := q, and ZoneWork::boundary := w_B. Call evaluate_group() and find_coupling() first.
void find_outside(ZoneFrame& frame, const ZoneGroup& group);

// ZoneWork::residual := r = P(w) - P(0) + [q]_B on the unknowns, then the forces and torques on the contact
// axes. Also computes ZoneSet::turning. Call evaluate_group() and find_coupling() first.
void find_residual(ZoneFrame& frame, const ZoneGroup& group);

// Returns the group's part of E, w . S w / 2 + c . w + w . T d. Call find_outside() first.
double outside_energy(const ZoneFrame& frame, const ZoneGroup& group);

// Returns outside_energy() plus the elements' energy less the work of P(0). Call find_residual() first.
double stored_energy(const ZoneFrame& frame, const ZoneGroup& group);

}  // namespace palpate
