// Properties of Newton's method on whole models, independent of particular numbers.
#include <gtest/gtest.h>

#include "tests/support/static_solver_fixture.hpp"

namespace palpate::static_solver_fixture {
namespace static_solver_test {

// The load case between rest and `to` at a fraction of a ramp.
LoadCase part_of(const LoadCase& to, double factor) {
  LoadCase load = to;
  load.displacement *= factor;
  load.force *= factor;
  return load;
}

TEST(StaticSolverProperty, RampsHeldDisplacements) {
  const Model model = organ();
  const Assembly assembly(model, model.fixed_dofs());
  StaticSolver solver(assembly);
  const LoadCase load = moved_top(model, kPush);
  Eigen::VectorXd u = Eigen::VectorXd::Zero(model.num_dofs());
  SolverSettings settings;
  settings.first_increment = settings.largest_increment = 0.3;  // sums of parts must not leave their rounding
  int reported = 0;
  const SolveReport report =
      solver.ramp(LoadCase::rest(model), load, u, settings, [&](const IterationRecord&) { ++reported; });
  ASSERT_TRUE(report.converged);
  EXPECT_EQ(report.load_factor, 1.0);
  EXPECT_EQ(reported, report.iterations);
  EXPECT_EQ(report.history.size(), static_cast<size_t>(report.iterations));
  EXPECT_LE(report.residual, SolverSettings().residual_tolerance);
  EXPECT_LE(imbalance(assembly, load, u), SolverSettings().residual_tolerance);
  for (int dof = 0; dof < model.num_dofs(); ++dof) {
    if (load.held[static_cast<size_t>(dof)]) {
      EXPECT_EQ(u[dof], load.displacement[dof]) << "to the bit";
    }
  }
  Eigen::VectorXd force;
  const ElementState state = assembly.internal_force(u, force);
  EXPECT_EQ(report.min_jacobian, state.min_jacobian);
  EXPECT_EQ(report.worst_element, state.worst_element);

  // The way back, too: its last part is no small change of the state.
  const LoadCase back = moved_top(model, {-0.07, 0.013, -0.011});
  ASSERT_TRUE(solver.ramp(load, back, u, SolverSettings()).converged);
  for (const int node : top_of(model))
    EXPECT_EQ(u.segment<3>(3 * node), back.displacement.segment<3>(3 * node));
}

TEST(StaticSolverProperty, ReactionsBalanceAppliedForces) {
  const Model model = organ();
  const Assembly assembly(model, model.fixed_dofs());
  StaticSolver solver(assembly);
  const LoadCase load = pulled_top(model, kPull);
  Eigen::VectorXd u = Eigen::VectorXd::Zero(model.num_dofs());
  ASSERT_TRUE(solver.ramp(LoadCase::rest(model), load, u, SolverSettings()).converged);
  Eigen::VectorXd force;
  assembly.internal_force(u, force);
  Eigen::Vector3d reaction = Eigen::Vector3d::Zero();
  for (const int node : nodes_on_plane(model, 2, 0.0)) reaction += force.segment<3>(3 * node);
  EXPECT_LE((reaction + kPull).norm(), kSameAnswer * kPull.norm());
  EXPECT_LE((force - load.force).tail(model.num_dofs() - 48).norm(), kSameAnswer * kPull.norm())
      << "the 16 nodes of the base come first; all others carry what is applied";
  EXPECT_GT(u.norm(), 0.1) << "the load must be large enough to mean something";
}

TEST(StaticSolverProperty, StepsFollowOneAnother) {
  const Model model = organ();
  const Assembly assembly(model, model.fixed_dofs());
  StaticSolver solver(assembly);
  const LoadCase first = moved_top(model, {0.0, 0.0, -0.2});
  const LoadCase second = moved_top(model, kPush);
  Eigen::VectorXd by_steps = Eigen::VectorXd::Zero(model.num_dofs());
  ASSERT_TRUE(solver.ramp(LoadCase::rest(model), first, by_steps, SolverSettings()).converged);
  EXPECT_LE(imbalance(assembly, first, by_steps), SolverSettings().residual_tolerance);
  ASSERT_TRUE(solver.ramp(first, second, by_steps, SolverSettings()).converged);
  Eigen::VectorXd at_once = Eigen::VectorXd::Zero(model.num_dofs());
  ASSERT_TRUE(solver.ramp(LoadCase::rest(model), second, at_once, SolverSettings()).converged);
  EXPECT_LE((by_steps - at_once).norm(), kSameAnswer * at_once.norm()) << "an elastic body forgets its path";
}

TEST(StaticSolverProperty, ForceAfterForceMovesBetweenThem) {
  const Model model = organ();
  const Assembly assembly(model, model.fixed_dofs());
  StaticSolver solver(assembly);
  const LoadCase pull = pulled_top(model, kPull);
  Eigen::VectorXd u = Eigen::VectorXd::Zero(model.num_dofs());
  ASSERT_TRUE(solver.ramp(LoadCase::rest(model), pull, u, SolverSettings()).converged);
  ASSERT_GT(u.norm(), 0.1);
  ASSERT_TRUE(solver.ramp(pull, LoadCase::rest(model), u, SolverSettings()).converged);
  EXPECT_LE(u.norm(), kSameAnswer) << "unloaded, it is back at rest";
}

TEST(StaticSolverProperty, AReleasedDofIsLetGo) {
  const Model model = organ();
  const Assembly assembly(model, model.fixed_dofs());
  StaticSolver solver(assembly);
  const LoadCase pushed = moved_top(model, {0.0, 0.0, -0.2});
  LoadCase free_sideways = pushed;  // keeps the height, frees x and y
  for (const int node : top_of(model)) {
    for (const int axis : {0, 1}) free_sideways.held[static_cast<size_t>(3 * node + axis)] = 0;
  }
  SolverSettings settings;
  settings.first_increment = settings.largest_increment = 0.5;
  Eigen::VectorXd u = Eigen::VectorXd::Zero(model.num_dofs());
  ASSERT_TRUE(solver.ramp(LoadCase::rest(model), pushed, u, settings).converged);
  Eigen::VectorXd at_push;
  assembly.internal_force(u, at_push);

  // Half way, half of the reaction is left.
  Eigen::VectorXd half = u;
  SolverSettings one = settings;
  one.max_increments = 1;
  const SolveReport stopped = solver.ramp(pushed, free_sideways, half, one);
  EXPECT_FALSE(stopped.converged);
  ASSERT_EQ(stopped.load_factor, 0.5);
  Eigen::VectorXd at_half;
  assembly.internal_force(half, at_half);
  for (const int node : top_of(model)) {
    for (const int axis : {0, 1})
      EXPECT_NEAR(at_half[3 * node + axis], 0.5 * at_push[3 * node + axis], kSameAnswer * at_push.norm());
  }

  ASSERT_TRUE(solver.ramp(pushed, free_sideways, u, settings).converged);
  EXPECT_LE(imbalance(assembly, free_sideways, u), settings.residual_tolerance);
  Eigen::VectorXd direct = Eigen::VectorXd::Zero(model.num_dofs());
  ASSERT_TRUE(solver.ramp(LoadCase::rest(model), free_sideways, direct, settings).converged);
  EXPECT_LE((u - direct).norm(), kSameAnswer * direct.norm());

  // The whole way, back to rest.
  ASSERT_TRUE(solver.ramp(free_sideways, LoadCase::rest(model), u, settings).converged);
  EXPECT_LE(u.norm(), kSameAnswer);
}

TEST(StaticSolverProperty, ADofHeldLaterStartsWhereItIs) {
  const Model model = organ();
  const Assembly assembly(model, model.fixed_dofs());
  StaticSolver solver(assembly);
  const LoadCase pull = pulled_top(model, kPull);
  Eigen::VectorXd u = Eigen::VectorXd::Zero(model.num_dofs());
  ASSERT_TRUE(solver.ramp(LoadCase::rest(model), pull, u, SolverSettings()).converged);
  LoadCase hold = pull;
  hold.displacement = u;
  for (const int node : top_of(model)) hold.held[static_cast<size_t>(3 * node)] = 1;
  const Eigen::VectorXd before = u;
  ASSERT_TRUE(solver.ramp(pull, hold, u, SolverSettings()).converged);
  EXPECT_LE((u - before).norm(), kSameAnswer * before.norm()) << "held where it was: nothing moves";
}

TEST(StaticSolverProperty, ConvergesQuadratically) {
  const Model model = organ();
  const Assembly assembly(model, model.fixed_dofs());
  StaticSolver solver(assembly);
  SolverSettings settings;
  settings.reuse_contraction = 0;
  settings.residual_tolerance = 1e-14;
  Eigen::VectorXd u = Eigen::VectorXd::Zero(model.num_dofs());
  const SolveReport report = solver.ramp(LoadCase::rest(model), pulled_top(model, kPull), u, settings);
  ASSERT_TRUE(report.converged);
  ASSERT_EQ(report.increments, 1);
  // Below 1e-1 each residual is about a constant times the square of the residual before, until rounding
  // (1e-14).
  int squared = 0;
  for (size_t i = 1; i < report.history.size(); ++i) {
    const double before = report.history[i - 1].residual;
    const double now = report.history[i].residual;
    if (before > 1e-1 || before < 1e-7) continue;
    EXPECT_LE(now, std::max(30 * before * before, 1e-14)) << "iteration " << i + 1;
    ++squared;
  }
  EXPECT_GE(squared, 2) << "else this test shows nothing";
}

TEST(StaticSolverProperty, OldFactorsGiveTheSameAnswer) {
  const Model model = organ();
  const Assembly assembly(model, model.fixed_dofs());
  StaticSolver solver(assembly);
  const LoadCase load = moved_top(model, kPush);
  SolverSettings settings;
  Eigen::VectorXd reused = Eigen::VectorXd::Zero(model.num_dofs());
  const SolveReport with_reuse = solver.ramp(LoadCase::rest(model), load, reused, settings);
  settings.reuse_contraction = 0;
  solver.forget_factor();
  Eigen::VectorXd fresh = Eigen::VectorXd::Zero(model.num_dofs());
  const SolveReport without = solver.ramp(LoadCase::rest(model), load, fresh, settings);
  ASSERT_TRUE(with_reuse.converged);
  ASSERT_TRUE(without.converged);
  EXPECT_LT(with_reuse.factorizations, without.factorizations) << "else this test shows nothing";
  EXPECT_LE((reused - fresh).norm(), kSameAnswer * fresh.norm());
}

TEST(StaticSolverProperty, CorrectLeavesItsGuessWhenItFails) {
  const Model model = organ();
  const Assembly assembly(model, model.fixed_dofs());
  StaticSolver solver(assembly);
  SolverSettings settings;
  settings.max_iterations = 1;
  Eigen::VectorXd u = Eigen::VectorXd::Zero(model.num_dofs());
  const Eigen::VectorXd guess = u;
  SolveReport report = solver.correct(pulled_top(model, kPull), u, settings);
  EXPECT_FALSE(report.converged);
  EXPECT_EQ(report.load_factor, 0.0);
  EXPECT_EQ(u, guess);

  // A guess with an inverted element is no valid start.
  u = moved_top(model, {0, 0, -1}).displacement;
  const Eigen::VectorXd inverted = u;
  report = solver.correct(moved_top(model, {0, 0, -1}), u, SolverSettings());
  EXPECT_FALSE(report.converged);
  EXPECT_EQ(u, inverted);

  u = guess;
  report = solver.correct(pulled_top(model, kPull), u, SolverSettings());
  EXPECT_TRUE(report.converged);
  EXPECT_LE(imbalance(assembly, pulled_top(model, kPull), u), SolverSettings().residual_tolerance);
}

TEST(StaticSolverProperty, AnUnstableStartIsLeftDownhill) {
  const Model model = organ();
  const Assembly assembly(model, model.fixed_dofs());
  StaticSolver solver(assembly);
  const LoadCase nothing = LoadCase::rest(model);
  // Flattened to 0.3 and released: compressed elements rotate, so K is not positive definite.
  Eigen::VectorXd u = test::affine_displacement(model, Eigen::Vector3d(1, 1, 0.3).asDiagonal());
  ASSERT_FALSE(solver.factorize_at(nothing, u, false)) << "else this test shows nothing";
  ASSERT_TRUE(solver.factorize_at(nothing, u, true));
  solver.forget_factor();
  const SolveReport report = solver.correct(nothing, u, SolverSettings());
  ASSERT_TRUE(report.converged);
  EXPECT_TRUE(report.history.front().projected);
  EXPECT_FALSE(report.history.back().projected);
  EXPECT_LE(u.norm(), kSameAnswer);
}

TEST(StaticSolverProperty, AnImpossibleLoadStopsAtAnEquilibrium) {
  BlockShape shape;
  shape.cells = {2, 2, 2};
  const Model model = with_fixed_base(tetrahedral_block(shape));
  const Assembly assembly(model, model.fixed_dofs());
  StaticSolver solver(assembly);
  const LoadCase crushed = moved_top(model, {0, 0, -1.25});  // the top below the base
  SolverSettings settings;
  settings.smallest_increment = 1e-3;
  Eigen::VectorXd u = Eigen::VectorXd::Zero(model.num_dofs());
  const SolveReport report = solver.ramp(LoadCase::rest(model), crushed, u, settings);
  EXPECT_FALSE(report.converged);
  EXPECT_GT(report.load_factor, 0.2);
  EXPECT_LT(report.load_factor, 0.8) << "at 0.8 the block is flat";
  const LoadCase reached = part_of(crushed, report.load_factor);
  for (const int node : top_of(model))
    EXPECT_NEAR(u[3 * node + 2], -1.25 * report.load_factor, 1e-12) << "on the ramp";
  EXPECT_LE(imbalance(assembly, reached, u), settings.residual_tolerance);
  EXPECT_GT(report.min_jacobian, 0);
  Eigen::VectorXd force;
  EXPECT_EQ(assembly.internal_force(u, force).min_jacobian, report.min_jacobian);
  for (const IterationRecord& record : report.history)
    EXPECT_GT(record.min_jacobian, 0) << "no accepted trial may be inverted";
}

TEST(StaticSolverProperty, IncrementsKeepTheirBounds) {
  const Model model = organ();
  const Assembly assembly(model, model.fixed_dofs());
  StaticSolver solver(assembly);
  const LoadCase load = moved_top(model, {0, 0, -0.1});
  // Load factors of the increments on an easy problem.
  const auto factors = [&](const SolverSettings& settings, SolveReport& report) {
    Eigen::VectorXd u = Eigen::VectorXd::Zero(model.num_dofs());
    report = solver.ramp(LoadCase::rest(model), load, u, settings);
    std::vector<double> result;
    for (const IterationRecord& record : report.history) {
      if (result.empty() || result.back() != record.load_factor) result.push_back(record.load_factor);
    }
    return result;
  };
  SolveReport report;
  SolverSettings settings;
  EXPECT_EQ(factors(settings, report), (std::vector<double>{1.0}));

  settings.first_increment = 0.125;  // then half as much again each time: 0.1875, 0.28125, the rest
  EXPECT_EQ(factors(settings, report), (std::vector<double>{0.125, 0.3125, 0.59375, 1.0}));
  ASSERT_TRUE(report.converged);

  settings.largest_increment = 0.25;
  EXPECT_EQ(factors(settings, report), (std::vector<double>{0.125, 0.3125, 0.5625, 0.8125, 1.0}));
  ASSERT_TRUE(report.converged);
  EXPECT_EQ(report.increments, 5);

  settings.first_increment = 1.0;  // the bound holds for the first increment too
  EXPECT_EQ(factors(settings, report), (std::vector<double>{0.25, 0.5, 0.75, 1.0}));

  settings.largest_increment = 0.1;  // ten increments leave a sliver of rounding, which is no increment
  EXPECT_EQ(factors(settings, report).size(), 10U);
  EXPECT_EQ(report.load_factor, 1.0);

  settings.max_increments = 3;
  factors(settings, report);
  EXPECT_FALSE(report.converged);
  EXPECT_EQ(report.increments, 3);
  EXPECT_NEAR(report.load_factor, 0.3, 1e-15);
}

TEST(StaticSolverProperty, CutbacksAreNotIncrements) {
  const Model model = organ();
  const Assembly assembly(model, model.fixed_dofs());
  StaticSolver solver(assembly);
  SolverSettings settings;
  settings.max_iterations = 3;  // too few for the whole push at once
  settings.reuse_contraction = 0;
  Eigen::VectorXd u = Eigen::VectorXd::Zero(model.num_dofs());
  const LoadCase load = moved_top(model, 2 * kPush);
  const SolveReport first = solver.ramp(LoadCase::rest(model), load, u, settings);
  ASSERT_TRUE(first.converged);
  ASSERT_GT(first.cutbacks, 0);
  settings.max_increments = first.increments;
  u.setZero();
  solver.forget_factor();
  const SolveReport again = solver.ramp(LoadCase::rest(model), load, u, settings);
  EXPECT_TRUE(again.converged);
  EXPECT_EQ(again.increments, first.increments);
  EXPECT_EQ(again.cutbacks, first.cutbacks);
}

TEST(StaticSolverProperty, AfterForgettingNothingIsRemembered) {
  const Model model = organ();
  const Assembly assembly(model, model.fixed_dofs());
  const LoadCase load = pulled_top(model, kPull);
  StaticSolver fresh(assembly);
  Eigen::VectorXd expected = Eigen::VectorXd::Zero(model.num_dofs());
  const SolveReport first = fresh.correct(load, expected, SolverSettings());
  ASSERT_TRUE(first.converged);

  StaticSolver used(assembly);
  const auto solve_something_else = [&] {
    Eigen::VectorXd u = Eigen::VectorXd::Zero(model.num_dofs());
    ASSERT_TRUE(
        used.ramp(LoadCase::rest(model), pulled_top(model, -0.5 * kPull), u, SolverSettings()).converged);
  };
  solve_something_else();
  Eigen::VectorXd u = Eigen::VectorXd::Zero(model.num_dofs());
  SolveReport report = used.correct(load, u, SolverSettings());
  ASSERT_TRUE(report.converged);
  EXPECT_NE(u, expected) << "an old factor takes another path, else this test shows nothing";
  EXPECT_LE((u - expected).norm(), kSameAnswer * expected.norm());

  solve_something_else();
  used.forget_factor();
  u.setZero();
  report = used.correct(load, u, SolverSettings());
  EXPECT_EQ(u, expected) << "to the bit";
  EXPECT_EQ(report.iterations, first.iterations);
  EXPECT_EQ(report.factorizations, first.factorizations);
}

}  // namespace static_solver_test
}  // namespace palpate::static_solver_fixture
