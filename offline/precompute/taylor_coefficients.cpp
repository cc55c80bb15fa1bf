#include "offline/precompute/taylor_coefficients.hpp"

#include <optional>

#include "offline/numerics/decompositions.hpp"
#include "offline/precompute/hermite_design.hpp"
#include "offline/precompute/taylor_orders.hpp"
#include "schemas/monomials.hpp"

namespace palpate {

bool compute_taylor_coefficients(StaticSolver& solver, const LoadCase& load, const Eigen::VectorXd& at_rest,
                                 const Eigen::MatrixXd& tangent, const std::vector<Eigen::Index>& packed_dofs,
                                 const Eigen::Matrix3d& axes, TaylorCoefficients& series) {
  const Assembly& assembly = solver.assembly();
  const int num_directions = num_rays(kSeriesDegree);
  const Eigen::Matrix3Xd directions = ray_directions(num_directions);
  series.axes = axes;
  series.field.resize(static_cast<Eigen::Index>(packed_dofs.size()), pack::num_monomials(2, kSeriesDegree));
  series.energy.resize(pack::num_monomials(3, kSeriesDegree + 1));
  std::vector<Eigen::MatrixXd> path = {tangent * (axes * directions)};
  std::vector<Eigen::MatrixXd> orders = {assembly.tangent_times(at_rest, path.front())};  // of P: K a_1, ...
  const Eigen::MatrixXd held = Eigen::MatrixXd::Zero(at_rest.size(), num_directions);
  for (int order = 2; order <= kSeriesDegree; ++order) {
    const std::optional<Eigen::MatrixXd> found =
        internal_force_of_order(assembly, at_rest, path, orders, order);
    if (!found) return false;
    const Eigen::MatrixXd& force = *found;
    Eigen::MatrixXd& next = path.emplace_back();
    if (!solver.tangent_response(load, at_rest, held, next, -force)) return false;
    orders.push_back(force + assembly.tangent_times(at_rest, next));

    const auto degree = static_cast<std::uint32_t>(order);
    Eigen::MatrixXd gradients(3 * num_directions, pack::num_monomials(degree + 1));
    for (Eigen::Index ray = 0; ray < num_directions; ++ray)
      gradients.middleRows<3>(3 * ray) =
          hermite_rows(directions.col(ray), order + 1, order + 1, 1).bottomRows<3>();
    series.field.middleCols(pack::num_monomials(2, degree - 1), pack::num_monomials(degree)) =
        forms_along_rays(directions, order, next(packed_dofs, Eigen::all).transpose()).transpose();
    const Eigen::MatrixXd forces = axes.transpose() * (tangent.transpose() * force);
    series.energy.segment(pack::num_monomials(3, degree), gradients.cols()) =
        least_squares(gradients, forces.reshaped());
  }
  return true;
}

}  // namespace palpate
