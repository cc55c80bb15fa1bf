// polynomial_dd (PIAM): the nonlinear answer of one contact site as polynomials in the tool displacement.
//
// Source: Zhong et al. 2005 eqs. (22)-(24). Departures, all measured: the linear part is pinned to the exact linear
// DD; values, first and second derivatives are fitted together (Hermite); in polynomials that are orthonormal over
// the sampled domain, each sample weighed as its error counts, and by an orthogonal factorisation, not by eq. (24),
// whose normal equations square the condition; and the force is the gradient of a fitted energy.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "offline/precompute/error_survey.hpp"
#include "offline/precompute/linear_dd.hpp"
#include "offline/precompute/sampling.hpp"

namespace palpate {

// What polynomials of a site are fitted to. `to_unit` is A: x = A d maps the sampled domain, an ellipsoid, to the
// unit ball; a sample may lie beyond it.
struct SiteSamples {
  std::vector<Sample> samples;
  SiteLinearResponse linear;
  Eigen::Matrix3d to_unit = Eigen::Matrix3d::Identity();
  bool half = false;  // only displacements inward of the surface were sampled
};

// In x, coefficients in the order of a pack.
struct SitePolynomial {
  Eigen::Matrix3d to_unit = Eigen::Matrix3d::Zero();
  int degree = 0;
  Eigen::MatrixXd linear;  // L: 3 packed nodes x 3; length unit
  Eigen::MatrixXd basis;   // B: 3 packed nodes x rank
  Eigen::MatrixXd
      coefficients;        // C: monomials of degree 2 .. degree x rank; u = L x + B C^T m(x), length unit
  Eigen::VectorXd energy;  // monomials of degree 2 .. degree + 1; force unit x length unit
  double basis_error = 0;  // of reduce_basis: max |u - what it was| / |d|
};

// Whether |A d| <= 1, to rounding.
bool is_in_domain(const SiteSamples& samples, const Sample& sample);

// What a force counts as where it is smaller: kForceFloor of the largest of the samples in the domain.
double force_floor(const SiteSamples& samples);

// The shortest semi-axis of a sampled domain.
double least_reach(const Eigen::Matrix3d& to_unit);

// The highest degree of a fit, over the ball or its half. Monomials tell the polynomials of the half apart so badly
// that beyond degree 7 their coefficients cancel to more digits than single precision has to spare.
int highest_fit_degree(bool half);

// How wrong a fit is at pushes that it was not given: the root mean square over the samples in the domain but that of
// rest, each left out in turn; infinite where there is none.
struct HeldOutError {
  double all;
  // Over samples well inside of the domain, where there are a few; else `all`. At the edge, a fit without the sample
  // there has to reach out for it, and errs the more the higher its degree, where the fit with it does not. On a site
  // of the brain of ten nodes (60 samples, degrees 5 to 9) this goes with the errors of random pushes, 0.74, 0.47,
  // 0.34, 0.26, 0.20 % of 0.53, 0.33, 0.24, 0.17, 0.13, while `all` is 1.8 to 1.2 % and rises from degree 8 on.
  double inside;
};

// Of the field: max over packed nodes of |u - u_FE| / |d|. Of a least-squares fit with the orthonormal factor Q of
// its design that takes no other fit: with the rows b of a sample, the residual without them is (1 - Q_b Q_b^T)^-1
// r_b (Allen 1974, The relationship between variable selection and data augmentation and a method for prediction).
// Infinite where they do not determine the polynomial. Cost: a QR of (10 samples) x terms, then 20 samples x terms
// multiply-adds a packed dof.
HeldOutError held_out_error(const SiteSamples& samples, int degree);

// The same of the force: |f - f_FE| / |f_FE|, |f_FE| no smaller than force_floor().
HeldOutError held_out_force_error(const SiteSamples& samples, int degree);

// Least squares over the samples, errors as parts of |d|; one at x beyond the domain weighs |x|^-n, n the degree of
// what is fitted, field or energy. The basis is that of orthonormal polynomials, one column each. Throws
// std::invalid_argument when they do not determine the polynomial. Cost: as held_out_error.
SitePolynomial fit_polynomial(const SiteSamples& samples, int degree);

// u of a displacement within the sampled domain: 3 packed nodes, length unit.
Eigen::VectorXd field_at(const SitePolynomial& polynomial, const Eigen::Vector3d& displacement);

// The force that the tool applies there, force unit: the gradient of the energy.
Eigen::Vector3d force_at(const SitePolynomial& polynomial, const Eigen::Vector3d& displacement);

// How wrong it is at a sample of some displacement; forces below `force_floor` count as that. Cost: a field.
SampleErrors errors_of(const SitePolynomial& polynomial, const Sample& sample, double force_floor);

// The largest entry, in single precision and no smaller: what entries of a rounded L are multiples of, times 1/32767.
float linear_unit(const Eigen::MatrixXd& linear);

// The polynomial in so few directions of its field that they leave out at most `tolerance` of |d| at any packed node,
// measured at points all over the domain and its boundary; at most pack::kMostRank, and `basis_error` says what they
// leave out. Entries of the basis then are within 1, and multiples of 1/32767 where it is `rounded`, as are those of
// `linear` over linear_unit(). Cost: an eigenvalue problem of the terms, and terms x 256 multiply-adds a packed dof.
SitePolynomial reduce_basis(const SitePolynomial& polynomial, bool half, double tolerance, bool rounded);

}  // namespace palpate
