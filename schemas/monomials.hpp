// The order of monomials of three variables in a pack, and their values. This order is part of the format.
//
// Monomials x^a y^b z^c ascend by degree n = a + b + c. Within a degree, a descends, then b descends:
//   1 | x y z | xx xy xz yy yz zz | xxx xxy xxz xyy xyz xzz yyy yyz yzz zzz | ...
// Degree n has (n + 1)(n + 2)/2 monomials. They follow from degree n - 1: x times all monomials, y times the
// last n monomials, then z times the last monomial.
//
// The file is header-only, so that builder and runtime evaluate the same polynomial.
#pragma once

#include <stdint.h>

namespace palpate::pack {

constexpr uint32_t num_monomials(uint32_t degree) {
  return (degree + 1) * (degree + 2) / 2;
}

// The number of monomials of degrees first .. last.
constexpr uint32_t num_monomials(uint32_t first, uint32_t last) {
  uint32_t count = 0;
  for (uint32_t degree = first; degree <= last; ++degree) count += num_monomials(degree);
  return count;
}

// The position of a degree's first monomial, counted from degree 0.
constexpr uint32_t monomial_start(uint32_t degree) {
  return degree * (degree + 1) * (degree + 2) / 6;
}

// Writes the monomials of degrees 0 .. degree at x: num_monomials(0, degree) values.
template <typename Real>
void evaluate_monomials(const Real x[3], uint32_t degree, Real* values) {
  values[0] = Real(1);
  for (uint32_t n = 1; n <= degree; ++n) {
    const Real* before = values + monomial_start(n - 1);
    Real* now = values + monomial_start(n);
    const uint32_t count = num_monomials(n - 1);
    uint32_t written = 0;
    for (uint32_t i = 0; i < count; ++i) now[written++] = x[0] * before[i];
    for (uint32_t i = count - n; i < count; ++i) now[written++] = x[1] * before[i];
    now[written] = x[2] * before[count - 1];
  }
}

// of[n] = 1 / n for n = 1 .. kMost.
template <uint32_t kMost>
struct Inverses {
  double of[kMost + 1] = {};

  constexpr Inverses() {
    for (uint32_t n = 1; n <= kMost; ++n) of[n] = 1.0 / n;
  }
};

// Writes x^a/a! y^b/b! z^c/c! of degrees 0 .. degree <= kMost, in the same order. The x-derivative of x^a/a!
// is x^(a-1)/(a-1)!, so a derivative of a polynomial in these monomials has the same coefficients at other
// places.
template <uint32_t kMost>
void evaluate_divided_monomials(const double x[3], uint32_t degree, const Inverses<kMost>& inverses,
                                double* values) {
  values[0] = 1;
  for (uint32_t n = 1; n <= degree; ++n) {
    const double* before = values + monomial_start(n - 1);
    double* now = values + monomial_start(n);
    for (uint32_t a = n; a > 0; --a) {
      const double factor = x[0] * inverses.of[a];
      for (uint32_t i = 0; i <= n - a; ++i) *now++ = factor * *before++;
    }
    before -= n;
    for (uint32_t b = n; b > 0; --b) *now++ = x[1] * inverses.of[b] * *before++;
    *now = x[2] * inverses.of[n] * before[-1];
  }
}

// Calls visit(index, a, b, c) for every monomial of degrees 0 .. degree in order.
template <typename Visitor>
void for_each_monomial(uint32_t degree, Visitor&& visit) {
  uint32_t index = 0;
  for (uint32_t n = 0; n <= degree; ++n) {
    for (uint32_t a = n + 1; a-- > 0;) {
      for (uint32_t b = n - a + 1; b-- > 0;) visit(index++, a, b, n - a - b);
    }
  }
}

// The position of x^a y^b z^c, counted from degree 0.
constexpr uint32_t monomial_index(uint32_t a, uint32_t b, uint32_t c) {
  const uint32_t rest = b + c;  // monomials of the same degree with a higher power of x: rest (rest + 1)/2
  return monomial_start(a + b + c) + rest * (rest + 1) / 2 + c;
}

}  // namespace palpate::pack
