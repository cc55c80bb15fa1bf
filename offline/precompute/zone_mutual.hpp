// What two contacts add to each other outside of their zones, to second or third order: by themselves each has the
// fields of zone_exterior.hpp, but n2(u, u) of u = u_i + u_j holds 2 n2(u_i, u_j), too, and far away, where their
// fields have become one, that is as much.
//
// With u = U1_i f_i + U1_j f_j how the linear organ answers the forces of both, U2_i(f_i, f_i), U2_j and U2_ij(f_i,
// f_j) the second order of that, X the elements outside of both zones and j those in the zone of j alone, which are
// nonlinear in full there while the fields of i count them as outside of its own,
//
//   q_ij = -K^-1 { n2_X(U1_i, U1_j) - n2_j(U1_i, U1_i) / 2                                            second order
//                + n2_X(U1_j, U2_i) + n2_X(U1_i, U2_ij) + n3_X(U1_i, U1_i, U1_j) / 2                  third
//                - n2_j(U1_i, U2_i) - n3_j(U1_i, U1_i, U1_i) / 6 }   and all but the first with i and j exchanged
//
//   U2_i = -K_tied^-1 n2(U1_i, U1_i) / 2,   U2_ij = -K_tied^-1 n2(U1_i, U1_j)
//
// with the forces f as arguments and K_tied the organ whose patches move as one each, without a force of their own;
// what one patch does to the other's zone beyond a net force is left out, as St. Venant's principle has it. Of
// contacts one of whose patches reaches into the other's zone (ZoneSet::near) nothing is carried beyond the second
// order.
//
// Twenty-one fields to second order, 77 to third, for each pair of sites and each ring are made of what both sites
// carry, the first sixteen fields of each alone, for near sites have nearly the same, and where these pull against each
// other what they add nearly cancels; and of some of the pair's own: the singular vectors of what remains outside of
// the most rings, in bytes. Of those it takes many: on the brain, of 4 to 5 % of |d| that pairs add at loads of
// length 1 (a push to one edge), the median pair keeps 2 without any, 1.1 with four, 0.56 with eight, 0.3 with twelve
// and 0.15 with sixteen. With fewer rings than the pack has they are of little use: one of two leaves 4. Only rows
// outside of both zones count.
//
// Of three contacts to two edges, outside of two rings, the sum of what each has alone, to fifth order, and of what its
// pairs have to second leaves 0.6 % of |d| in the median, to third 0.28; what three add to each other beyond their
// pairs is nothing beside that.
#pragma once

#include <functional>

#include "offline/precompute/nonlinear_zone.hpp"

namespace palpate {

// Fills ZoneTables::pair_fields and pair_weights of its pairs, to its pair_degree, on so many threads; the rest
// is there. Nothing where the organ outside adds nothing, as linear ones do. `progress` gets the part
// of the work that is done, 0 to 1, from any of the threads, one at a time. Cost: for each pair 21 back-solves a ring
// and nine products of a vector with a matrix like K; to third order 77 a ring and nine, 13 assemblies of K, and 135 of
// those products; memory of each site then as many columns of the organ as its patch has dofs. Throws
// std::runtime_error when the stiffness at rest is not positive definite.
void compute_zone_mutual(const Assembly& assembly, const Scene& scene, const ContactSites& sites,
                         const RestState& rest, int threads, const std::function<void(double)>& progress,
                         ZoneTables& zone);

}  // namespace palpate
