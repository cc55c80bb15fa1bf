// The paper's own way to a site's polynomial, kept to be compared with: a plain quadratic through displacements alone,
// sampled on a grid or on one ray.
//
// Source: Zhong et al. 2005, section 3.2 and eqs. (22)-(24): N^3 combinations of the three components, or ten forces
// that grow along one direction (table 2). On a ray least squares do not determine the terms off it; of all quadratics
// that fit as well, the smallest is taken.
#pragma once

#include <vector>

#include "offline/precompute/polynomial_dd.hpp"

namespace palpate {

// Points of the unit ball, or of its half z >= 0: those of a grid of 5^3 on the cube around it, without its middle.
std::vector<Eigen::Vector3d> grid_points(bool half);

// Ten points from the middle to `end`.
std::vector<Eigen::Vector3d> ray_points(const Eigen::Vector3d& end);

// Degree 2, nothing pinned. The energy, of degree 3, is fitted to energies and forces: the paper has no force of its
// own but that of the deformed elements.
SitePolynomial fit_paper_quadratic(const SiteSamples& samples);

}  // namespace palpate
