// The paper's polynomial of a site, for comparison: a plain quadratic through samples on a grid or on a ray.
//
// Source: Zhong et al. 2005, section 3.2 and eqs. (22)-(24): N^3 combinations of the components, or ten
// growing forces along a direction (table 2). Terms that a ray leaves undetermined have minimum norm.
#pragma once

#include <vector>

#include "offline/precompute/polynomial_dd.hpp"

namespace palpate {

// Returns the points of a 5^3 grid that lie in the unit ball or half-ball z >= 0, without the centre.
std::vector<Eigen::Vector3d> grid_points(bool half);

// Returns ten points from the centre (excluded) to `end`.
std::vector<Eigen::Vector3d> ray_points(const Eigen::Vector3d& end);

// Fits a field of degree 2, linear part included, and an energy of degree 3 to energies and forces.
SitePolynomial fit_paper_quadratic(const SiteSamples& samples);

}  // namespace palpate
