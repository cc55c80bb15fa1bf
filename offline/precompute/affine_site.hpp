// affine_site: the answer of a contact where nothing was sampled.
//
// Source: Zhong et al. 2005 section 3.3 and eq. (25), by St. Venant's principle: near a contact the answer moves with
// it, so that a sampled site can answer for its neighbours. On a mesh without regular order it cannot
// (bench/sites/SITES.md): what is large in the answer, its first and second order, belongs to the place, and so does
// what is left: the tip takes hold of other nodes. What a place does have without a solve is its own derivatives at
// rest. So what a pack carries where nothing was sampled is the series of rest_series.hpp, a polynomial like that of
// a sampled site; nothing is mapped or looked up in a frame. The worst of it is known beforehand: a series fails
// where its last term is large.
//
// The maps are kept to be compared with. What moves is stated as a placement, which takes a place near the contact to
// the place near the site whose answer it takes, and vectors back. The paper's own map is linear through the origin:
// it depends on where that is, and is singular where two nodes and the site lie in a plane with it; it is there in
// both senses. Ours moves along with the surface, and never moves the linear part, which linear_dd gives exactly
// anywhere:
//   u(p; d) = u_linear(p; d) + sum over sites s of w_s Q_s n_s(q_s(p); Q_s^T d),
//   E(d)    = d . S d / 2    + sum over sites s of w_s e_s(Q_s^T d),       n, e: what is not linear / quadratic.
#pragma once

#include <Eigen/Core>
#include <array>
#include <limits>
#include <optional>
#include <vector>

#include "offline/precompute/polynomial_dd.hpp"

namespace palpate {

// Of a contact with this exact linear answer. `to_unit` turns the axes of the series into a multiple of the unit
// ball's.
SitePolynomial unsampled_polynomial(const SiteLinearResponse& linear, const TaylorCoefficients& series,
                                    const Eigen::Matrix3d& to_unit, bool half);

// Two places on the edge of the domain, in x, apart from one another, where the highest order of the field is largest.
std::array<Eigen::Vector3d, 2> least_certain_points(const SitePolynomial& polynomial, bool half);

enum class SiteMap {
  printed,  // eq. (25), places looked up by phi as the text has it
  inverse,  // by phi^-1, as its construction asks for
  affine,   // phi affine about the site, nearest to leaving the edge of the region where it is
  rigid     // along with the surface: the contact's normal to the site's, by the shortest turn
};

struct Placement {
  // The place p takes the answer of at_site + of_places (p - at_contact), within `reach` of `middle`; farther away its
  // own.
  Eigen::Matrix3d of_places = Eigen::Matrix3d::Identity();
  Eigen::Vector3d at_contact = Eigen::Vector3d::Zero();
  Eigen::Vector3d at_site = Eigen::Vector3d::Zero();
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  double reach = std::numeric_limits<double>::infinity();
  Eigen::Matrix3d of_vectors = Eigen::Matrix3d::Identity();  // Q: at the site -> at the contact
  double condition = 1;                                      // of the system that it was found from
};

// For a contact at the node of `contact`, from `site`. None where the map's system is singular to rounding.
std::optional<Placement> place_contact(const Model& model, const ContactSites& sites, SiteMap map,
                                       const ContactSite& site, const ContactSite& contact);

// Which packed nodes' answers each packed node takes: those of a triangle of the surface, with their weights.
struct LocalTable {
  std::vector<std::array<int, 3>> nodes;
  std::vector<std::array<double, 3>> weights;
};

// The triangles are those around the node nearest to a place. Cost: packed nodes squared.
LocalTable local_table(const Model& model, const ContactSites& sites, const Placement& placement);

// What is not linear of a site's polynomial, moved: a polynomial of the contact, without linear and quadratic part.
SitePolynomial moved_remainder(const SitePolynomial& polynomial, const Placement& placement,
                               const LocalTable& table);

// All of it.
SitePolynomial moved(const SitePolynomial& polynomial, const Placement& placement, const LocalTable& table);

// What sites at these places count at `contact`, all over the surface that they and it lie on: weights that sum to 1
// and reproduce what varies linearly along the surface, by moving least squares (Lancaster and Salkauskas 1981) over
// the sites within the distance of the farthest. They are smooth in `contact`.
std::vector<double> site_weights(const std::vector<Eigen::Vector3d>& places, const Eigen::Vector3d& contact,
                                 const Eigen::Vector3d& normal);

}  // namespace palpate
