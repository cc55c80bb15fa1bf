// Least squares of values and derivatives: a polynomial that was sampled comes back.
#include "offline/precompute/polynomial_dd.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>
#include <vector>

#include "offline/precompute/hermite_design.hpp"
#include "schemas/monomials.hpp"
#include "tests/support/tetrahedral_block.hpp"

namespace palpate {
namespace {

using test::TestRandom;

constexpr int kDegree = 3;
constexpr double kRadius = 2.5;
constexpr Eigen::Index kRows = 12;
// A pack stores field coefficients in single precision.
constexpr double kSingle = 2e-7;
// The energy's stay double: rounding times the condition of the design, about 100.
constexpr double kDouble = 1e-12;

// Coefficients of a polynomial in x = d / kRadius from degree `first` on, and its derivatives in x by its own
// powers.
struct Polynomial {
  int first;
  int last;
  Eigen::MatrixXd coefficients;  // rows x monomials

  // d^(i + j + k) / dx^i dy^j dz^k
  Eigen::VectorXd derivative(const Eigen::Vector3d& x, int i, int j, int k) const {
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(coefficients.rows());
    Eigen::Index column = 0;
    pack::for_each_monomial(static_cast<std::uint32_t>(last),
                            [&](std::uint32_t, std::uint32_t a, std::uint32_t b, std::uint32_t c) {
                              if (static_cast<int>(a + b + c) < first) return;
                              sum += coefficients.col(column++) * one(x[0], static_cast<int>(a), i) *
                                     one(x[1], static_cast<int>(b), j) * one(x[2], static_cast<int>(c), k);
                            });
    return sum;
  }

 private:
  static double one(double x, int power, int order) {
    if (order > power) return 0;
    double value = 1;
    for (int i = 0; i < order; ++i) value *= power - i;
    for (int i = order; i < power; ++i) value *= x;
    return value;
  }
};

struct Synthetic {
  Polynomial field{1, kDegree, TestRandom(81).matrix(kRows, pack::num_monomials(1, kDegree))};
  Polynomial energy{2, kDegree + 1, TestRandom(82).matrix(1, pack::num_monomials(2, kDegree + 1))};

  SiteLinearResponse linear() const {
    SiteLinearResponse response;
    response.field = field.coefficients.leftCols<3>() / kRadius;
    const auto e = energy.coefficients.row(0);
    response.stiffness << 2 * e[0], e[1], e[2], e[1], 2 * e[3], e[4], e[2], e[4], 2 * e[5];
    response.stiffness /= kRadius * kRadius;
    return response;
  }

  Sample at(const Eigen::Vector3d& x) const {
    Sample sample;
    sample.displacement = kRadius * x;
    sample.field = field.derivative(x, 0, 0, 0);
    sample.field_tangent.resize(kRows, 3);
    sample.energy = energy.derivative(x, 0, 0, 0)[0];
    for (int p = 0; p < 3; ++p) {
      sample.field_tangent.col(p) = field.derivative(x, p == 0, p == 1, p == 2) / kRadius;
      sample.force[p] = energy.derivative(x, p == 0, p == 1, p == 2)[0] / kRadius;
      for (int q = 0; q < 3; ++q) {
        sample.stiffness(p, q) =
            energy.derivative(x, (p == 0) + (q == 0), (p == 1) + (q == 1), (p == 2) + (q == 2))[0] /
            (kRadius * kRadius);
      }
    }
    return sample;
  }

  std::vector<Sample> samples(int count, bool half = false) const {
    std::vector<Sample> result;
    for (const Eigen::Vector3d& x : choose_sample_points(kDegree + 1, count, half)) result.push_back(at(x));
    return result;
  }
};

TEST(PolynomialFit, GivesBackThePolynomialThatWasSampled) {
  const Synthetic truth;
  for (const bool half : {false, true}) {
    const SitePolynomial fit = fit_polynomial(truth.samples(12, half), truth.linear(), kRadius, kDegree);
    EXPECT_EQ(fit.radius, kRadius);
    ASSERT_EQ(fit.field.rows(), kRows);
    ASSERT_EQ(fit.field.cols(), truth.field.coefficients.cols());
    ASSERT_EQ(fit.energy.size(), truth.energy.coefficients.cols());
    EXPECT_LE((fit.field.cast<double>() - truth.field.coefficients).cwiseAbs().maxCoeff(), kSingle);
    EXPECT_LE((fit.energy - truth.energy.coefficients.row(0).transpose()).cwiseAbs().maxCoeff(),
              (half ? 10 : 1) * kDouble);
  }
}

TEST(PolynomialFit, LinearPartIsPinned) {
  // Samples of something else entirely: the linear part still is what it was told.
  Synthetic truth;
  const SiteLinearResponse linear = truth.linear();
  std::vector<Sample> samples = truth.samples(12);
  for (Sample& sample : samples) {
    sample.field *= 3;
    sample.field_tangent *= 3;
    sample.energy *= 3;
    sample.force *= 3;
    sample.stiffness *= 3;
  }
  const SitePolynomial fit = fit_polynomial(samples, linear, kRadius, kDegree);
  EXPECT_EQ(fit.field.leftCols<3>(), kRadius * linear.field);
  EXPECT_LE((fit.energy.head<6>() - truth.energy.coefficients.row(0).head<6>().transpose()).norm(), kDouble);
}

TEST(PolynomialFit, WhatItLeavesOutIsLeastSquares) {
  // Samples of one degree more than is fitted: the normal equations hold, so that no other polynomial of the
  // degree is nearer in the weighted sum of squares.
  const Synthetic truth;
  const SiteLinearResponse linear = truth.linear();
  const Polynomial rest{4, 4, TestRandom(83).matrix(kRows, pack::num_monomials(4))};
  std::vector<Sample> samples = truth.samples(12);
  for (Sample& sample : samples) {
    const Eigen::Vector3d x = sample.displacement / kRadius;
    sample.field += rest.derivative(x, 0, 0, 0);
    for (int p = 0; p < 3; ++p)
      sample.field_tangent.col(p) += rest.derivative(x, p == 0, p == 1, p == 2) / kRadius;
  }
  const SitePolynomial fit = fit_polynomial(samples, linear, kRadius, kDegree);
  const Polynomial fitted{1, kDegree, fit.field.cast<double>()};
  const double weight = derivative_weight(kDegree);
  Eigen::MatrixXd gradient = Eigen::MatrixXd::Zero(pack::num_monomials(2, kDegree), kRows);
  double misfit = 0;
  for (const Sample& sample : samples) {
    const Eigen::Vector3d x = sample.displacement / kRadius;
    Eigen::MatrixXd residual(4, kRows);
    residual.row(0) = (sample.field - fitted.derivative(x, 0, 0, 0)).transpose();
    for (int p = 0; p < 3; ++p) {
      residual.row(1 + p) =
          weight *
          (kRadius * sample.field_tangent.col(p) - fitted.derivative(x, p == 0, p == 1, p == 2)).transpose();
    }
    Eigen::MatrixXd design = hermite_rows(x, 2, kDegree);
    design.bottomRows<3>() *= weight;
    gradient += design.transpose() * residual;
    misfit += residual.squaredNorm();
  }
  ASSERT_GT(misfit, 0.1) << "else this test shows nothing";
  EXPECT_LE(gradient.norm(), 100 * kSingle * std::sqrt(misfit));
}

TEST(PolynomialFit, TooFewSamplesAreRefused) {
  const Synthetic truth;
  EXPECT_THROW(fit_polynomial(truth.samples(1), truth.linear(), kRadius, kDegree), std::invalid_argument);
  // Many on one ray are no better: they know nothing off it.
  std::vector<Sample> ray;
  for (int i = 1; i <= 20; ++i) ray.push_back(truth.at(Eigen::Vector3d(0, 0, 0.05 * i)));
  EXPECT_THROW(fit_polynomial(ray, truth.linear(), kRadius, kDegree), std::invalid_argument);
}

TEST(PolynomialFitDesign, RowsAreValuesAndDerivatives) {
  // Central differences of degree 5 on the unit ball: 1e-10 of truncation and of rounding, times up to 60.
  constexpr double kStep = 1e-5;
  constexpr double kDifference = 1e-8;
  for (const Eigen::Vector3d& x :
       {Eigen::Vector3d(0.3, -0.7, 0.5), Eigen::Vector3d(0, 0.4, 0), Eigen::Vector3d(0, 0, 0)}) {
    for (const int first : {0, 2, 3}) {
      const int last = 5;
      const Eigen::MatrixXd rows = hermite_rows_second_order(x, first, last);
      ASSERT_EQ(rows.rows(), 10);
      ASSERT_EQ(rows.cols(),
                static_cast<Eigen::Index>(pack::num_monomials(static_cast<std::uint32_t>(first), 5)));
      EXPECT_EQ(rows.topRows<4>(), hermite_rows(x, first, last));

      Eigen::VectorXd values(pack::num_monomials(0, 5));
      pack::evaluate_monomials(x.data(), 5, values.data());
      EXPECT_LE((rows.row(0).transpose() - values.tail(rows.cols())).cwiseAbs().maxCoeff(), 1e-15);

      Eigen::Index second = 4;
      for (int p = 0; p < 3; ++p) {
        const Eigen::Vector3d step = kStep * Eigen::Vector3d::Unit(p);
        const Eigen::MatrixXd slope =
            (hermite_rows(x + step, first, last) - hermite_rows(x - step, first, last)) / (2 * kStep);
        EXPECT_LE((rows.row(1 + p) - slope.row(0)).cwiseAbs().maxCoeff(), kDifference);
        for (int q = p; q < 3; ++q, ++second)
          EXPECT_LE((rows.row(second) - slope.row(1 + q)).cwiseAbs().maxCoeff(), kDifference) << p << q;
      }
    }
  }
}

}  // namespace
}  // namespace palpate
