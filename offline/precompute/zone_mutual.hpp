// Interaction terms of two contacts outside of their zones, of second or third order. Each contact alone has the fields
// of zone_exterior.hpp. For u = u_i + u_j, n2(u, u) also contains 2 n2(u_i, u_j), equally large far away.
//
// U1_i f_i + U1_j f_j: the linear organ's response to both forces. U2_i(f_i, f_i), U2_j, U2_ij(f_i, f_j): its
// second order. X: elements outside of both zones. Index j: elements in the zone of j alone, which are
// nonlinear there although the fields of i count them as exterior.
//
//   q_ij = -K^-1 { n2_X(U1_i, U1_j) - n2_j(U1_i, U1_i) / 2                                            second order
//                + n2_X(U1_j, U2_i) + n2_X(U1_i, U2_ij) + n3_X(U1_i, U1_i, U1_j) / 2                  third
//                - n2_j(U1_i, U2_i) - n3_j(U1_i, U1_i, U1_i) / 6 }   and all but the first with i and j exchanged
//
//   U2_i = -K_tied^-1 n2(U1_i, U1_i) / 2,   U2_ij = -K_tied^-1 n2(U1_i, U1_j)
//
// The forces f are arguments. K_tied: each patch is rigid, without a further force. By St. Venant's principle
// a patch acts on the other zone through its net force only. Pairs with a patch in the other's zone
// (ZoneSet::near) carry second order only.
//
// For each pair and ring, 21 fields (77 to third order) are approximated in two sets of columns:
//   1. the first sixteen columns of each site's exterior, which nearly cancel for opposed near sites,
//   2. the pair's own columns: singular vectors of the remainder outside of the most rings, as int8.
// The own columns serve the pack's full number of rings; fewer rings gain little. Only rows outside of both
// zones count. Interaction of three contacts beyond pairs is negligible (bench/zones/ZONES.md).
#pragma once

#include <functional>

#include "offline/precompute/nonlinear_zone.hpp"

namespace palpate {

// Fills ZoneTables::pair_fields and pair_weights to its pair_degree, on `jobs` threads; the other members
// must be present. Linear organs get nothing. `progress` gets the finished fraction, from one thread at a
// time. Cost for each pair: 21 back-solves a ring and nine products with a matrix like K; to third order 77 a
// ring and nine, 13 assemblies of K, and 135 products. Memory of a site: as many columns as its patch has
// dofs. Throws std::runtime_error when the stiffness at rest is not positive definite.
void compute_zone_mutual(const Assembly& assembly, const Scene& scene, const ContactSites& sites,
                         const RestState& rest, int threads, const std::function<void(double)>& progress,
                         ZoneTables& zone);

}  // namespace palpate
