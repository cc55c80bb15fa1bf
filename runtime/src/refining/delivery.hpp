// What an iteration of the refining lane delivers.
#pragma once

#include "runtime/src/refining/refinement.hpp"

namespace palpate {

// c and C of the delivery: with g, E and w_e of the iteration, the blocks S of the groups, and the exterior in equilibrium to
// second order,
//
//   c = g - S w_e,   C = E - D - w_e . (c + S w_e / 2),   D = r_O . K_OO^-1 r_O / 2
//
// D is the energy that the exterior still gives up on its way to equilibrium. Returns false in two cases:
//   - D is more than kMostUnbalanced of the stored energy, as where a stiff part of the organ turns. Such an answer is
//     worse than one to first order.
//   - Numbers are not finite, as in a damaged pack.
bool find_correction(const pal_pack& pack, const EliminationKernel& kernel, Refinement& of, bool& is_finite);

// Refinement::blocks of the condensation.
void copy_blocks(Refinement& of);

// The displacements of the packed nodes, to the request's field.
void write_field(const pal_pack& pack, const Refinement& of);

// The largest component by which the last iteration moved the exterior.
double find_change(const pal_pack& pack, const Refinement& of);

}  // namespace palpate
