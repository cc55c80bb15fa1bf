// Bergan's procedure: the current stiffness parameter gives size and sign of the next load increment.
//
// Source: Bergan, Horrigmoe, Krakeland, Soreide 1978; Zhong et al. 2005 section 2.3. With K du_i = dl_i q:
//   S_i = (dl_i / dl_1)^2 (du_1 . K_1 du_1) / (du_i . K_i du_i) = (v0 . q) / (v . q),   K v = q.
// S is 1 while the body stays linear, 0 at a limit point of the load, negative beyond the limit point.
// Increments of constant work have
//   dl_i = sign(S_i) dl_1 |S_i|^a,   a = 1/2.
// a = 0 gives equal loads and never reaches a limit point; a = 1 gives equal deflections q . du and far more
// increments. At a limit point dl v is unbounded for a = 1/2, so an increment is at most 1.5 times the
// last increment. While S is nearly constant, an increment takes this length whatever S is.
//
// Bergan iterates at fixed load and skips iterations at small |S| (Crisfield 1981). Here the load factor is
// an unknown, and every point is corrected in the plane normal to the tangent (arc_length.hpp).
//
// q . du = dl (v0 . q) / S: the sign of S lets the deflection q . du grow. At a snap-back v . q passes 0, and
// the sign of S would reverse the load for ever. The path ends where this sign opposes the last increment.
#pragma once

#include <cmath>

namespace palpate {

// Returns dl_i for S_i and dl_1.
inline double bergan_load_increment(double current_stiffness, double first_increment) {
  return std::copysign(first_increment * std::sqrt(std::abs(current_stiffness)), current_stiffness);
}

// Whether S changes so little that increments may grow.
inline bool is_steady(double stiffness_before, double stiffness) {
  constexpr double kSteady = 0.1;  // change of S over one increment
  return std::abs(stiffness - stiffness_before) <= kSteady * std::abs(stiffness);
}

}  // namespace palpate
