// What two contacts add to each other outside of their zones, to second order: by themselves each has the fields of
// zone_exterior.hpp, but n2(u, u) of u = u_i + u_j holds 2 n2(u_i, u_j), too, and far away, where their fields have
// become one, that is as much.
//
//   q_ij(f_i, f_j) = -K^-1 { n2_X(U1_i f_i, U1_j f_j)                                 X outside of both zones
//                          - n2_j(U1_i f_i, U1_i f_i) / 2 - n2_i(U1_j f_j, U1_j f_j) / 2 }
//
// n2_j: of the elements in the zone of j alone, which are nonlinear in full there, while the fields of i count them
// as outside of its own. Twenty-one fields for each pair of sites and each ring are made of what both sites carry,
// the sixteen fields of each alone, for near sites have nearly the same, and where these pull against each other what
// they add nearly cancels; and of some of the pair's own: the singular vectors of what remains outside of the most
// rings, in bytes. Of those it takes many: on the brain, of 4 to 5 % of |d| that pairs add at loads of length 1 (a
// push to one edge), the median pair keeps 2 without any, 1.1 with four, 0.56 with eight, 0.3 with twelve and 0.15
// with sixteen. With fewer rings than the pack has they are of little use: one of two leaves 4. Only rows outside of
// both zones count.
#pragma once

#include <functional>

#include "offline/precompute/nonlinear_zone.hpp"

namespace palpate {

// Fills ZoneTables::pair_fields and pair_weights for the pairs of num_zone_pairs(), on so many threads; the rest is
// there. Nothing where the organ outside adds nothing, as linear ones do. `progress` gets the part of the work that
// is done, 0 to 1, from any of the threads, one at a time. Cost: for each pair 21 back-solves a ring and nine
// products K(u) v with all elements. Throws std::runtime_error when the stiffness at rest is not positive definite.
void compute_zone_mutual(const Assembly& assembly, const Scene& scene, const ContactSites& sites,
                         const RestState& rest, int threads, const std::function<void(double)>& progress,
                         ZoneTables& zone);

}  // namespace palpate
