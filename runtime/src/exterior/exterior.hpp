// The live exterior: iterations bring the organ outside of a zone to equilibrium with the zone.
//
// r(u): the forces of the elements outside of the zone, beyond their forces at rest. An iteration takes the
// zone's displacement u_V and a condensation (condensation.hpp) at a nearby state. The iteration
//
//   extends     u_O <- u_O - K_OO^-1 (r_O + K_OB du_B),   du_B = u_B - (u_B of the last iteration)
//   evaluates   r at (u_V, u_O)
//   condenses   g = r_B - K_BO K_OO^-1 r_O
//
// P: forces of the zone's elements. Then the zone is in equilibrium at u': P_B(u') + g + S (u'_B - u_B) = 0.
// The iterations are Newton's method for the whole organ with an old tangent outside of the zone. The fixed
// point, r_O = 0 and P_B + r_B = 0, is the whole organ's solution for any K. K sets the rate of convergence.
//
// Source: Gendre, Allix, Gosselet and Comte 2009, Comput. Mech. 44 (iterative global-local coupling).
#pragma once

#include "runtime/src/exterior/acceleration.hpp"
#include "runtime/src/exterior/condensation.hpp"

namespace palpate {

struct ExteriorState {
  double* rest_force;    // [num_nodes][3] forces of the elements outside at rest, which balance the weight
  double* displacement;  // [num_nodes][3] u, from the mesh
  double* forces;        // [num_nodes][3] g on kept nodes; L^-1 r on eliminated nodes
  double rest_energy;    // stored by the elements outside at rest
  double energy;         // stored at u beyond rest_energy, less the work of rest_force: 0 at rest
  // The iteration in progress
  enum class Phase : uint32_t { extend, evaluate, condense, ended } phase;
  uint32_t front;       // number of fronts that the phase has passed
  double part;          // factor of the step: 1, halved by each iteration that fails
  double* next;         // [num_nodes][3] change of u while the phase is `extend`, then the next u
  double* next_forces;  // [num_nodes][3] r at the next u; `condense` turns r into `forces`
  ZoneStrain strain;    // energy and smallest det F of the elements outside at the next u
};

void carve_exterior(const pal_pack& pack, Arena& arena, ExteriorState& state);

// Puts the exterior at rest, where r = 0. Cost: one pass over the elements.
void rest_exterior(const Exterior& exterior, ExteriorState& state);

// Begins an iteration. `zone`: [num_nodes][3] from the mesh; read on kept and absent nodes alone.
void begin_iteration(const Exterior& exterior, const Condensation& condensation, const double* zone,
                     ExteriorState& state);

// Begins an iteration without an extension: evaluates r at the current u, and condenses r.
void begin_evaluation(const Exterior& exterior, ExteriorState& state);

// Advances the iteration until `spent` reaches `operations`, multiply-adds. The result has the same bits for
// any slices. The iteration fails if an element outside would be inverted, or nearly. A failed iteration
// keeps u and `forces` as they were, restarts the acceleration and halves the next step. A good iteration
// doubles the next step, up to 1. No condensation may advance during an iteration: both use the pressures of
// shared volumes. `acceleration` mixes u of all nodes. Restart it after contacts have moved.
Progress advance_iteration(const Exterior& exterior, const Condensation& condensation, uint64_t operations,
                           CondensationScratch& scratch, Acceleration& acceleration, ExteriorState& state,
                           uint64_t& spent);

// Adds the forces of the front's elements outside of the zone, and adds their energy and smallest det F to
// `strain`. Returns multiply-adds.
uint64_t evaluate_front(const Exterior& exterior, uint32_t front, const double* displacement,
                        ZoneStrain& strain, double* forces);

}  // namespace palpate
