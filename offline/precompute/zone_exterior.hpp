// What the organ outside of a zone adds to its linear answer: fields of second and third order in the contact's
// force.
//
// About rest the internal force is P(u) = K u + n(u), n(u) = n2(u, u) / 2 + n3(u, u, u) / 6 + ... In the zone of a
// contact the elements are nonlinear in full. Outside of it only K was, and what that leaves out falls off slowly: on
// the brain, at |d| = 1 h, it is 2 % of |d| beyond one ring, 1.2 beyond two and still 0.4 beyond five. But out there,
// by St. Venant's principle, it hardly depends on how the contact takes hold, only on its force f: with n_X the part
// of n that comes from the elements outside of the zone, U1 f and U2(f, f) the first two orders of how the organ
// answers a force at the patch,
//
//   u = linear answer + q(f),   q(f) = -K^-1 { n2_X(U1 f, U1 f) / 2                                  second order
//                                            + n2_X(U1 f, U2(f, f)) + n3_X(U1 f, U1 f, U1 f) / 6 }   third
//   U2(f, f) = -K_tied^-1 n2(U1 f, U1 f) / 2
//
// K_tied: the nodes of the patch move as one, without a force of their own. No sample is solved for: six and ten
// columns of back-solves with the factor at rest, derivatives of P by differences of K. On the brain that leaves 0.11
// % beyond one ring and 0.04 beyond two.
#pragma once

#include <Eigen/Core>
#include <functional>

#include "offline/precompute/nonlinear_zone.hpp"

namespace palpate {

// Fills ZoneTables::force_scale, inner_nodes and exterior, on so many threads. Throws std::runtime_error when the
// stiffness at rest is not positive definite. `progress` gets the sites done, from any of the threads, one at a time.
// Cost of a site and ring: some 16 back-solves; of a site besides, 3 for each node of its patch and 15 products K(u)
// v with all elements.
void compute_zone_exterior(const Assembly& assembly, const ContactSites& sites, const RestState& rest,
                           double max_displacement, int threads, const std::function<void(int)>& progress,
                           ZoneTables& zone);

}  // namespace palpate
