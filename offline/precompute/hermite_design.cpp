#include "offline/precompute/hermite_design.hpp"

#include <algorithm>
#include <cmath>

#include "schemas/monomials.hpp"

namespace palpate {
namespace {

// Returns d^order/dx^order of x^power.
double power_derivative(double x, uint32_t power, uint32_t order) {
  if (order > power) return 0;
  double factor = 1;
  for (uint32_t i = 0; i < order; ++i) factor *= power - i;
  return factor * std::pow(x, static_cast<int>(power - order));
}

}  // namespace

Eigen::VectorXd derivative_weights(int degree, int order, int wanted) {
  Eigen::VectorXd weights(pack::monomial_start(static_cast<uint32_t>(order) + 1));
  Eigen::Index row = 0;
  for (int k = 0; k <= order; ++k) {
    const Eigen::Index count = pack::num_monomials(static_cast<uint32_t>(k));
    weights.segment(row, count).setConstant(derivative_weight(degree, std::max(0, k - wanted)));
    row += count;
  }
  return weights;
}

Eigen::MatrixXd hermite_rows(const Eigen::Vector3d& x, int first, int last, int order) {
  const auto skipped = static_cast<Eigen::Index>(pack::monomial_start(static_cast<uint32_t>(first)));
  const auto end = static_cast<Eigen::Index>(pack::monomial_start(static_cast<uint32_t>(last) + 1));
  const auto num_rows = static_cast<Eigen::Index>(pack::monomial_start(static_cast<uint32_t>(order) + 1));
  Eigen::MatrixXd rows(num_rows, end - skipped);
  pack::for_each_monomial(
      static_cast<uint32_t>(last), [&](uint32_t index, uint32_t a, uint32_t b, uint32_t c) {
        const Eigen::Index column = static_cast<Eigen::Index>(index) - skipped;
        if (column < 0) return;
        pack::for_each_monomial(
            static_cast<uint32_t>(order), [&](uint32_t row, uint32_t i, uint32_t j, uint32_t k) {
              rows(row, column) =
                  power_derivative(x[0], a, i) * power_derivative(x[1], b, j) * power_derivative(x[2], c, k);
            });
      });
  return rows;
}

}  // namespace palpate
