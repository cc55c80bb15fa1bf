// affine_site: the response of a contact site without nonlinear solves.
//
// Source: Zhong et al. 2005 section 3.3 and eq. (25), which transfers the response of a sampled site to its
// neighbours. On an unstructured mesh this transfer fails (bench/sites/SITES.md): the first and second order
// belong to the place, and another patch holds other nodes. A pack therefore stores the exact Taylor series
// at rest (taylor_coefficients.hpp) as the polynomial of such a site. A large last term predicts its failure.
//
// The maps serve comparison. A placement maps places near the contact to places near the site, and vectors
// back. The paper's map is linear, depends on the origin, and is singular where two boundary nodes, the site
// and the origin are coplanar. Our map is a rigid motion along the surface:
//   u(p; d) = u_linear(p; d) + sum over sites s of w_s Q_s n_s(q_s(p); Q_s^T d),
//   E(d)    = d . S d / 2    + sum over sites s of w_s e_s(Q_s^T d)
// n, e: the terms beyond linear and quadratic; w_s: site_weights(); q_s, Q_s: maps of places and vectors.
#pragma once

#include <Eigen/Core>
#include <array>
#include <limits>
#include <optional>
#include <vector>

#include "offline/precompute/polynomial_dd.hpp"

namespace palpate {

// Returns the polynomial of a site from its exact linear response and its Taylor series at rest. Requires
// to_unit * series.axes = s I. `half`: the domain is the half-ball z >= 0.
SitePolynomial unsampled_polynomial(const SiteLinearResponse& linear, const TaylorCoefficients& series,
                                    const Eigen::Matrix3d& to_unit, bool half);

// Returns two unit vectors x, at least 60 degrees apart, where the highest order of the field is largest.
std::array<Eigen::Vector3d, 2> least_certain_points(const SitePolynomial& polynomial, bool half);

enum class SiteMap {
  printed,  // eq. (25) as printed: phi maps places
  inverse,  // eq. (25) as constructed: phi^-1 maps places
  affine,   // phi affine about the site, nearest to the identity on the region's edge
  rigid     // moves with the surface: the smallest rotation from the contact's normal to the site's normal
};

struct Placement {
  // A place p within `reach` of `middle` takes the response at at_site + of_places (p - at_contact).
  Eigen::Matrix3d of_places = Eigen::Matrix3d::Identity();
  Eigen::Vector3d at_contact = Eigen::Vector3d::Zero();
  Eigen::Vector3d at_site = Eigen::Vector3d::Zero();
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  double reach = std::numeric_limits<double>::infinity();
  Eigen::Matrix3d of_vectors = Eigen::Matrix3d::Identity();  // Q: from the site to the contact
  double condition = 1;                                      // condition of the map's linear system
};

// Returns the map between `contact` and `site`. Empty where the linear system of the map is singular.
std::optional<Placement> place_contact(const Model& model, const ContactSites& sites, SiteMap map,
                                       const ContactSite& site, const ContactSite& contact);

// Interpolation of each packed node's response: corners of a surface triangle and barycentric weights.
struct LocalTable {
  std::vector<std::array<int, 3>> nodes;  // packed nodes
  std::vector<std::array<double, 3>> weights;
};

// Searches two rings of triangles around the node nearest to each mapped place. Cost: packed nodes squared.
LocalTable local_table(const Model& model, const ContactSites& sites, const Placement& placement);

// Transfers the nonlinear terms of a site's polynomial to the contact.
SitePolynomial moved_remainder(const SitePolynomial& polynomial, const Placement& placement,
                               const LocalTable& table);

// Transfers the whole polynomial to the contact.
SitePolynomial moved(const SitePolynomial& polynomial, const Placement& placement, const LocalTable& table);

// Returns moving least-squares weights of the sites at `contact` (Lancaster and Salkauskas 1981). The weights
// sum to 1 and nearly reproduce functions linear in the tangent plane. The farthest site has weight 0.
std::vector<double> site_weights(const std::vector<Eigen::Vector3d>& places, const Eigen::Vector3d& contact,
                                 const Eigen::Vector3d& normal);

}  // namespace palpate
