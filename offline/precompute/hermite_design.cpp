#include "offline/precompute/hermite_design.hpp"

#include <array>
#include <cmath>

#include "schemas/monomials.hpp"

namespace palpate {
namespace {

// d^k/dx^k of x^power.
double power_derivative(double x, uint32_t power, int order) {
  double factor = 1;
  for (int i = 0; i < order; ++i) factor *= static_cast<double>(power) - i;
  return factor == 0 ? 0 : factor * std::pow(x, static_cast<int>(power) - order);
}

Eigen::MatrixXd derivative_rows(const Eigen::Vector3d& x, int first, int last,
                                const std::array<std::array<int, 3>, 10>& orders, Eigen::Index count) {
  const auto skipped = static_cast<Eigen::Index>(pack::monomial_start(static_cast<uint32_t>(first)));
  const auto end = static_cast<Eigen::Index>(pack::monomial_start(static_cast<uint32_t>(last) + 1));
  Eigen::MatrixXd rows(count, end - skipped);
  pack::for_each_monomial(
      static_cast<uint32_t>(last), [&](uint32_t index, uint32_t a, uint32_t b, uint32_t c) {
        const Eigen::Index column = static_cast<Eigen::Index>(index) - skipped;
        if (column < 0) return;
        for (Eigen::Index row = 0; row < count; ++row) {
          const std::array<int, 3>& order = orders[static_cast<size_t>(row)];
          rows(row, column) = power_derivative(x[0], a, order[0]) * power_derivative(x[1], b, order[1]) *
                              power_derivative(x[2], c, order[2]);
        }
      });
  return rows;
}

constexpr std::array<std::array<int, 3>, 10> kOrders = {{{0, 0, 0},
                                                         {1, 0, 0},
                                                         {0, 1, 0},
                                                         {0, 0, 1},
                                                         {2, 0, 0},
                                                         {1, 1, 0},
                                                         {1, 0, 1},
                                                         {0, 2, 0},
                                                         {0, 1, 1},
                                                         {0, 0, 2}}};

}  // namespace

Eigen::MatrixXd hermite_rows(const Eigen::Vector3d& x, int first, int last) {
  return derivative_rows(x, first, last, kOrders, 4);
}

Eigen::MatrixXd hermite_rows_second_order(const Eigen::Vector3d& x, int first, int last) {
  return derivative_rows(x, first, last, kOrders, 10);
}

}  // namespace palpate
