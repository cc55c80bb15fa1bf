// Polynomials orthonormal over the ball, checked by a quadrature that is exact for their products.
#include "offline/precompute/ball_polynomials.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "offline/numerics/decompositions.hpp"
#include "offline/precompute/hermite_design.hpp"
#include "offline/precompute/polynomial_dd.hpp"
#include "schemas/monomials.hpp"

namespace palpate {
namespace ball_polynomials_test {

struct Node {
  double at;
  double weight;
};

// Gauss-Legendre on (from, to): exact to degree 2 count - 1. Newton from the usual estimates of the roots.
std::vector<Node> gauss_points(int count, double from, double to) {
  std::vector<Node> nodes;
  for (int i = 0; i < count; ++i) {
    double x = std::cos(std::numbers::pi * (i + 0.75) / (count + 0.5));
    double slope = 1;
    for (int iteration = 0; iteration < 20; ++iteration) {
      double before = 1;
      double value = x;
      for (int k = 2; k <= count; ++k) {
        const double next = ((2 * k - 1) * x * value - (k - 1) * before) / k;
        before = value;
        value = next;
      }
      slope = count * (x * value - before) / (x * x - 1);
      x -= value / slope;
    }
    const double half = 0.5 * (to - from);
    nodes.push_back({from + half * (x + 1), half * 2 / ((1 - x * x) * slope * slope)});
  }
  return nodes;
}

Eigen::Index mean_terms(int first, int last) {
  return pack::num_monomials(static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(last));
}

// Mean of m m^T over the ball, or over its half z >= 0, for the monomials m of degrees first .. last. In
// spherical coordinates the integrand is a product of polynomials in r, cos(theta) and e^(i phi).
Eigen::MatrixXd mean_products(int first, int last, bool half) {
  const int points = last + 2;      // exact to degree 2 last + 3; the integrand has 2 last + 2 in r
  const int angles = 2 * last + 2;  // exact to order 2 last + 1; the integrand has 2 last
  const Eigen::Index terms = mean_terms(first, last);
  Eigen::MatrixXd mean = Eigen::MatrixXd::Zero(terms, terms);
  for (const Node& r : gauss_points(points, 0, 1)) {
    Eigen::MatrixXd weighed(terms, points * angles);
    Eigen::Index column = 0;
    for (const Node& z : gauss_points(points, half ? 0 : -1, 1)) {
      const double ring = std::sqrt(1 - z.at * z.at);
      const double weight = 3 * r.at * r.at * r.weight * z.weight / (half ? 1 : 2) / angles;
      for (int k = 0; k < angles; ++k) {
        const double phi = 2 * std::numbers::pi * (k + 0.3) / angles;
        const Eigen::Vector3d x = r.at * Eigen::Vector3d(ring * std::cos(phi), ring * std::sin(phi), z.at);
        weighed.col(column++) = std::sqrt(weight) * hermite_rows(x, first, last, 0).transpose();
      }
    }
    mean.noalias() += weighed * weighed.transpose();
  }
  return mean;
}

TEST(BallPolynomials, QuadratureKnowsTheBall) {
  // 1, <x^2> = 1/5, <x^2 y^2> = 1/35 (<x^4> = 3/35), <z> = 3/8 for the half.
  const Eigen::MatrixXd ball = mean_products(0, 2, false);
  EXPECT_NEAR(ball(0, 0), 1, 1e-14);
  EXPECT_NEAR(ball(1, 1), 1.0 / 5, 1e-14);
  EXPECT_NEAR(ball(4, 4), 3.0 / 35, 1e-14);
  EXPECT_NEAR(ball(5, 5), 1.0 / 35, 1e-14);
  EXPECT_NEAR(ball(0, 3), 0, 1e-14);
  EXPECT_NEAR(mean_products(0, 2, true)(0, 3), 3.0 / 8, 1e-14);
}

TEST(BallPolynomials, AreOrthonormal) {
  for (const bool half : {false, true}) {
    const int highest = highest_fit_degree(half) + 1;
    const Eigen::MatrixXd all_means = mean_products(0, highest, half);
    for (const int first : {0, 2, 3}) {
      for (int last = std::max(first, 1); last <= highest; ++last) {
        const Eigen::MatrixXd T = orthonormal_on_ball(first, last, half);
        const Eigen::Index below = all_means.rows() - mean_terms(first, highest);
        const Eigen::MatrixXd means = all_means.block(below, below, T.rows(), T.rows());
        const Eigen::VectorXd sizes = symmetric_modes(means).values;
        const double error =
            (T.transpose() * means * T - Eigen::MatrixXd::Identity(T.rows(), T.cols())).cwiseAbs().maxCoeff();
        // Rounding times the condition of the moments: 1e11 at degree 8 over the half ball.
        EXPECT_LE(error, 100 * std::numeric_limits<double>::epsilon() * sizes.maxCoeff() / sizes.minCoeff())
            << first << " .. " << last << (half ? " half" : "");
        EXPECT_LE(error, 1e-3);
      }
    }
  }
}

// Each polynomial combines a monomial with earlier monomials, so each degree spans the same space as its
// monomials.
TEST(BallPolynomials, AreOfTheirMonomialsAndThoseBefore) {
  for (const bool half : {false, true}) {
    const Eigen::MatrixXd T = orthonormal_on_ball(2, 5, half);
    EXPECT_EQ(Eigen::MatrixXd(T.triangularView<Eigen::StrictlyLower>()).norm(), 0);
    EXPECT_GT(T.diagonal().minCoeff(), 0);
  }
}

// Breaks the check on purpose: polynomials of the other domain, and a transposed T.
TEST(BallPolynomials, OthersAreSeen) {
  const auto off = [](const Eigen::MatrixXd& T, bool half) {
    return (T.transpose() * mean_products(2, 4, half) * T - Eigen::MatrixXd::Identity(T.rows(), T.cols()))
        .cwiseAbs()
        .maxCoeff();
  };
  EXPECT_GT(off(orthonormal_on_ball(2, 4, false), true), 0.1);
  EXPECT_GT(off(orthonormal_on_ball(2, 4, true), false), 0.1);
  EXPECT_GT(off(orthonormal_on_ball(2, 4, true).transpose(), true), 0.1);
}

}  // namespace ball_polynomials_test
}  // namespace palpate
