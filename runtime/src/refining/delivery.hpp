// The result of an exterior iteration, for the frames (ZoneDelivery in zone_mailbox.hpp).
#pragma once

#include "runtime/src/refining/refinement.hpp"

namespace palpate {

// Computes c and C of the delivery. g, E: the exterior's force and energy after an iteration. w_e: the
// boundary's displacement from rest. S: the groups' blocks.
//
//   c = g - S w_e,   C = E - D - w_e . (c + S w_e / 2),   D = r_O . K_OO^-1 r_O / 2
//
// D is the energy that the exterior still gives up on its way to equilibrium, to second order. Stores D in
// IterationHistory, and clears `failures` if D has halved. Returns false in two cases:
//   - D exceeds kMostUnbalanced E, as where a stiff part turns: an answer to first order is better.
//   - A number is not finite, as in a damaged pack.
bool find_correction(const pal_pack& pack, const EliminationKernel& kernel, Refinement& lane,
                     bool& is_finite);

// Copies the blocks of S on the diagonal, a block for each group, to Refinement::blocks.
void copy_blocks(Refinement& lane);

// Writes the displacements of the packed nodes, and their response U, to the request's field.
void write_field(const pal_pack& pack, const Refinement& lane);

// Returns the largest component of the displacement by which the last iteration moved a node.
double find_largest_change(const pal_pack& pack, const Refinement& lane);

}  // namespace palpate
