// polynomial_dd (PIAM): the nonlinear answer of one contact site as polynomials in the tool displacement.
//
// Source: Zhong et al. 2005 eqs. (22)-(24). Departures, all measured: the linear part is pinned to the exact
// linear DD; values and tangents are fitted together (Hermite); by an orthogonal factorisation of the design
// matrix, not by eq. (24), whose normal equations square its condition; and the force is the gradient of a
// fitted energy.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "offline/precompute/linear_dd.hpp"
#include "offline/precompute/sampling.hpp"

namespace palpate {

// In x = d / radius, coefficients in the order of a pack.
struct SitePolynomial {
  double radius = 0;
  Eigen::MatrixXd field;   // 3 packed nodes x monomials of degree 1 .. degree; length unit
  Eigen::VectorXd energy;  // monomials of degree 2 .. degree + 1; force unit x length unit
};

// Least squares over `samples`, all with tangents and |d| <= radius. Throws std::invalid_argument when they
// do not determine the polynomial. Cost: a QR of (4 samples) x terms, then 4 samples x terms multiply-adds a
// packed dof.
SitePolynomial fit_polynomial(const std::vector<Sample>& samples, const SiteLinearResponse& linear,
                              double radius, int degree);

}  // namespace palpate
