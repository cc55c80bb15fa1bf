// Bergan's procedure: the current stiffness parameter tells how large the next load increment is, and its sign.
//
// Source: Bergan, Horrigmoe, Krakeland and Soreide 1978; named by Zhong et al. 2005 section 2.3. With K du_i = dl_i q
// the parameter compares the work of an increment with that of the first, as if both had the same load:
//   S_i = (dl_i / dl_1)^2 (du_1 . K_1 du_1) / (du_i . K_i du_i) = (v0 . q) / (v . q),   K v = q,
// 1 while the body stays linear, 0 at a limit point of the load, negative beyond it. Increments of the same work as
// the first therefore have
//   dl_i = sign(S_i) dl_1 |S_i|^a,   a = 1/2.
// a = 0 would keep to equal loads and never come to a limit point; a = 1 would keep to equal deflections q . du, of
// which a strip that buckles needs some ten thousand. At a limit point dl of a = 1/2 vanishes and dl v grows beyond
// any bound, so that an increment is no longer than the last one by more than half of it. As long as S hardly changes
// there is nothing to miss, and increments grow by so much: the buckled strip, ten thousand times softer than it was,
// would take thousands else.
//
// Here as there S sizes and directs the increment. What differs is how it comes back to equilibrium: Bergan iterates
// at the fixed load, which has no equilibrium beyond the limit point, and leaves out the iterations where |S| is
// small (as Crisfield 1981 has it), so that what is out of balance there stays. Here the load factor is an unknown
// too, and every point is corrected in the plane normal to the tangent (arc_length.hpp).
//
// As q . du = dl (v0 . q) / S, the sign of S lets the deflection under the load grow, whatever the load does. Where
// the path's own deflection turns back (snap-back), v . q passes 0 and S infinity, and the sign of S sends the load
// back to where it came from, for ever. It is compared with the last increment, and where they differ the path ends.
#pragma once

#include <cmath>

namespace palpate {

// dl_i for S_i, dl_1.
inline double bergan_load_increment(double current_stiffness, double first_increment) {
  return std::copysign(first_increment * std::sqrt(std::abs(current_stiffness)), current_stiffness);
}

// Whether increments may grow whatever S is.
inline bool is_steady(double stiffness_before, double stiffness) {
  constexpr double kSteady = 0.1;  // of S, over one increment
  return std::abs(stiffness - stiffness_before) <= kSteady * std::abs(stiffness);
}

}  // namespace palpate
