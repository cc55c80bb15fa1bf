// Linear solves by conjugate gradients.
#include <gtest/gtest.h>

#include "tests/support/static_solver_fixture.hpp"

namespace palpate::static_solver_fixture {
namespace conjugate_gradient_test {

// Conjugate gradients reach the same equilibria as the factorisation, also through indefinite tangents.
TEST(StaticSolverProperty, ConjugateGradientsAgree) {
  const Model model = organ();
  const Assembly assembly(model, model.fixed_dofs());
  StaticSolver direct(assembly);
  StaticSolver iterative(assembly, LinearSolver::conjugate_gradient);
  for (const LoadCase& load :
       {moved_top(model, kPush), pulled_top(model, kPull), moved_top(model, {0.1, 0, -0.45})}) {
    Eigen::VectorXd expected = Eigen::VectorXd::Zero(model.num_dofs());
    ASSERT_TRUE(direct.ramp(LoadCase::rest(model), load, expected, SolverSettings()).converged);
    Eigen::VectorXd u = Eigen::VectorXd::Zero(model.num_dofs());
    const SolveReport report = iterative.ramp(LoadCase::rest(model), load, u, SolverSettings());
    ASSERT_TRUE(report.converged);
    EXPECT_LE(report.residual, SolverSettings().residual_tolerance);
    EXPECT_LE((u - expected).norm(), 1e-8 * expected.norm());
  }
}

TEST(ConjugateGradientProperty, SolvesPositiveDefiniteSystemsAndRefusesOthers) {
  const Model model = organ();
  const Assembly assembly(model, model.fixed_dofs());
  Assembly::SparseLower stiffness;
  assembly.tangent(Eigen::VectorXd::Zero(model.num_dofs()), false, stiffness);
  const Eigen::VectorXd x = test::TestRandom(31).vector(stiffness.rows());
  Eigen::VectorXd b = stiffness.selfadjointView<Eigen::Lower>() * x;
  ConjugateGradient solver;
  solver.prepare(stiffness);
  ASSERT_TRUE(solver.solve(b));
  EXPECT_LE((b - x).norm(), 1e-6 * x.norm()) << "1e-9 times the condition";
  for (Eigen::Index i = 0; i < stiffness.rows(); ++i) stiffness.coeffRef(i, i) -= 0.5;  // indefinite
  solver.prepare(stiffness);
  b = x;
  EXPECT_FALSE(solver.solve(b));
  EXPECT_EQ(b, x) << "a refused right-hand side stays";
}

}  // namespace conjugate_gradient_test
}  // namespace palpate::static_solver_fixture
