// Synthetic samples of known polynomials, for the tests of fits.
#pragma once

#include "offline/precompute/polynomial_dd.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <vector>

#include "offline/precompute/ball_polynomials.hpp"
#include "offline/precompute/degree_choice.hpp"
#include "offline/precompute/hermite_design.hpp"
#include "schemas/monomials.hpp"
#include "schemas/pack_layout.hpp"
#include "tests/support/tetrahedral_block.hpp"

namespace palpate::polynomial_fit_fixture {

using test::TestRandom;
inline constexpr Eigen::Index kRows = 12;

// Rounding times two condition numbers: the design's, and the change from orthonormal to monomial basis.
inline constexpr double kDouble = 1e-11;

inline Eigen::Index num_terms(int first, int last) {
  return pack::num_monomials(static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(last));
}

// Maps an ellipsoid with axes of 1.3 to 3.3, askew to all coordinate axes, to the unit ball.
inline Eigen::Matrix3d any_map() {
  Eigen::Matrix3d A;
  A << 0.45, 0.10, -0.05, -0.12, 0.60, 0.08, 0.02, 0.15, 0.38;
  return A;
}

// A polynomial in x = A d from degree `first` on, with its derivatives.
struct Polynomial {
  int first;
  int last;
  Eigen::MatrixXd coefficients;  // rows x monomials
  Eigen::Matrix3d A = any_map();

  Eigen::VectorXd value(const Eigen::Vector3d& x) const { return by_x(x, {0, 0, 0}); }

  // First, second and third derivatives with respect to d, by the chain rule, written out.
  Eigen::VectorXd slope(const Eigen::Vector3d& x, int i) const {
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(coefficients.rows());
    for (int p = 0; p < 3; ++p) sum += A(p, i) * by_x(x, times({p}));
    return sum;
  }
  Eigen::VectorXd curvature(const Eigen::Vector3d& x, int i, int j) const {
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(coefficients.rows());
    for (int p = 0; p < 3; ++p) {
      for (int q = 0; q < 3; ++q) sum += A(p, i) * A(q, j) * by_x(x, times({p, q}));
    }
    return sum;
  }
  Eigen::VectorXd third(const Eigen::Vector3d& x, int i, int j, int k) const {
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(coefficients.rows());
    for (int p = 0; p < 3; ++p) {
      for (int q = 0; q < 3; ++q) {
        for (int r = 0; r < 3; ++r) sum += A(p, i) * A(q, j) * A(r, k) * by_x(x, times({p, q, r}));
      }
    }
    return sum;
  }

 private:
  // How often each axis occurs.
  static std::array<int, 3> times(std::initializer_list<int> axes) {
    std::array<int, 3> orders = {};
    for (const int axis : axes) ++orders[static_cast<size_t>(axis)];
    return orders;
  }
  Eigen::VectorXd by_x(const Eigen::Vector3d& x, const std::array<int, 3>& orders) const {
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(coefficients.rows());
    Eigen::Index column = 0;
    pack::for_each_monomial(static_cast<std::uint32_t>(last), [&](std::uint32_t, std::uint32_t a,
                                                                  std::uint32_t b, std::uint32_t c) {
      if (static_cast<int>(a + b + c) < first) return;
      sum += coefficients.col(column++) * one(x[0], static_cast<int>(a), orders[0]) *
             one(x[1], static_cast<int>(b), orders[1]) * one(x[2], static_cast<int>(c), orders[2]);
    });
    return sum;
  }
  static double one(double x, int power, int order) {
    if (order > power) return 0;
    double value = 1;
    for (int i = 0; i < order; ++i) value *= power - i;
    for (int i = order; i < power; ++i) value *= x;
    return value;
  }
};

inline constexpr std::array<std::array<int, 2>, 6> kSecond = {
    {{0, 0}, {0, 1}, {0, 2}, {1, 1}, {1, 2}, {2, 2}}};

inline constexpr std::array<std::array<int, 3>, 10> kThird = {{{0, 0, 0},
                                                               {0, 0, 1},
                                                               {0, 0, 2},
                                                               {0, 1, 1},
                                                               {0, 1, 2},
                                                               {0, 2, 2},
                                                               {1, 1, 1},
                                                               {1, 1, 2},
                                                               {1, 2, 2},
                                                               {2, 2, 2}}};

// Samples of a polynomial field and a polynomial energy. The two may be unrelated.
struct Synthetic {
  // `degree` is the degree to be fitted.
  explicit Synthetic(int degree)
      : field{1, degree, TestRandom(81).matrix(kRows, num_terms(1, degree))},
        energy{2, degree + 1, TestRandom(82).matrix(1, num_terms(2, degree + 1))} {}

  Polynomial field;
  Polynomial energy;

  SiteLinearResponse linear() const {
    const Eigen::Matrix3d A = any_map();
    SiteLinearResponse response;
    response.field = field.coefficients.leftCols<3>() * A;
    const auto e = energy.coefficients.row(0);
    response.stiffness << 2 * e[0], e[1], e[2], e[1], 2 * e[3], e[4], e[2], e[4], 2 * e[5];
    response.stiffness = A.transpose() * response.stiffness * A;
    return response;
  }

  Sample at(const Eigen::Vector3d& x) const {
    Sample sample;
    sample.displacement = any_map().inverse() * x;
    sample.field = field.value(x);
    sample.field_tangent.resize(kRows, 3);
    sample.field_curvature.resize(kRows, 6);
    sample.energy = energy.value(x)[0];
    for (int i = 0; i < 3; ++i) {
      sample.field_tangent.col(i) = field.slope(x, i);
      sample.force[i] = energy.slope(x, i)[0];
      for (int j = 0; j < 3; ++j) sample.stiffness(i, j) = energy.curvature(x, i, j)[0];
    }
    for (size_t ij = 0; ij < 6; ++ij)
      sample.field_curvature.col(static_cast<Eigen::Index>(ij)) =
          field.curvature(x, kSecond[ij][0], kSecond[ij][1]);
    for (size_t ijk = 0; ijk < 10; ++ijk) {
      sample.hardening[static_cast<Eigen::Index>(ijk)] =
          energy.third(x, kThird[ijk][0], kThird[ijk][1], kThird[ijk][2])[0];
    }
    return sample;
  }

  SiteSamples samples(size_t count, bool half = false) const {
    SamplePoints points(half);
    SiteSamples result;
    for (size_t i = 0; i < count; ++i) result.samples.push_back(at(points[i]));
    result.linear = linear();
    result.to_unit = any_map();
    result.half = half;
    return result;
  }
};

// Samples of polynomials that are `more` degrees higher than the fit.
inline SiteSamples rough_samples(size_t count, int degree, bool half = false) {
  Synthetic truth(degree + 2);
  return truth.samples(count, half);
}

// Coefficients of the nonlinear field: 3 packed nodes x monomials of degree 2 .. degree.
inline Eigen::MatrixXd nonlinear_field(const SitePolynomial& polynomial) {
  return polynomial.basis * polynomial.coefficients.transpose();
}

// The field at d, evaluated from the expanded coefficients.
inline Eigen::VectorXd value_of(const SitePolynomial& polynomial, const Eigen::Vector3d& d) {
  const Eigen::Vector3d x = polynomial.to_unit * d;
  Eigen::VectorXd field = polynomial.linear * x;
  if (polynomial.basis.cols() > 0)
    field += nonlinear_field(polynomial) * hermite_rows(x, 2, polynomial.degree, 0).transpose();
  return field;
}

// Adds three samples outside the domain.
inline void add_beyond(int degree, SiteSamples& samples) {
  for (const Eigen::Vector3d& x :
       {Eigen::Vector3d(1.3, 0, 0), Eigen::Vector3d(0, -0.9, 0.9), Eigen::Vector3d(1, 1, 1)})
    samples.samples.push_back(Synthetic(degree + 2).at(x));
}

}  // namespace palpate::polynomial_fit_fixture
