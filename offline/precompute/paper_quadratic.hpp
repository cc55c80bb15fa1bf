// The paper's polynomial of a site, for comparison: a plain quadratic through displacements, sampled on a
// grid or on one ray.
//
// Source: Zhong et al. 2005, section 3.2 and eqs. (22)-(24): N^3 combinations of the components, or ten growing forces
// along one direction (table 2). A ray does not determine the terms off itself; the minimum-norm solution is taken.
#pragma once

#include <vector>

#include "offline/precompute/polynomial_dd.hpp"

namespace palpate {

// Points of a 5^3 grid on the cube around the unit ball or half-ball z >= 0, inside the ball, without the centre.
std::vector<Eigen::Vector3d> grid_points(bool half);

// Ten points from the centre to `end`.
std::vector<Eigen::Vector3d> ray_points(const Eigen::Vector3d& end);

// Degree 2, no pinned linear part. The energy, of degree 3, is fitted to energies and forces; the paper takes
// forces from deformed elements.
SitePolynomial fit_paper_quadratic(const SiteSamples& samples);

}  // namespace palpate
