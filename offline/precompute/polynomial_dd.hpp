// polynomial_dd (PIAM): the nonlinear response of one contact site as polynomials in the tool displacement.
//
// Source: Zhong et al. 2005 eqs. (22)-(24). Departures, justified in bench/polynomials/POLYNOMIALS.md:
//   1. the linear part is the exact linear DD,
//   2. values, first and second derivatives are fitted together (Hermite),
//   3. polynomials are orthonormal over the sampled domain, and weights make errors relative to |d|,
//   4. an orthogonal factorisation replaces eq. (24), whose normal equations square the condition,
//   5. the force is the gradient of a fitted energy.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "offline/precompute/error_survey.hpp"
#include "offline/precompute/linear_dd.hpp"
#include "offline/precompute/sampling.hpp"

namespace palpate {

// Samples for the polynomials of a site. `to_unit` is A: x = A d maps the sampled domain, an ellipsoid, to
// the unit ball. Samples may lie beyond the domain.
struct SiteSamples {
  std::vector<Sample> samples;
  SiteLinearResponse linear;
  Eigen::Matrix3d to_unit = Eigen::Matrix3d::Identity();
  bool half = false;  // all samples point inward of the surface
};

// A polynomial in x; coefficients in the order of a pack.
struct SitePolynomial {
  Eigen::Matrix3d to_unit = Eigen::Matrix3d::Zero();
  int degree = 0;
  Eigen::MatrixXd linear;  // L: 3 packed nodes x 3; length unit
  Eigen::MatrixXd basis;   // B: 3 packed nodes x rank
  Eigen::MatrixXd
      coefficients;        // C: monomials of degree 2 .. degree x rank; u = L x + B C^T m(x), length unit
  Eigen::VectorXd energy;  // monomials of degree 2 .. degree + 1; force unit x length unit
  double basis_error = 0;  // error of reduce_basis: max |u - u before reduction| / |d|
};

// Whether |A d| <= 1, to rounding.
bool is_in_domain(const SiteSamples& samples, const Sample& sample);

// Returns the floor of |f_FE|: kForceFloor of the largest force of the domain's samples.
double force_floor(const SiteSamples& samples);

// Returns the shortest semi-axis of the sampled domain |A d| <= 1: length unit.
double least_reach(const Eigen::Matrix3d& to_unit);

// Returns the highest degree of a fit on the ball or half-ball. Monomials on the half-ball are
// ill-conditioned: higher degrees exceed single precision.
int highest_fit_degree(bool half);

// Leave-one-out root mean squares over the domain's samples without rest; infinite without samples.
struct HeldOutError {
  double all;
  // The same over samples with |A d| <= 0.9 where four or more exist, else `all`. A fit without a sample at
  // the boundary extrapolates there; `inside` follows the error of random pushes.
  double inside;
};

// Returns errors of the field: max over packed nodes of |u - u_FE| / |d|. A single fit gives all residuals:
//   (1 - Q_b Q_b^T)^-1 r_b,   Q: orthonormal factor of the design, b: a sample's rows
// (Allen 1974, The relationship between variable selection and data augmentation and a method for
// prediction). Infinite where the other samples do not determine the polynomial. Cost: a QR of (10 samples) x
// terms, then 20 samples x terms multiply-adds for each packed dof.
HeldOutError held_out_error(const SiteSamples& samples, int degree);

// Returns errors of the force: |f - f_FE| / |f_FE|, |f_FE| floored at force_floor().
HeldOutError held_out_force_error(const SiteSamples& samples, int degree);

// Fits by least squares with errors relative to |d|. A sample at x beyond the domain has the weight |x|^-n, n
// the degree of field or energy. The basis has a column for each orthonormal polynomial. Throws
// std::invalid_argument when the samples do not determine the polynomial. Cost: as held_out_error.
SitePolynomial fit_polynomial(const SiteSamples& samples, int degree);

// Returns u at a displacement in the sampled domain: 3 packed nodes, length unit.
Eigen::VectorXd field_at(const SitePolynomial& polynomial, const Eigen::Vector3d& displacement);

// Returns the force of the tool on the tissue, force unit: the gradient of the energy.
Eigen::Vector3d force_at(const SitePolynomial& polynomial, const Eigen::Vector3d& displacement);

// Returns the errors at a sample; the denominator |f_FE| is at least `force_floor`. Cost: a field.
SampleErrors errors_of(const SitePolynomial& polynomial, const Sample& sample, double force_floor);

// Returns the largest |entry| in single precision, rounded up: the unit of a rounded L is this value / 32767.
float linear_unit(const Eigen::MatrixXd& linear);

// Reduces the field to the fewest principal directions, at most pack::kMostRank, whose truncation error is at
// most `tolerance` of |d| at any packed node. `basis_error` records the error, measured inside and on the
// boundary. Entries of the basis are within 1; with `rounded` these, and `linear` / linear_unit(), are
// multiples of 1/32767. Cost: an eigenvalue problem of the terms, and terms x 256 multiply-adds a packed dof.
SitePolynomial reduce_basis(const SitePolynomial& polynomial, bool half, double tolerance, bool rounded);

}  // namespace palpate
