// The exterior of a zone: fields of second and higher orders in the contact's force, beyond the linear response.
//
// About rest P(u) = K u + n(u). A zone's elements are fully nonlinear; outside only K acts, and the remainder decays
// slowly with the rings (bench/zones/ZONES.md). By St. Venant's principle the remainder depends on the contact's net
// force f alone. With u(f) the organ's response to a force at the rigid patch, and n_X the part of n from elements
// outside of the zone:
//
//   u = linear response + q(f),   q(f) = -K^-1 n_X(u(f)),
//
// a power series in f whose lowest orders the pack carries. Along f = t r, u(f) = a_1 t + a_2 t^2 + ...
// (taylor_orders.hpp). With c_j order j of P along the path up to a_(j-1), and c_j,X its part from outside elements:
//
//   K_tied a_j = -c_j,   K q_j = -c_j,X
//
// K_tied: rigid patch without a further force. All solves are back-solves with the factor at rest.
#pragma once

#include <Eigen/Core>
#include <functional>

#include "offline/precompute/nonlinear_zone.hpp"

namespace palpate {

// Adds a ring to zones whose highest exterior order exceeds twice the scene's accuracy target of |d|, at the
// scene's largest displacement in a linear organ: tips and ridges. Zones stay unchanged where the pack
// carries a lower order than the highest. Cost and errors as compute_zone_exterior() with one ring.
ZoneTables widen_zones(const Assembly& assembly, const Scene& scene, const ContactSites& sites,
                       const RestState& rest, int threads, const std::function<void(int)>& progress,
                       const ZoneTables& zone);

// Fills ZoneTables::force_scale and exterior to its exterior_degree, on `jobs` threads. Linear organs give zeros. Sites
// get a lower degree where the patch is far softer along one axis, or an element inverts within 0.001 edges. Throws
// std::runtime_error when the stiffness at rest is not positive definite. `progress` gets finished sites, from one
// thread at a time. Cost of a site of degree n, R = num_rays(n): 4 R (n - 1) evaluations of P; R (n - 1) back-solves,
// again for each ring; 3 for each patch node. Memory of a thread: about n R (rings + 2) numbers for each dof.
void compute_zone_exterior(const Assembly& assembly, const ContactSites& sites, const RestState& rest,
                           double max_displacement, int threads, const std::function<void(int)>& progress,
                           ZoneTables& zone);

}  // namespace palpate
