#include "runtime/src/polynomial_dd.hpp"

#include <math.h>

#include "runtime/src/pack_view.hpp"
#include "schemas/monomials.hpp"

namespace palpate {
namespace {

using pack::monomial_start;
using pack::num_monomials;

constexpr uint32_t kMostMonomials = num_monomials(0, pack::kMaxDegree);
// Of lengths that units were multiplied into and out of: what is larger by less is not beyond.
constexpr double kRounding = 1e-9;

// Value, gradient and Hessian (xx xy xz yy yz zz) of a part of the energy.
struct Part {
  double value;
  double gradient[3];
  double hessian[6];
};

// Of the terms of one degree n >= 2, by Euler's theorem on homogeneous functions:
// grad E = Hess E x / (n - 1), E = grad E . x / n. What is left is the Hessian, whose entries have the monomials
// x^a y^b z^c of degree n - 2. Behind the j-th of them, with b + c = rest, stand x^(a+2) y^b z^c at place j of
// degree n, x^(a+1) y^(b+1) z^c rest + 1 further on, x^a y^(b+2) z^c another rest + 2, and each with one y
// less and one z more next to it (monomials.hpp). Cost: some 30
// operations for each of n (n - 1) / 2 monomials.
Part differentiate(const double x[3], const double* monomials, const double* coefficients, uint32_t degree) {
  Part part = {};
  double* H = part.hessian;
  const double* lower = monomials + monomial_start(degree - 2);
  const double* xx = coefficients;
  double a = degree - 2;
  for (uint32_t rest = 0; rest + 2 <= degree; ++rest, a -= 1) {
    const double* xy = xx + rest + 1;
    const double* yy = xy + rest + 2;
    double b = rest;
    double c = 0;
    for (uint32_t i = 0; i <= rest; ++i, b -= 1, c += 1) {
      const double m = *lower++;
      H[0] += (a + 2) * (a + 1) * xx[i] * m;
      H[1] += (a + 1) * (b + 1) * xy[i] * m;
      H[2] += (a + 1) * (c + 1) * xy[i + 1] * m;
      H[3] += (b + 2) * (b + 1) * yy[i] * m;
      H[4] += (b + 1) * (c + 1) * yy[i + 1] * m;
      H[5] += (c + 2) * (c + 1) * yy[i + 2] * m;
    }
    xx = xy;
  }
  const double to_gradient = 1.0 / (degree - 1);
  part.gradient[0] = (H[0] * x[0] + H[1] * x[1] + H[2] * x[2]) * to_gradient;
  part.gradient[1] = (H[1] * x[0] + H[3] * x[1] + H[4] * x[2]) * to_gradient;
  part.gradient[2] = (H[2] * x[0] + H[4] * x[1] + H[5] * x[2]) * to_gradient;
  part.value = (part.gradient[0] * x[0] + part.gradient[1] * x[1] + part.gradient[2] * x[2]) / degree;
  return part;
}

// g(s) = q_n(s) / s^n and its first two derivatives, s > 1.
struct Continuation {
  double g, first, second;
};

Continuation continue_energy(uint32_t degree, double s) {
  const double n = degree;
  const double t = s - 1.0;
  const double q = 1.0 + n * t + 0.5 * n * (n - 1.0) * t * t;
  const double q1 = n + n * (n - 1.0) * t;
  const double q2 = n * (n - 1.0);
  double power = 1.0;  // s^-n
  for (uint32_t i = 0; i < degree; ++i) power /= s;
  return {q * power, (q1 - n * q / s) * power, (q2 - 2.0 * n * q1 / s + n * (n + 1.0) * q / (s * s)) * power};
}

// phi(c) and its first two derivatives.
struct Fade {
  double phi, first, second;
};

Fade fade_behind_surface(double c) {
  constexpr double kWidth = 0.5;
  if (c >= 0.0) return {1.0, 0.0, 0.0};
  if (c <= -kWidth) return {0.0, 0.0, 0.0};
  const double t = -c / kWidth;
  const double rest = 1.0 - t;
  return {1.0 - t * t * t * (10.0 - 15.0 * t + 6.0 * t * t), 30.0 * t * t * rest * rest / kWidth,
          -60.0 * t * rest * (rest - t) / (kWidth * kWidth)};
}

// Adds g(s) E_n with t = x / s:  grad = g grad E + E g' t,
// Hess = g Hess E + g' (t grad E^T + grad E t^T) + E (g'' t t^T + g'/s (1 - t t^T)).
void add_continued(const Part& part, uint32_t degree, double s, const double t[3], Part& sum) {
  if (s <= 1.0) {
    sum.value += part.value;
    for (int i = 0; i < 3; ++i) sum.gradient[i] += part.gradient[i];
    for (int ij = 0; ij < 6; ++ij) sum.hessian[ij] += part.hessian[ij];
    return;
  }
  const Continuation continuation = continue_energy(degree, s);
  sum.value += continuation.g * part.value;
  for (int i = 0, ij = 0; i < 3; ++i) {
    sum.gradient[i] += continuation.g * part.gradient[i] + part.value * continuation.first * t[i];
    for (int j = i; j < 3; ++j, ++ij) {
      sum.hessian[ij] += continuation.g * part.hessian[ij] +
                         continuation.first * (t[i] * part.gradient[j] + part.gradient[i] * t[j]) +
                         part.value * (continuation.second * t[i] * t[j] +
                                       continuation.first / s * ((i == j ? 1.0 : 0.0) - t[i] * t[j]));
    }
  }
}

}  // namespace

bool is_behind_surface(const pal_pack& pack, uint32_t site, const double d[3]) {
  if (pack.inward_normals == nullptr) return false;
  const double* n = pack.inward_normals + size_t{3} * site;
  return d[0] * n[0] + d[1] * n[1] + d[2] * n[2] < -kRounding * (fabs(d[0]) + fabs(d[1]) + fabs(d[2]));
}

void evaluate_polynomial(const pal_pack& pack, uint32_t site, const double displacement[3],
                         double length_scale, PolynomialAnswer& answer, pal_real* weights) {
  const double radius = pack.radii[site];
  double x[3] = {displacement[0] / radius, displacement[1] / radius, displacement[2] / radius};
  double s = sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);
  answer.flags = 0;
  if (s > 1.0 + kRounding || is_behind_surface(pack, site, x)) answer.flags |= PAL_FLAG_EXTRAPOLATED;
  if (s > kLargestExtrapolation) {
    answer.flags |= PAL_FLAG_CLAMPED;
    for (double& component : x) component *= kLargestExtrapolation / s;
    s = kLargestExtrapolation;
  }

  double monomials[kMostMonomials];
  pack::evaluate_monomials(x, pack.degree, monomials);

  const double t[3] = {s > 1.0 ? x[0] / s : 0.0, s > 1.0 ? x[1] / s : 0.0, s > 1.0 ? x[2] / s : 0.0};
  const double* coefficients = pack.energy + size_t{site} * num_monomials(2, pack.degree + 1);
  Part quadratic = {};
  Part rest = {};
  for (uint32_t degree = 2; degree <= pack.degree + 1; ++degree) {
    const Part part = differentiate(x, monomials, coefficients, degree);
    coefficients += num_monomials(degree);
    add_continued(part, degree, s, t, degree == 2 ? quadratic : rest);
  }

  constexpr double kNoNormal[3] = {};
  const double* n = pack.inward_normals != nullptr ? pack.inward_normals + size_t{3} * site : kNoNormal;
  const Fade fade = fade_behind_surface(x[0] * n[0] + x[1] * n[1] + x[2] * n[2]);
  answer.energy = quadratic.value + fade.phi * rest.value;
  for (int i = 0, ij = 0; i < 3; ++i) {
    answer.force[i] =
        (quadratic.gradient[i] + fade.phi * rest.gradient[i] + fade.first * rest.value * n[i]) / radius;
    for (int j = i; j < 3; ++j, ++ij) {
      const double faded = fade.phi * rest.hessian[ij] +
                           fade.first * (n[i] * rest.gradient[j] + rest.gradient[i] * n[j]) +
                           fade.second * rest.value * n[i] * n[j];
      answer.stiffness[3 * i + j] = answer.stiffness[3 * j + i] =
          (quadratic.hessian[ij] + faded) / (radius * radius);
    }
  }

  uint32_t term = 0;
  double power = 1.0;  // s^-n beyond the ball
  for (uint32_t degree = 1; degree <= pack.degree; ++degree) {
    if (s > 1.0) power /= s;
    const double fading = degree > 1 ? fade.phi : 1.0;
    const double scale = length_scale * fading * (s > 1.0 ? (1.0 + degree * (s - 1.0)) * power : 1.0);
    for (uint32_t i = 0; i < num_monomials(degree); ++i) {
      weights[term++] = static_cast<pal_real>(scale * monomials[monomial_start(degree) + i]);
    }
  }
}

uint32_t num_field_weights(const pal_pack& pack) {
  return pack.radii == nullptr ? 0 : num_monomials(1, pack.degree);
}

void fill_polynomial_field(const pal_pack& pack, const FieldState& field, uint32_t first, uint32_t count,
                           AddColumns add_columns, bool onto, pal_real* sum) {
  const uint32_t terms = num_monomials(1, pack.degree);
  const size_t panels = pack::num_panels(pack.num_nodes);
  for (uint32_t panel = 0; panel < count; ++panel) {
    const pal_real* coefficients =
        pack.field + (size_t{field.site} * panels + first + panel) * terms * pack::kPanelRows;
    add_columns(coefficients, pack::kPanelRows, field.weights, terms, onto,
                sum + size_t{panel} * pack::kPanelRows);
  }
}

}  // namespace palpate
