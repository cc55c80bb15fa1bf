// Gravity: the organ's rest, and the change of the response when gravity turns.
//
// The pack holds the rest u(g0) and, for a device that may tilt, G = du/dg. Contacts move by d from rest
// under g0. With t = g - g0, G_H the rows of G at the held nodes, and M = A^-1 (linear_dd):
//
//   u = u(g0) + G t + C f,  u_H = u_H(g0) + E d   =>   f = X d - Y t,     Y = M G_H
//                                                      F = S d - Q t,     Q = E^T Y
//   W = (d.S d - 2 d.Q t + t.Z t) / 2,                 Z = G_H^T Y
#pragma once

#include <palpate/palpate.h>

#include "runtime/src/numerics/field_kernel.hpp"

namespace palpate {

// Writes the rest displacement of `count` panels from `first` on, API units. `turn`: t times the metres of a
// length unit, or null for the scene's gravity. In a pack without gravity, returns false and writes nothing.
bool fill_rest(const pal_pack& pack, const FieldKernel& kernel, const pal_real* turn, uint32_t first,
               uint32_t count, pal_real* rows);

// Adds the rest displacement of one packed node to its three rows; `turn` as for fill_rest().
void add_rest(const pal_pack& pack, const pal_real* turn, uint32_t node, pal_real* rows);

}  // namespace palpate
