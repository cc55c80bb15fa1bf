// Newton on whole models: what must hold whatever the numbers are.
#include "offline/fem/static_solver.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "tests/support/tetrahedral_block.hpp"

namespace palpate {
namespace {

using test::BlockShape;
using test::nodes_on_plane;
using test::rotation_about;
using test::tetrahedral_block;
using test::with_fixed_base;

// Of displacements and forces, where two solves stop at different points below the default tolerance of
// 1e-10.
constexpr double kSameAnswer = 1e-9;

// A unit block on a fixed base.
Model organ() {
  return with_fixed_base(tetrahedral_block(BlockShape()));
}

std::vector<int> top_of(const Model& model) {
  double highest = 0;
  for (const Eigen::Vector3d& position : model.positions) highest = std::max(highest, position.z());
  return nodes_on_plane(model, 2, highest);
}

// The top moves as one.
LoadCase moved_top(const Model& model, const Eigen::Vector3d& motion) {
  LoadCase load = LoadCase::rest(model);
  for (const int node : top_of(model)) {
    for (int axis = 0; axis < 3; ++axis) {
      load.held[static_cast<size_t>(3 * node + axis)] = 1;
      load.displacement[3 * node + axis] = motion[axis];
    }
  }
  return load;
}

// A force shared by the nodes of the top.
LoadCase pulled_top(const Model& model, const Eigen::Vector3d& total) {
  LoadCase load = LoadCase::rest(model);
  const std::vector<int> top = top_of(model);
  for (const int node : top) load.force.segment<3>(3 * node) = total / static_cast<double>(top.size());
  return load;
}

// |f_ext - P| over the free dofs over |P| at the held ones plus |f_ext|.
double imbalance(const Assembly& assembly, const LoadCase& load, const Eigen::VectorXd& displacement) {
  Eigen::VectorXd force;
  assembly.internal_force(displacement, force);
  double free = 0;
  double held = 0;
  double applied = 0;
  for (int dof = 0; dof < assembly.num_dofs(); ++dof) {
    if (load.held[static_cast<size_t>(dof)]) {
      held += force[dof] * force[dof];
    } else {
      free += std::pow(load.force[dof] - force[dof], 2);
      applied += load.force[dof] * load.force[dof];
    }
  }
  return std::sqrt(free) / (std::sqrt(held) + std::sqrt(applied));
}

// The state between `from` and `to` where a ramp over held displacements stands.
LoadCase part_of(const LoadCase& to, double factor) {
  LoadCase load = to;
  load.displacement *= factor;
  load.force *= factor;
  return load;
}

const Eigen::Vector3d kPush(0.15, 0.05, -0.3);
const Eigen::Vector3d kPull(0.03, 0.0, 0.12);

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

  // Nor may the way back, whose last part is no small change of what is there.
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
  LoadCase free_sideways = pushed;  // keeps the height, lets x and y go
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

  // And all of it, back to rest.
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
  // Once below 1e-1 each residual is about a constant times the square of the one before, until rounding
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

  // A guess with an inverted element is no place to start from.
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
  // Flattened to 0.3 and let go: pressed elements would rather turn, so K is not positive definite.
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
  // Load factors of the increments, as an easy problem takes them.
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

  settings.first_increment = 1.0;  // the bound holds for the first one too
  EXPECT_EQ(factors(settings, report), (std::vector<double>{0.25, 0.5, 0.75, 1.0}));

  settings.largest_increment = 0.1;  // ten of which leave a sliver to rounding, which is no increment
  EXPECT_EQ(factors(settings, report).size(), 10U);
  EXPECT_EQ(report.load_factor, 1.0);

  settings.max_increments = 3;
  factors(settings, report);
  EXPECT_FALSE(report.converged);
  EXPECT_EQ(report.increments, 3);
  EXPECT_NEAR(report.load_factor, 0.3, 1e-15);
}

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

  // With the factor of a neighbouring state, and with its own: the same.
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

// Of outer forces too, and of both together it is the sum.
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

// With lambda / mu = 1e8 the tangent keeps eight of sixteen digits: the last corrections are rounding, not a
// refusal.
TEST(StaticSolverProperty, TangentResponseOfAnIllConditionedModelBalances) {
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

// What is let go comes back to rest, where no force is left to measure the residual by.
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

// The residual of a tiny push drowns in the rounding of P: near enough is all there is, and no failure.
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
      // Second order in the strain, stiffened by lambda, and the rounding of F over the strain.
      EXPECT_LE((u - expected).norm(), (10 * size + 1e-13 / size) * expected.norm()) << lambda << " " << size;
    }
  }
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

// Conjugate gradients come to the same equilibria, also where the tangent is indefinite on the way.
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

TEST(ConjugateGradientProperty, SolvesWhatIsPositiveDefiniteAndRefusesTheRest) {
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
  for (Eigen::Index i = 0; i < stiffness.rows(); ++i) stiffness.coeffRef(i, i) -= 0.5;  // no longer definite
  solver.prepare(stiffness);
  b = x;
  EXPECT_FALSE(solver.solve(b));
  EXPECT_EQ(b, x) << "a refused right-hand side stays";
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

}  // namespace
}  // namespace palpate
