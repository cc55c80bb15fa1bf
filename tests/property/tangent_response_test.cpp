// The linear response of an equilibrium to small loads and displacements.
#include <gtest/gtest.h>

#include "tests/support/static_solver_fixture.hpp"

namespace palpate::static_solver_fixture {
namespace tangent_response_test {

TEST(StaticSolverProperty, TangentResponseIsTheDerivativeOfTheSolution) {
  const Model model = organ();
  const Assembly assembly(model, model.fixed_dofs());
  StaticSolver solver(assembly);
  SolverSettings settings;
  settings.residual_tolerance = 1e-13;
  const auto solve = [&](const Eigen::Vector3d& motion) {
    Eigen::VectorXd u = Eigen::VectorXd::Zero(model.num_dofs());
    EXPECT_TRUE(solver.ramp(LoadCase::rest(model), moved_top(model, motion), u, settings).converged);
    return u;
  };
  const Eigen::VectorXd u = solve(kPush);
  Eigen::MatrixXd directions = Eigen::MatrixXd::Zero(model.num_dofs(), 3);
  for (const int node : top_of(model)) directions.middleRows<3>(3 * node).setIdentity();
  const LoadCase load = moved_top(model, kPush);

  // The factor of a neighbouring state gives the same as the state's own factor.
  Eigen::MatrixXd refined;
  ASSERT_TRUE(solver.tangent_response(load, u, directions, refined));
  solver.forget_factor();
  Eigen::MatrixXd response;
  ASSERT_TRUE(solver.tangent_response(load, u, directions, response));
  EXPECT_LE((refined - response).norm(), kSameAnswer * response.norm());
  for (const int node : top_of(model))
    EXPECT_EQ(response.middleRows<3>(3 * node), directions.middleRows<3>(3 * node));

  // Central differences: halving the step quarters the error.
  std::array<double, 2> errors{};
  for (size_t i = 0; i < 2; ++i) {
    const double step = i == 0 ? 2e-2 : 1e-2;
    Eigen::MatrixXd difference(model.num_dofs(), 3);
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d change = step * Eigen::Vector3d::Unit(axis);
      difference.col(axis) = (solve(kPush + change) - solve(kPush - change)) / (2 * step);
    }
    errors[i] = (difference - response).norm() / response.norm();
  }
  EXPECT_LE(errors[1], 1e-3) << "steps of a hundredth of the block";
  EXPECT_NEAR(errors[0] / errors[1], 4.0, 0.4);
}

// The response to external forces; the response to both is the sum.
TEST(StaticSolverProperty, TangentResponseToForcesIsTheDerivativeOfTheSolution) {
  const Model model = organ();
  const Assembly assembly(model, model.fixed_dofs());
  StaticSolver solver(assembly);
  SolverSettings settings;
  settings.residual_tolerance = 1e-13;
  const LoadCase load = moved_top(model, kPush);
  Eigen::MatrixXd forces = 1e-2 * test::TestRandom(61).matrix(model.num_dofs(), 2);
  const auto solve = [&](const Eigen::VectorXd& force) {
    LoadCase loaded = load;
    loaded.force += force;
    Eigen::VectorXd u = Eigen::VectorXd::Zero(model.num_dofs());
    EXPECT_TRUE(solver.ramp(LoadCase::rest(model), loaded, u, settings).converged);
    return u;
  };
  const Eigen::VectorXd u = solve(Eigen::VectorXd::Zero(model.num_dofs()));
  const Eigen::MatrixXd none = Eigen::MatrixXd::Zero(model.num_dofs(), 2);
  Eigen::MatrixXd response;
  ASSERT_TRUE(solver.tangent_response(load, u, none, response, forces));
  ASSERT_GT(response.norm(), 0);
  for (int dof = 0; dof < model.num_dofs(); ++dof) {
    if (load.held[static_cast<size_t>(dof)]) {
      EXPECT_EQ(response.row(dof).norm(), 0) << "forces on held dofs move nothing";
    }
  }
  // Central differences: halving the step quarters the error.
  std::array<double, 2> errors{};
  for (size_t i = 0; i < 2; ++i) {
    const double step = i == 0 ? 1 : 0.5;
    Eigen::MatrixXd difference(model.num_dofs(), 2);
    for (Eigen::Index column = 0; column < 2; ++column) {
      const Eigen::VectorXd change = step * forces.col(column);
      difference.col(column) = (solve(change) - solve(-change)) / (2 * step);
    }
    errors[i] = (difference - response).norm() / response.norm();
  }
  EXPECT_LE(errors[1], 1e-2);
  EXPECT_NEAR(errors[0] / errors[1], 4.0, 0.4);

  Eigen::MatrixXd directions = none;
  for (const int node : top_of(model))
    directions.middleRows<3>(3 * node) = Eigen::Matrix<double, 3, 2>::Identity();
  Eigen::MatrixXd moved;
  Eigen::MatrixXd both;
  ASSERT_TRUE(solver.tangent_response(load, u, directions, moved));
  ASSERT_TRUE(solver.tangent_response(load, u, directions, both, forces));
  EXPECT_LE((both - moved - response).norm(), kSameAnswer * both.norm());
}

// With lambda / mu = 1e8 the tangent keeps eight of sixteen digits. The last corrections are rounding, and
// the solve succeeds.
TEST(StaticSolverProperty, TangentResponseOfAnIllConditionedModelConverges) {
  BlockShape shape;
  shape.law = CompressibleNeoHookean{0.48, 0.48e8};
  const Model model = with_fixed_base(tetrahedral_block(shape));
  const Assembly assembly(model, model.fixed_dofs());
  StaticSolver solver(assembly);
  const LoadCase load = moved_top(model, Eigen::Vector3d::Zero());
  Eigen::MatrixXd directions = Eigen::MatrixXd::Zero(model.num_dofs(), 3);
  for (const int node : top_of(model)) directions.middleRows<3>(3 * node).setIdentity();
  Eigen::MatrixXd response;
  ASSERT_TRUE(solver.tangent_response(load, Eigen::VectorXd::Zero(model.num_dofs()), directions, response));
  const Eigen::MatrixXd force = assembly.tangent_times(Eigen::VectorXd::Zero(model.num_dofs()), response);
  double unbalanced = 0;
  for (int dof = 0; dof < model.num_dofs(); ++dof) {
    if (!load.held[static_cast<size_t>(dof)]) unbalanced = std::max(unbalanced, force.row(dof).norm());
  }
  EXPECT_LE(unbalanced, 1e-12 * force.norm());
}

}  // namespace tangent_response_test
}  // namespace palpate::static_solver_fixture
