// The live exterior: the organ outside of a zone comes to equilibrium with the zone, an iteration at a time.
//
// r(u): the forces of the elements outside of the zone, beyond those at rest. One iteration takes the zone's
// displacement u_V, and with the condensation of condensation.hpp at a nearby state
//
//   extends     u_O <- u_O - K_OO^-1 (r_O + K_OB du_B),   du_B = u_B - (u_B of the last iteration)
//   evaluates   r at (u_V, u_O)
//   condenses   g = r_B - K_BO K_OO^-1 r_O
//
// With the forces P of the zone's own elements, the zone is then in equilibrium at u' where P_B(u') + g + S (u'_B - u_B)
// vanishes. That is Newton's method for the whole organ with an old tangent outside of the zone. The fixed point, r_O = 0
// and P_B + r_B = 0, is the solution of the whole organ, whatever K is; K decides how fast the iterations converge.
//
// Source: Gendre, Allix, Gosselet and Comte 2009, Comput. Mech. 44 (iterative global-local coupling).
#pragma once

#include "runtime/src/exterior/acceleration.hpp"
#include "runtime/src/exterior/condensation.hpp"

namespace palpate {

struct ExteriorState {
  double* rest_force;    // [num_nodes][3] of the elements outside at rest: the organ's weight holds them
  double* displacement;  // [num_nodes][3] u, from the mesh
  double* forces;        // [num_nodes][3] g on kept nodes; L^-1 r on eliminated nodes
  double rest_energy;    // stored by the elements outside at rest
  double energy;         // stored at u beyond that, less the work of rest_force: 0 at rest
  // The iteration under way
  enum class Phase : uint32_t { extend, evaluate, condense, ended } phase;
  uint32_t front;       // fronts that the phase has passed
  double part;          // of the step to the next u: 1, halved by each iteration that fails
  double* next;         // [num_nodes][3] its u
  double* next_forces;  // [num_nodes][3] and r
  ZoneStrain strain;
};

void carve_exterior(const pal_pack& pack, Arena& arena, ExteriorState& state);

// At rest, where r = 0. Cost: one pass over the elements.
void rest_exterior(const Exterior& exterior, ExteriorState& state);

// Begins an iteration. `zone`: [num_nodes][3] from the mesh, read on kept and absent nodes.
void begin_iteration(const Exterior& exterior, const Condensation& condensation, const double* zone,
                     ExteriorState& state);

// Begins an iteration without an extension: evaluates and condenses where the exterior is, as with a new condensation.
void begin_evaluation(const Exterior& exterior, ExteriorState& state);

// Advances the iteration for about so many multiply-adds and adds the work to `spent`. The same bits for any slices. Fails
// where an element outside would be inverted or nearly so: the state is then as before the iteration, the
// acceleration restarts, and the next iteration goes half as far. Iterations that succeed double that part up to 1. No
// condensation may advance during an iteration: both read the pressures of shared volumes.
// `acceleration`: mixes the whole of u, the zone's nodes too, where the zone's next solution starts; or null. Restart it
// where contacts have moved.
Progress advance_iteration(const Exterior& exterior, const Condensation& condensation, uint64_t operations,
                           CondensationScratch& scratch, Acceleration* acceleration, ExteriorState& state,
                           uint64_t& spent);

// Adds the forces of a front's elements outside of the zone, and their energy and smallest det F. Returns
// multiply-adds.
uint64_t evaluate_front(const Exterior& exterior, uint32_t front, const double* displacement,
                        ZoneStrain& strain, double* forces);

}  // namespace palpate
