// affine_site: the response of a contact without samples.
//
// Source: Zhong et al. 2005 section 3.3 and eq. (25). By St. Venant's principle the response moves with the contact, so
// a sampled site can serve its neighbours. On an unstructured mesh this fails (bench/sites/SITES.md): the first and
// second order belong to the place, and the tip holds other nodes. A place without solves still has exact derivatives
// at rest. The pack therefore carries the series of taylor_coefficients.hpp as a polynomial; frames map and look up
// nothing. A large last term of the series predicts its failure.
//
// The maps serve comparison. A placement maps a place near the contact to a place near the site, and vectors back. The
// paper's map is linear through the origin. It depends on the origin, and is singular where two nodes, the site and the
// origin are coplanar; both of its directions are implemented. Our map moves with the surface and leaves the linear
// part to linear_dd:
//   u(p; d) = u_linear(p; d) + sum over sites s of w_s Q_s n_s(q_s(p); Q_s^T d),
//   E(d)    = d . S d / 2    + sum over sites s of w_s e_s(Q_s^T d),       n, e: the terms beyond linear / quadratic.
#pragma once

#include <Eigen/Core>
#include <array>
#include <limits>
#include <optional>
#include <vector>

#include "offline/precompute/polynomial_dd.hpp"

namespace palpate {

// Returns the polynomial of a contact with this exact linear response. `to_unit` maps the axes of the series
// to a multiple of the unit ball's axes.
SitePolynomial unsampled_polynomial(const SiteLinearResponse& linear, const TaylorCoefficients& series,
                                    const Eigen::Matrix3d& to_unit, bool half);

// Returns two distant places on the edge of the domain, in x, where the highest order of the field is largest.
std::array<Eigen::Vector3d, 2> least_certain_points(const SitePolynomial& polynomial, bool half);

enum class SiteMap {
  printed,  // eq. (25) as printed: phi maps places
  inverse,  // eq. (25) as constructed: phi^-1 maps places
  affine,   // phi affine about the site, nearest to the identity on the region's edge
  rigid     // moves with the surface: the smallest rotation from the contact's normal to the site's normal
};

struct Placement {
  // A place p within `reach` of `middle` takes the response at at_site + of_places (p - at_contact); other
  // places keep their own.
  Eigen::Matrix3d of_places = Eigen::Matrix3d::Identity();
  Eigen::Vector3d at_contact = Eigen::Vector3d::Zero();
  Eigen::Vector3d at_site = Eigen::Vector3d::Zero();
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  double reach = std::numeric_limits<double>::infinity();
  Eigen::Matrix3d of_vectors = Eigen::Matrix3d::Identity();  // Q: from the site to the contact
  double condition = 1;                                      // condition of the map's linear system
};

// Places a contact at the node of `contact` from `site`. Empty where the map's system is numerically singular.
std::optional<Placement> place_contact(const Model& model, const ContactSites& sites, SiteMap map,
                                       const ContactSite& site, const ContactSite& contact);

// For each packed node: a surface triangle of packed nodes and barycentric weights, whose responses it takes.
struct LocalTable {
  std::vector<std::array<int, 3>> nodes;
  std::vector<std::array<double, 3>> weights;
};

// Searches the triangles around the node nearest to each place. Cost: packed nodes squared.
LocalTable local_table(const Model& model, const ContactSites& sites, const Placement& placement);

// Transfers the nonlinear terms of a site's polynomial to the contact.
SitePolynomial moved_remainder(const SitePolynomial& polynomial, const Placement& placement,
                               const LocalTable& table);

// Transfers the whole polynomial.
SitePolynomial moved(const SitePolynomial& polynomial, const Placement& placement, const LocalTable& table);

// Weights of the sites at `contact`: they sum to 1 and reproduce linear functions on the surface. Moving least squares
// (Lancaster and Salkauskas 1981) over the sites within the distance of the farthest. Smooth in `contact`.
std::vector<double> site_weights(const std::vector<Eigen::Vector3d>& places, const Eigen::Vector3d& contact,
                                 const Eigen::Vector3d& normal);

}  // namespace palpate
