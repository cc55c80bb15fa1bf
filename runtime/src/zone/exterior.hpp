// The live exterior: the whole organ outside of a zone in equilibrium, an iteration at a time.
//
// With the forces r(u) of all elements beyond those at rest, and the condensation of condensation.hpp at a nearby
// state, one iteration takes the zone's displacement u_V and
//
//   extends     du_O = -K_OO^-1 (r_O + K_OB du_B),   du_B = u_B - (u_B of the last iteration),   u_O <- u_O + du_O
//   evaluates   r at (u_V, u_O)
//   condenses   g = r_B - P_B - K_BO K_OO^-1 r_O,    P: the forces of the zone's own elements
//
// With it the zone is in equilibrium where P_B(u_V) + g + S (u_B' - u_B) = 0 for its next displacement u'. That is
// Newton's method for the whole organ with an old tangent outside of the zone. The fixed point r = 0 is the solution
// of the whole organ, whatever K is; K decides how fast the iterations converge (acceleration.hpp).
//
// Source: Gendre, Allix, Gosselet and Comte 2009, Comput. Mech. 44 (iterative global-local coupling).
#pragma once

#include "runtime/src/zone/condensation.hpp"

namespace palpate {

struct OrganState {
  double* rest_force;    // [num_nodes][3] of all elements at rest: the organ's weight holds them
  double* displacement;  // [num_nodes][3] u, from the mesh
  double*
      forces;  // [num_nodes][3] r, zero on fixed axes; after condense_exterior() as forward_substitute() says
  double* extension;  // [num_nodes][3] scratch
  double energy;      // stored by all elements at u, less the work of rest_force
  double smallest_jacobian;
};

void carve_organ_state(const pal_pack& pack, Arena& arena, OrganState& state);

// At rest, where no forces act. Cost: one pass over the elements.
void rest_organ(const pal_pack& pack, const OrganElements& elements, OrganState& state);

// u_O of the next iteration. `zone`: [num_nodes][3], read on kept and absent nodes, where it becomes the organ's.
void extend_exterior(const pal_pack& pack, const Condensation& condensation, const EliminationKernel& kernel,
                     const double* zone, CondensationScratch& scratch, OrganState& state);

// r, energy and smallest det F at `displacement`. Returns false where an element is inverted or nearly so: the
// forces then mean nothing.
bool evaluate_organ(const pal_pack& pack, const OrganElements& elements, OrganState& state);

// g on the kept nodes of `forces`. `zone_forces`: [num_kept][3] P_B at `displacement`, less that at rest.
void condense_exterior(const Condensation& condensation, const EliminationKernel& kernel,
                       const double* zone_forces, CondensationScratch& scratch, OrganState& state);

}  // namespace palpate
