#include "offline/precompute/rest_series.hpp"

#include <Eigen/QR>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "offline/precompute/hermite_design.hpp"
#include "offline/precompute/sample_points.hpp"
#include "schemas/monomials.hpp"

namespace palpate {
namespace {

constexpr Eigen::Index kRays = 24;  // 21 for a form of degree 5

// Over half of the sphere: along -r an order is what it is along r, but for its sign.
Eigen::Matrix<double, 3, kRays> rays() {
  Eigen::Matrix<double, 3, kRays> directions;
  Eigen::Index count = 0;
  for (const Eigen::Vector3d& direction : sphere_points(static_cast<int>(2 * kRays))) {
    if (direction.z() > 0) directions.col(count++) = direction;
  }
  return directions;
}

// c_j of `order` j, along each ray. `path`: a_1 .. a_(j-1); `lower`: the lower orders of P, zero but where dofs are
// held. None where an element inverts on the way.
std::optional<Eigen::MatrixXd> internal_force_of_order(const Assembly& assembly,
                                                       const Eigen::VectorXd& at_rest,
                                                       const std::vector<Eigen::MatrixXd>& path,
                                                       const std::vector<Eigen::MatrixXd>& lower, int order) {
  constexpr double kStep = 0.04;  // t: of rounding and the orders beyond, either leaves five digits or more
  const double sign = order % 2 == 0 ? 1 : -1;
  Eigen::VectorXd resting;
  assembly.internal_force(at_rest, resting);
  Eigen::MatrixXd of_order(at_rest.size(), kRays);
  Eigen::VectorXd ahead;
  Eigen::VectorXd behind;
  for (Eigen::Index ray = 0; ray < kRays; ++ray) {
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
      const double t = kStep * static_cast<double>(i + 1);
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

}  // namespace

bool compute_rest_series(StaticSolver& solver, const LoadCase& load, const Eigen::VectorXd& at_rest,
                         const Eigen::MatrixXd& tangent, const std::vector<Eigen::Index>& packed_dofs,
                         const Eigen::Matrix3d& axes, RestSeries& series) {
  const Assembly& assembly = solver.assembly();
  const Eigen::Matrix<double, 3, kRays> directions = rays();
  series.axes = axes;
  series.field.resize(static_cast<Eigen::Index>(packed_dofs.size()), pack::num_monomials(2, kSeriesDegree));
  series.energy.resize(pack::num_monomials(3, kSeriesDegree + 1));
  std::vector<Eigen::MatrixXd> path = {tangent * (axes * directions)};
  std::vector<Eigen::MatrixXd> orders = {assembly.tangent_times(at_rest, path.front())};  // of P
  const Eigen::MatrixXd held = Eigen::MatrixXd::Zero(at_rest.size(), kRays);
  for (int order = 2; order <= kSeriesDegree; ++order) {
    const std::optional<Eigen::MatrixXd> found =
        internal_force_of_order(assembly, at_rest, path, orders, order);
    if (!found) return false;
    const Eigen::MatrixXd& force = *found;
    Eigen::MatrixXd& next = path.emplace_back();
    if (!solver.tangent_response(load, at_rest, held, next, -force)) return false;
    orders.push_back(force + assembly.tangent_times(at_rest, next));

    const auto degree = static_cast<std::uint32_t>(order);
    Eigen::MatrixXd values(kRays, pack::num_monomials(degree));
    Eigen::MatrixXd gradients(3 * kRays, pack::num_monomials(degree + 1));
    for (Eigen::Index ray = 0; ray < kRays; ++ray) {
      values.row(ray) = hermite_rows(directions.col(ray), order, order, 0);
      gradients.middleRows<3>(3 * ray) =
          hermite_rows(directions.col(ray), order + 1, order + 1, 1).bottomRows<3>();
    }
    const Eigen::MatrixXd shown = next(packed_dofs, Eigen::all);
    series.field.middleCols(pack::num_monomials(2, degree - 1), values.cols()) =
        values.colPivHouseholderQr().solve(shown.transpose()).transpose();
    const Eigen::MatrixXd forces = axes.transpose() * (tangent.transpose() * force);
    series.energy.segment(pack::num_monomials(3, degree), gradients.cols()) =
        gradients.colPivHouseholderQr().solve(forces.reshaped());
  }
  return true;
}

}  // namespace palpate
