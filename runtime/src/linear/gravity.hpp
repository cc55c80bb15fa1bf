// Gravity: where the organ rests in it, and what changes when it turns.
//
// The pack holds the rest u(g0) and, where the device may be tilted, G = du/dg (offline rest_state). Contacts
// move by d from rest under g0, wherever gravity has turned since; with t = g - g0, G_H the rows of G of the
// held nodes, and M = A^-1 (linear_dd):
//
//   u = u(g0) + G t + C f,  u_H = u_H(g0) + E d   =>   f = X d - Y t,     Y = M G_H
//                                                      F = S d - Q t,     Q = E^T Y
//   W = (d.S d - 2 d.Q t + t.Z t) / 2,                 Z = G_H^T Y
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/numerics/field_kernel.hpp"

namespace palpate {

// Rows of `count` panels from `first` on: where the organ rests, API units, with gravity turned by `turn`
// (t times the metres of a length unit; null: not at all). False where there is no gravity: nothing is written.
bool fill_rest(const pal_pack& pack, const FieldKernel& kernel, const pal_real* turn, uint32_t first,
               uint32_t count, pal_real* rows);

// The same of one packed node, added to its three rows.
void add_rest(const pal_pack& pack, const pal_real* turn, uint32_t node, pal_real* rows);

}  // namespace palpate
