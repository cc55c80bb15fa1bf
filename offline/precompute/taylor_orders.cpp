#include "offline/precompute/taylor_orders.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "offline/numerics/decompositions.hpp"
#include "offline/precompute/hermite_design.hpp"
#include "offline/precompute/sample_points.hpp"

namespace palpate {

int num_rays(int degree) {
  constexpr int kToSpare = 3;
  return (degree + 1) * (degree + 2) / 2 + kToSpare;
}

Eigen::Matrix3Xd ray_directions(int count) {
  Eigen::Matrix3Xd directions(3, count);
  Eigen::Index filled = 0;
  for (const Eigen::Vector3d& direction : sphere_points(2 * count)) {
    if (direction.z() > 0) directions.col(filled++) = direction;
  }
  return directions;
}

std::optional<Eigen::MatrixXd> internal_force_of_order(const Assembly& assembly,
                                                       const Eigen::VectorXd& at_rest,
                                                       const std::vector<Eigen::MatrixXd>& path,
                                                       const std::vector<Eigen::MatrixXd>& lower, int order) {
  // Steps t for the orders 2, 3, 4, 5 and above: rounding grows with t^-order.
  constexpr double kSteps[] = {0.005, 0.01, 0.03, 0.04};
  const double step = kSteps[std::min(order, 5) - 2];
  const double sign = order % 2 == 0 ? 1 : -1;
  Eigen::VectorXd resting;
  assembly.internal_force(at_rest, resting);
  Eigen::MatrixXd of_order(at_rest.size(), path.front().cols());
  Eigen::VectorXd ahead;
  Eigen::VectorXd behind;
  for (Eigen::Index ray = 0; ray < of_order.cols(); ++ray) {
    const auto sum = [&](const std::vector<Eigen::MatrixXd>& terms, double t) {
      Eigen::VectorXd value = Eigen::VectorXd::Zero(at_rest.size());
      double power = t;
      for (const Eigen::MatrixXd& term : terms) {
        value += power * term.col(ray);
        power *= t;
      }
      return value;
    };
    std::array<Eigen::VectorXd, 2> estimates;
    for (size_t i = 0; i < 2; ++i) {
      const double t = step * static_cast<double>(i + 1);
      for (const auto& [sign_of_t, force] : {std::pair(1, &ahead), std::pair(-1, &behind)}) {
        const ElementState state = assembly.internal_force(at_rest + sum(path, sign_of_t * t), *force);
        if (!(state.min_jacobian > 0) || !force->allFinite()) return std::nullopt;
      }
      ahead -= resting + sum(lower, t);
      behind -= resting + sum(lower, -t);
      estimates[i] = (ahead + sign * behind) / (2 * std::pow(t, order));
    }
    of_order.col(ray) = (4 * estimates[0] - estimates[1]) / 3;
  }
  return of_order;
}

Eigen::MatrixXd forms_along_rays(const Eigen::Matrix3Xd& directions, int degree,
                                 const Eigen::MatrixXd& values) {
  Eigen::MatrixXd monomials(directions.cols(), (degree + 1) * (degree + 2) / 2);
  for (Eigen::Index ray = 0; ray < directions.cols(); ++ray)
    monomials.row(ray) = hermite_rows(directions.col(ray), degree, degree, 0);
  return least_squares(monomials, values);
}

}  // namespace palpate
