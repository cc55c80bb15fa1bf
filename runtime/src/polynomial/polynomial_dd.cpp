#include "runtime/src/polynomial/polynomial_dd.hpp"

#include <math.h>
#include <string.h>

#include "runtime/src/pack/pack_view.hpp"
#include "schemas/monomials.hpp"

namespace palpate {
namespace {

using pack::monomial_start;
using pack::num_monomials;

constexpr uint32_t kMostMonomials = num_monomials(0, pack::kMaxDegree - 1);
// A conversion of units and back changes a length by at most this part.
constexpr double kRounding = 1e-9;

// Holds value, gradient and Hessian (xx xy xz yy yz zz) of a part of the energy.
struct Part {
  double value;
  double gradient[3];
  double hessian[6];
};

constexpr pack::Inverses<pack::kMaxDegree + 1> kInverses;

using Pair = double __attribute__((vector_size(16)));

Pair load_pair(const double* from) {
  Pair values;
  memcpy(&values, from, sizeof values);
  return values;
}

// Sums the terms of one degree n >= 2. Euler's theorem on homogeneous functions gives
//
//   grad E = Hess E x / (n - 1),   E = grad E . x / n.
//
// Hess E is a sum over the divided monomials x^a/a! y^b/b! z^c/c! of degree n - 2, without further factors.
// Let monomial j have rest = b + c. In degree n (monomials.hpp) the coefficients that multiply monomial j
// are:
// - xx at place j,
// - xy and xz at place j + rest + 1 and the next place,
// - yy, yz and zz at place j + 2 rest + 3 and the next two places.
Part differentiate(const double x[3], const double* monomials, const double* coefficients, uint32_t degree) {
  const double* m = monomials + monomial_start(degree - 2);
  const double* xx = coefficients;
  double sum_xx = 0;
  Pair sum_xy_xz = {};
  Pair sum_yy_yz = {};
  double sum_zz = 0;
  for (uint32_t rest = 0; rest + 2 <= degree; ++rest) {
    const double* xy = xx + rest + 1;
    const double* yy = xy + rest + 2;
    for (uint32_t i = 0; i <= rest; ++i) {
      sum_xx += xx[i] * m[i];
      sum_xy_xz += load_pair(xy + i) * m[i];
      sum_yy_yz += load_pair(yy + i) * m[i];
      sum_zz += yy[i + 2] * m[i];
    }
    m += rest + 1;
    xx = xy;
  }
  Part part = {0, {}, {sum_xx, sum_xy_xz[0], sum_xy_xz[1], sum_yy_yz[0], sum_yy_yz[1], sum_zz}};
  const double* H = part.hessian;
  const double to_gradient = kInverses.of[degree - 1];
  part.gradient[0] = (H[0] * x[0] + H[1] * x[1] + H[2] * x[2]) * to_gradient;
  part.gradient[1] = (H[1] * x[0] + H[3] * x[1] + H[4] * x[2]) * to_gradient;
  part.gradient[2] = (H[2] * x[0] + H[4] * x[1] + H[5] * x[2]) * to_gradient;
  part.value =
      (part.gradient[0] * x[0] + part.gradient[1] * x[1] + part.gradient[2] * x[2]) * kInverses.of[degree];
  return part;
}

// Holds the factor k(s) = q_n(s) / s^n on E_n and its first two derivatives, s > 1 (polynomial_dd.hpp).
struct Continuation {
  double factor, first, second;
};

Continuation continue_energy(uint32_t degree, double s) {
  const double n = degree;
  const double h = s - 1.0;
  const double q = 1.0 + n * h + 0.5 * n * (n - 1.0) * h * h;
  const double q1 = n + n * (n - 1.0) * h;
  const double q2 = n * (n - 1.0);
  double power = 1.0;  // s^-n
  for (uint32_t i = 0; i < degree; ++i) power /= s;
  return {q * power, (q1 - n * q / s) * power, (q2 - 2.0 * n * q1 / s + n * (n + 1.0) * q / (s * s)) * power};
}

// Holds phi(c) and its first two derivatives by c = d . N |A N| (polynomial_dd.hpp).
struct Fade {
  double phi, first, second;
};

Fade fade_outward(double c) {
  constexpr double kWidth = 0.5;
  if (c >= 0.0) return {1.0, 0.0, 0.0};
  if (c <= -kWidth) return {0.0, 0.0, 0.0};
  const double outward = -c / kWidth;
  const double left = 1.0 - outward;
  return {1.0 - outward * outward * outward * (10.0 - 15.0 * outward + 6.0 * outward * outward),
          30.0 * outward * outward * left * left / kWidth,
          -60.0 * outward * left * (left - outward) / (kWidth * kWidth)};
}

// Adds k(s) E_n, with t = x / s the gradient of s:
//
//   grad = k grad E + E k' t
//   Hess = k Hess E + k' (t grad E^T + grad E t^T) + E (k'' t t^T + k'/s (I - t t^T)).
void add_continued(const Part& part, uint32_t degree, double s, const double t[3], Part& sum) {
  if (s <= 1.0) {
    sum.value += part.value;
    for (int i = 0; i < 3; ++i) sum.gradient[i] += part.gradient[i];
    for (int ij = 0; ij < 6; ++ij) sum.hessian[ij] += part.hessian[ij];
    return;
  }
  const Continuation continuation = continue_energy(degree, s);
  sum.value += continuation.factor * part.value;
  for (int i = 0, ij = 0; i < 3; ++i) {
    sum.gradient[i] += continuation.factor * part.gradient[i] + part.value * continuation.first * t[i];
    for (int j = i; j < 3; ++j, ++ij) {
      sum.hessian[ij] += continuation.factor * part.hessian[ij] +
                         continuation.first * (t[i] * part.gradient[j] + part.gradient[i] * t[j]) +
                         part.value * (continuation.second * t[i] * t[j] +
                                       continuation.first / s * ((i == j ? 1.0 : 0.0) - t[i] * t[j]));
    }
  }
}

double dot(const double a[3], const double b[3]) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// x = A d
void to_unit_ball(const double A[9], const double d[3], double x[3]) {
  for (int i = 0; i < 3; ++i) x[i] = dot(A + 3 * i, d);
}

// Converts derivatives by x = A d to derivatives by d: A^T grad, A^T Hess A.
void pull_back(const double A[9], Part& part) {
  const double* H = part.hessian;
  const double full[3][3] = {{H[0], H[1], H[2]}, {H[1], H[3], H[4]}, {H[2], H[4], H[5]}};
  double hessian_A[3][3];
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j)
      hessian_A[i][j] = full[i][0] * A[j] + full[i][1] * A[3 + j] + full[i][2] * A[6 + j];
  }
  const double g[3] = {part.gradient[0], part.gradient[1], part.gradient[2]};
  for (int i = 0, ij = 0; i < 3; ++i) {
    part.gradient[i] = A[i] * g[0] + A[3 + i] * g[1] + A[6 + i] * g[2];
    for (int j = i; j < 3; ++j, ++ij)
      part.hessian[ij] = A[i] * hessian_A[0][j] + A[3 + i] * hessian_A[1][j] + A[6 + i] * hessian_A[2][j];
  }
}

// Extends the answer at d' = r d, where |A d'| = R = kLargestExtrapolation, along the ray to d:
//
//   W(d) = E(d') + F(d') . (d - d'),   grad W = F(d') + R (1 - r) (K u - (u . K u) v)
//
// with u = d' / R, and v = A^T x / R the gradient of |A d|, where x = A d'. d' changes with d: the changes of
// E(d') and of d - d' leave F(d'), and the change of F(d') gives the second term. The stiffness stays that of
// d'. In: energy E(d'), force F(d'), stiffness K(d'). Out: W, grad W, K(d').
void extend_along_ray(const double* A, const double d[3], const double x[3], double r,
                      PolynomialAnswer& answer) {
  answer.energy += (1.0 - r) * dot(answer.force, d);
  double u[3];
  double v[3];
  for (int i = 0; i < 3; ++i) {
    u[i] = r * d[i] / kLargestExtrapolation;
    v[i] = (A[i] * x[0] + A[3 + i] * x[1] + A[6 + i] * x[2]) / kLargestExtrapolation;
  }
  double stiffness_u[3];
  for (int i = 0; i < 3; ++i) stiffness_u[i] = dot(answer.stiffness + 3 * i, u);
  const double along = dot(u, stiffness_u);
  for (int i = 0; i < 3; ++i)
    answer.force[i] += kLargestExtrapolation * (1.0 - r) * (stiffness_u[i] - along * v[i]);
}

// Holds the parts of the energy that fade for c < 0, and the others.
struct Energy {
  Part lasting;
  Part fading;
};

// Sums the energy at x inside the ball of radius kLargestExtrapolation, s = |x|, with derivatives by d.
Energy sum_energy(const pal_pack& pack, uint32_t site, const double x[3], double s, bool is_faded) {
  const pack::PolynomialSite& polynomial = pack.polynomial_sites[site];
  double monomials[kMostMonomials];
  pack::evaluate_divided_monomials(x, polynomial.degree - 1, kInverses, monomials);  // for second derivatives
  const double t[3] = {s > 1.0 ? x[0] / s : 0.0, s > 1.0 ? x[1] / s : 0.0, s > 1.0 ? x[2] / s : 0.0};
  const double* coefficients = pack.energy + polynomial.energy_start;
  Energy energy = {};
  for (uint32_t degree = 2; degree <= polynomial.degree + 1; ++degree) {
    const Part part = differentiate(x, monomials, coefficients, degree);
    coefficients += num_monomials(degree);
    add_continued(part, degree, s, t, is_faded && degree > 2 ? energy.fading : energy.lasting);
  }
  pull_back(polynomial.to_unit, energy.lasting);
  if (is_faded) pull_back(polynomial.to_unit, energy.fading);
  return energy;
}

// Computes `lasting` + phi(c) `fading`, where c has the gradient `c_gradient` by d.
void add_faded(const Energy& energy, const Fade& fade, const double c_gradient[3], PolynomialAnswer& answer) {
  const auto& [lasting, fading] = energy;
  answer.energy = lasting.value + fade.phi * fading.value;
  for (int i = 0, ij = 0; i < 3; ++i) {
    answer.force[i] =
        lasting.gradient[i] + fade.phi * fading.gradient[i] + fade.first * fading.value * c_gradient[i];
    for (int j = i; j < 3; ++j, ++ij) {
      const double faded =
          fade.phi * fading.hessian[ij] +
          fade.first * (c_gradient[i] * fading.gradient[j] + fading.gradient[i] * c_gradient[j]) +
          fade.second * fading.value * c_gradient[i] * c_gradient[j];
      answer.stiffness[3 * i + j] = answer.stiffness[3 * j + i] = lasting.hessian[ij] + faded;
    }
  }
}

}  // namespace

bool is_in_domain(const pal_pack& pack, uint32_t site, const double d[3]) {
  const double limit = 1.0 + kRounding;
  if (pack.polynomial_sites != nullptr) {
    double x[3];
    to_unit_ball(pack.polynomial_sites[site].to_unit, d, x);
    if (!(dot(x, x) <= limit * limit)) return false;
  } else if (!(sqrt(dot(d, d)) <= pack.max_displacement * limit)) {
    return false;
  }
  if (pack.inward_normals == nullptr) return true;
  return dot(d, pack.inward_normals + size_t{3} * site) >=
         -kRounding * (fabs(d[0]) + fabs(d[1]) + fabs(d[2]));
}

void evaluate_polynomial(const pal_pack& pack, uint32_t site, const double d[3], PolynomialAnswer& answer,
                         PolynomialFieldState& field) {
  const double* A = pack.polynomial_sites[site].to_unit;
  double x[3];
  to_unit_ball(A, d, x);
  double s = sqrt(dot(x, x));
  answer.flags = is_in_domain(pack, site, d) ? 0 : PAL_FLAG_EXTRAPOLATED;
  double r = 1.0;  // the answer is that of r d, extended along the ray
  if (s > kLargestExtrapolation) {
    answer.flags |= PAL_FLAG_CLAMPED;
    r = kLargestExtrapolation / s;
    for (double& component : x) component *= r;
    s = kLargestExtrapolation;
  }

  const bool is_faded = pack.inward_normals != nullptr;
  const Energy energy = sum_energy(pack, site, x, s, is_faded);
  double c_gradient[3] = {};
  Fade fade = {1.0, 0.0, 0.0};
  if (is_faded) {
    const double* normal = pack.inward_normals + size_t{3} * site;
    double scaled[3];
    to_unit_ball(A, normal, scaled);
    const double scale = sqrt(dot(scaled, scaled));
    for (int i = 0; i < 3; ++i) c_gradient[i] = scale * normal[i];
    fade = fade_outward(r * dot(d, c_gradient));
  }
  add_faded(energy, fade, c_gradient, answer);
  if (r < 1.0) extend_along_ray(A, d, x, r, answer);

  for (int i = 0; i < 3; ++i) field.x[i] = static_cast<pal_real>(x[i]);
  field.site = site;
  field.fade = static_cast<pal_real>(fade.phi);
}

}  // namespace palpate
