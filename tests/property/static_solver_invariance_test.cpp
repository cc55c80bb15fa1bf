// Units, origin, observer and the size of a push do not change a solve.
#include <gtest/gtest.h>

#include "tests/support/static_solver_fixture.hpp"

namespace palpate::static_solver_fixture {
namespace static_solver_invariance_test {

using test::rotation_about;

TEST(StaticSolverProperty, UnitsDoNotMatter) {
  const Model metres = organ();
  const auto solve = [](const Model& model, double length, double force) {
    const Assembly assembly(model, model.fixed_dofs());
    StaticSolver solver(assembly);
    LoadCase load = moved_top(model, length * kPush);
    load.force = force * Eigen::VectorXd::Constant(model.num_dofs(), 1e-3);
    Eigen::VectorXd u = Eigen::VectorXd::Zero(model.num_dofs());
    const SolveReport report = solver.ramp(LoadCase::rest(model), load, u, SolverSettings());
    EXPECT_TRUE(report.converged);
    EXPECT_LE(imbalance(assembly, load, u), SolverSettings().residual_tolerance);
    return (u / length).eval();
  };
  const Eigen::VectorXd expected = solve(metres, 1, 1);
  struct Units {
    double length;
    double modulus;
  };
  for (const Units units : {Units{1e6, 1.0}, Units{1e-3, 1.0}, Units{1e6, 1e-9}, Units{1e-3, 1e12}}) {
    Model model = metres;
    for (Eigen::Vector3d& position : model.positions) position *= units.length;
    auto& law = std::get<CompressibleNeoHookean>(model.materials[0].law);
    law.mu *= units.modulus;
    law.lambda *= units.modulus;
    const Eigen::VectorXd u = solve(model, units.length, units.modulus * units.length * units.length);
    EXPECT_LE((u - expected).norm(), kSameAnswer * expected.norm())
        << "length unit " << units.length << ", modulus unit " << units.modulus;
  }
}

TEST(StaticSolverProperty, OriginDoesNotMatter) {
  const Model near = organ();
  Model far = near;
  for (Eigen::Vector3d& position : far.positions) position += Eigen::Vector3d(1.1e4, -0.7e4, 0.9e4);
  const auto solve = [&](const Model& model) {
    const Assembly assembly(model, model.fixed_dofs());
    StaticSolver solver(assembly);
    Eigen::VectorXd u = Eigen::VectorXd::Zero(model.num_dofs());
    EXPECT_TRUE(solver.ramp(LoadCase::rest(model), moved_top(near, kPush), u, SolverSettings()).converged);
    return u;
  };
  const Eigen::VectorXd expected = solve(near);
  // Coordinates of 1e4 are rounded at 2e-12; edges are a third.
  EXPECT_LE((solve(far) - expected).norm(), kSameAnswer * expected.norm());
}

TEST(StaticSolverProperty, TurnsWithTheObserver) {
  const Model upright = organ();
  const Eigen::Matrix3d Q = rotation_about({3, -1, 2}, 1.9);
  Model turned = upright;
  for (Eigen::Vector3d& position : turned.positions) position = Q * position;
  LoadCase load = moved_top(upright, kPush);
  const auto solve = [&](const Model& model) {
    const Assembly assembly(model, model.fixed_dofs());
    StaticSolver solver(assembly);
    Eigen::VectorXd u = Eigen::VectorXd::Zero(model.num_dofs());
    EXPECT_TRUE(solver.ramp(LoadCase::rest(model), load, u, SolverSettings()).converged);
    return u;
  };
  const Eigen::VectorXd expected = (Q * solve(upright).reshaped(3, upright.num_nodes())).reshaped();
  load.displacement = (Q * load.displacement.reshaped(3, upright.num_nodes())).reshaped().eval();
  EXPECT_LE((solve(turned) - expected).norm(), kSameAnswer * expected.norm());
}

// A released body returns to rest, where no force is left to scale the residual.
TEST(StaticSolverProperty, UnloadedToRestConvergesToRest) {
  const Model model = organ();
  const Assembly assembly(model, model.fixed_dofs());
  StaticSolver solver(assembly);
  const LoadCase rest = LoadCase::rest(model);
  for (const LoadCase& load : {moved_top(model, kPush), pulled_top(model, kPull)}) {
    Eigen::VectorXd u = Eigen::VectorXd::Zero(model.num_dofs());
    ASSERT_TRUE(solver.ramp(rest, load, u, SolverSettings()).converged);
    const double pushed = u.norm();
    const SolveReport report = solver.ramp(load, rest, u, SolverSettings());
    EXPECT_TRUE(report.converged);
    EXPECT_LE(report.residual, SolverSettings().residual_tolerance);
    EXPECT_LE(u.norm(), kSameAnswer * pushed);
    EXPECT_LE(report.iterations, 12);
  }
}

// The residual of a tiny push drowns in the rounding of P; the solve must still succeed.
TEST(StaticSolverProperty, TinyPushesConverge) {
  for (const double lambda : {0.2, 2e2, 2e4}) {
    BlockShape shape;
    shape.law = CompressibleNeoHookean{0.48, lambda};
    const Model model = with_fixed_base(tetrahedral_block(shape));
    const Assembly assembly(model, model.fixed_dofs());
    StaticSolver solver(assembly);
    Eigen::MatrixXd directions = Eigen::MatrixXd::Zero(model.num_dofs(), 3);
    for (const int node : top_of(model)) directions.middleRows<3>(3 * node).setIdentity();
    Eigen::MatrixXd linear;
    ASSERT_TRUE(solver.tangent_response(moved_top(model, Eigen::Vector3d::Zero()),
                                        Eigen::VectorXd::Zero(model.num_dofs()), directions, linear));
    for (const double size : {1e-4, 1e-6, 1e-8, 1e-10}) {
      Eigen::VectorXd u = Eigen::VectorXd::Zero(model.num_dofs());
      const SolveReport report =
          solver.ramp(LoadCase::rest(model), moved_top(model, size * kPush), u, SolverSettings());
      EXPECT_TRUE(report.converged) << lambda << " " << size;
      EXPECT_EQ(report.cutbacks, 0);
      const Eigen::VectorXd expected = size * linear * kPush;
      // Second order in the strain, times lambda, plus the rounding of F over the strain.
      EXPECT_LE((u - expected).norm(), (10 * size + 1e-13 / size) * expected.norm()) << lambda << " " << size;
    }
  }
}

}  // namespace static_solver_invariance_test
}  // namespace palpate::static_solver_fixture
