// What the organ outside of a zone adds to its linear answer: fields of second and higher orders in the contact's
// force.
//
// About rest the internal force is P(u) = K u + n(u). In the zone of a contact the elements are nonlinear in full.
// Outside of it only K was, and what that leaves out falls off slowly: on the brain, at |d| = 1 h, it is 2 % of |d|
// beyond one ring, 1.2 beyond two and still 0.4 beyond five. But out there, by St. Venant's principle, it hardly
// depends on how the contact takes hold, only on its force f: with u(f) how the organ answers a force at the patch,
// whose nodes move as one, and n_X the part of n that comes from the elements outside of the zone,
//
//   u = linear answer + q(f),   q(f) = -K^-1 n_X(u(f)),
//
// a power series in f, of which the lowest orders are carried. Along f = t r, u(f) = a_1 t + a_2 t^2 + ...
// (path_orders.hpp), with c_j the order j of P of the path up to a_(j-1), and c_j,X that of the elements outside, as
//
//   K_tied a_j = -c_j,   K q_j = -c_j,X
//
// K_tied: the nodes of the patch move as one, without a force of their own. No sample is solved for: all are
// back-solves with the factor at rest, along displacements of the patch, whatever forces those take.
//
// Beyond two rings on the brain, pushed to one edge length and to two, q is 1.3 and 2.5 % of |d| in the median (at most
// 2.8 and 6.6); of it are left to order 2 0.21 and 0.84 (0.65, 3.8), to 3 0.039 and 0.28 (0.28, 2.7), to 4 0.008 and
// 0.15 (0.09, 1.5), to 5 0.003 and 0.08 (0.02, 0.7).
#pragma once

#include <Eigen/Core>
#include <functional>

#include "offline/precompute/nonlinear_zone.hpp"

namespace palpate {

// The zones with a ring more about sites where the highest order of those about them leaves too much: more than twice
// the scene's accuracy target of |d|, at the scene's largest displacement in a linear organ. On the brain, to two
// edges, such are tips and ridges, six of sixty sites; there errors are up to 6 % of |d| otherwise. As they are where
// a pack carries a lower order than the highest, which is where that leaves little. Cost and the rest as
// compute_zone_exterior() with one ring.
ZoneTables widen_zones(const Assembly& assembly, const Scene& scene, const ContactSites& sites,
                       const RestState& rest, int threads, const std::function<void(int)>& progress,
                       const ZoneTables& zone);

// Fills ZoneTables::force_scale and exterior, to its exterior_degree, on so many threads. Zeros where everything is
// linear; to a lower degree at sites whose patches give way far more easily along one axis than along another, and of
// which an element inverts within 0.001 edges of a push. Throws std::runtime_error when the stiffness at rest is not
// positive definite. `progress` gets the sites done, from any of the threads, one at a time. Cost of a site, n the
// degree and R = num_rays(n): 4 R (n - 1) evaluations of P, R (n - 1) back-solves for it and each ring, and 3 for each
// node of its patch. Memory of a thread: some n R (rings + 2) numbers a dof.
void compute_zone_exterior(const Assembly& assembly, const ContactSites& sites, const RestState& rest,
                           double max_displacement, int threads, const std::function<void(int)>& progress,
                           ZoneTables& zone);

}  // namespace palpate
