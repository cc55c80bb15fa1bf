// What two contacts add to each other outside of their zones, to second order: by themselves each has the fields of
// zone_exterior.hpp, but n2(u, u) of u = u_i + u_j holds 2 n2(u_i, u_j), too, and far away, where their fields have become
// one, that is as much.
//
//   q_ij(f_i, f_j) = -K^-1 { n2_X(U1_i f_i, U1_j f_j)                                 X outside of both zones
//                          - n2_j(U1_i f_i, U1_i f_i) / 2 - n2_i(U1_j f_j, U1_j f_j) / 2 }
//
// n2_j: of the elements in the zone of j alone, which are nonlinear in full there, while the fields of i count them as
// outside of its own. Twenty-one fields for each pair of sites are too many to carry. They are made of what both sites carry:
// the sixteen fields of each alone, for near sites have nearly the same, and where these pull against each other what they
// add nearly cancels; and pack::kMostMutual more of each site, the singular vectors of what remains of some of its pairs about
// it. On the brain, of what pairs add at loads of length 1 (a push to one edge) that leaves 0.9 % of it (p95). Only rows outside
// of both zones count.
#pragma once

#include <functional>

#include "offline/precompute/nonlinear_zone.hpp"

namespace palpate {

// Adds columns to ZoneTables::exterior and fills mutual for the pairs of num_zone_pairs(), on so many threads; the rest is
// there. Nothing where the organ outside adds nothing, as linear ones do.
// `progress` gets the part of the work that is done, 0 to 1, from any of the threads, one at a time. Cost: for each pair, and before
// for up to 40 of each site, 21 back-solves a ring and nine products K(u) v with all elements. Throws std::runtime_error when the
// stiffness at rest is not positive definite.
void compute_zone_mutual(const Assembly& assembly, const ContactSites& sites, const RestState& rest,
                         int max_contacts, int threads, const std::function<void(double)>& progress,
                         ZoneTables& zone);

}  // namespace palpate
