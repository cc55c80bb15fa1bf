#include "offline/precompute/ball_polynomials.hpp"

#include <Eigen/Cholesky>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "schemas/monomials.hpp"

namespace palpate {
namespace {

// Returns the mean of x^a y^b z^c over the ball, n = a + b + c, as the product of two means:
//   sphere: 2 G(a) G(b) G(c) / (4 pi Gamma((n + 3) / 2)), G(a) = Gamma((a + 1) / 2); 0 for odd exponents
//   radius: r^n has the mean 3 / (n + 3)
// On the half-ball odd c also have a mean.
double moment(std::uint32_t a, std::uint32_t b, std::uint32_t c, bool half) {
  if (a % 2 != 0 || b % 2 != 0 || (c % 2 != 0 && !half)) return 0;
  const double n = a + b + c;
  const auto gamma = [](std::uint32_t power) { return std::tgamma(0.5 * (power + 1)); };
  const double on_sphere =
      gamma(a) * gamma(b) * gamma(c) / (2 * std::numbers::pi * std::tgamma(0.5 * (n + 3)));
  return on_sphere * 3 / (n + 3);
}

}  // namespace

Eigen::MatrixXd orthonormal_on_ball(int first, int last, bool half) {
  std::vector<std::array<std::uint32_t, 3>> powers;
  pack::for_each_monomial(static_cast<std::uint32_t>(last),
                          [&](std::uint32_t, std::uint32_t a, std::uint32_t b, std::uint32_t c) {
                            if (a + b + c >= static_cast<std::uint32_t>(first)) powers.push_back({a, b, c});
                          });
  const auto count = static_cast<Eigen::Index>(powers.size());
  Eigen::MatrixXd gram(count, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    for (Eigen::Index j = 0; j < count; ++j) {
      const auto& p = powers[static_cast<size_t>(i)];
      const auto& q = powers[static_cast<size_t>(j)];
      gram(i, j) = moment(p[0] + q[0], p[1] + q[1], p[2] + q[2], half);
    }
  }
  // With G = L L^T and q = L^-1 m, the mean of q q^T is L^-1 G L^-T = I.
  const Eigen::LLT<Eigen::MatrixXd> factor(gram);
  return factor.matrixU().solve(Eigen::MatrixXd::Identity(count, count));
}

}  // namespace palpate
