// Paths through limit points, compared with closed forms, a rod, and solves at prescribed displacements.
// Displacement control passes a limit point of the load without difficulty.
#include <gtest/gtest.h>

#include "tests/support/limit_points_fixture.hpp"

namespace palpate::limit_points_fixture {
namespace limit_points_test {

using test::Truss;

// Over the largest load: the truss's caps are ten thousand times stiffer than its bar, not rigid.
constexpr double kCaps = 1e-4;

// Two solves to the default tolerance of 1e-10 stop at different points.
constexpr double kSameAnswer = 1e-7;

// Rounding of the forces in the caps, over the largest load.
constexpr double kCapsRounding = 1e-7;

constexpr double kTrussLoad = 1e-3;

PathScene truss_scene(const Truss& truss) {
  PathScene scene = truss.scene();
  scene.load.force[scene.dof()] = -kTrussLoad;
  return scene;
}

// Past both limit points and the mirror image.
ArcLengthSettings truss_settings(const Truss& truss, const PathScene& scene,
                                 Stepping stepping = Stepping::arc_length) {
  ArcLengthSettings settings;
  settings.stepping = stepping;
  settings.first_increment = 0.05;
  settings.end_displacement = {scene.dof(), -2.3 * truss.rise};
  return settings;
}

// The largest and the smallest load factor of the truss between its two symmetric states.
std::pair<double, double> truss_limits(const Truss& truss) {
  double most = 0;
  double least = 0;
  for (int i = 0; i <= 20000; ++i) {
    const double factor = truss.force(1e-4 * i * truss.rise) / kTrussLoad;
    most = std::max(most, factor);
    least = std::min(least, factor);
  }
  return {most, least};
}

INSTANTIATE_TEST_SUITE_P(Stepping, LimitPointsBy,
                         ::testing::Values(Stepping::arc_length, Stepping::current_stiffness),
                         [](const auto& one) {
                           return one.param == Stepping::arc_length ? "ArcLength" : "CurrentStiffness";
                         });

TEST_P(LimitPointsBy, AShallowTrussSnapsThrough) {
  const Truss truss;
  const PathScene scene = truss_scene(truss);
  const auto [most, least] = truss_limits(truss);
  const PathRun run = follow_path(scene, truss_settings(truss, scene, GetParam()));
  ASSERT_TRUE(run.report.converged);
  EXPECT_LE(run.report.increments, GetParam() == Stepping::arc_length ? 30 : 45);
  EXPECT_LE(run.report.iterations, 6 * run.report.increments);
  EXPECT_NEAR(run.moved(run.points.size() - 1, scene.dof()), -2.3 * truss.rise, 1e-12) << "ends where asked";
  EXPECT_EQ(run.report.load_factor, run.points.back().load_factor);
  int unstable = 0;
  for (size_t i = 0; i < run.points.size(); ++i) {
    const PathPoint& point = run.points[i];
    const double w = -run.moved(i, scene.dof());
    SCOPED_TRACE(testing::Message() << "w " << w);
    EXPECT_NEAR(point.load_factor, truss.force(w) / kTrussLoad, kCaps * most);
    EXPECT_LE(imbalance(scene, times(scene.load, point.load_factor), run.states[i], most * kTrussLoad),
              kCapsRounding);
    EXPECT_GT(point.min_jacobian, 0);
    // Stable, with positive stiffness, where the load grows with the displacement.
    const double slope = truss.force(w + 1e-6) - truss.force(w - 1e-6);
    EXPECT_EQ(point.negative_pivots, slope > 0 ? 0 : 1);
    EXPECT_EQ(point.current_stiffness > 0, slope > 0);
    const double first_slope = truss.force(1e-6) - truss.force(-1e-6);
    EXPECT_NEAR(point.current_stiffness, slope / first_slope, 1e-3);
    unstable += point.negative_pivots;
  }
  EXPECT_GE(unstable, 5) << "else this test shows nothing";
  const std::vector<double> limits = limit_load_factors(run.points);
  ASSERT_EQ(limits.size(), 2U);
  EXPECT_NEAR(limits[0], most, 2e-3 * most);
  EXPECT_NEAR(limits[1], least, 1e-2 * most);

  ArcLengthSettings fine = truss_settings(truss, scene, GetParam());
  fine.largest_increment = 0.05;
  const std::vector<double> finer = limit_load_factors(follow_path(scene, fine).points);
  ASSERT_EQ(finer.size(), 2U);
  EXPECT_NEAR(finer[0], most, kCaps * most);
  EXPECT_NEAR(finer[1], least, kCaps * most);
}

TEST(LimitPoints, EveryPointIsThatOfASolveAtGivenDisplacement) {
  const Truss truss;
  const PathScene scene = truss_scene(truss);
  const PathRun run = follow_path(scene, truss_settings(truss, scene));
  const Assembly assembly(scene.model, scene.model.fixed_dofs());
  StaticSolver solver(assembly);
  Eigen::VectorXd u = Eigen::VectorXd::Zero(scene.model.num_dofs());
  LoadCase from = LoadCase::rest(scene.model);
  for (size_t i = 1; i < run.points.size(); ++i) {
    LoadCase to = from;
    to.held[static_cast<size_t>(scene.dof())] = 1;
    to.displacement[scene.dof()] = run.moved(i, scene.dof());
    ASSERT_TRUE(solver.ramp(from, to, u, SolverSettings()).converged) << i;
    EXPECT_LE((u - run.states[i]).norm(), kSameAnswer * u.norm()) << i;
    Eigen::VectorXd force;
    assembly.internal_force(u, force);
    EXPECT_NEAR(-force[scene.dof()], run.points[i].load_factor * kTrussLoad, kSameAnswer * kTrussLoad) << i;
    from = to;
  }
}

// Where the loaded point's displacement turns back, the load still falls. The sign of the current stiffness
// parameter would raise the load and retrace the path.
TEST(LimitPoints, ThePathIsFollowedWhereItsDisplacementTurnsBack) {
  const test::ColumnOnTruss body;
  int apex = 0;
  PathScene scene = body.scene(apex);
  scene.load.force[scene.dof()] = -kTrussLoad;
  ArcLengthSettings settings;
  settings.first_increment = 0.03;
  settings.largest_increment = 0.1;
  settings.end_displacement = {3 * apex + 2, -2.1 * body.truss.rise};
  const PathRun run = follow_path(scene, settings);
  ASSERT_TRUE(run.report.converged);
  const double most = truss_limits(body.truss).first;
  int comes_back = 0;
  for (size_t i = 1; i < run.points.size(); ++i) {
    const double w = -run.moved(i, 3 * apex + 2);
    SCOPED_TRACE(testing::Message() << "w " << w);
    EXPECT_NEAR(run.points[i].load_factor, body.truss.force(w) / kTrussLoad, kCaps * most);
    EXPECT_GT(w, -run.moved(i - 1, 3 * apex + 2)) << "the apex goes on";
    const bool falls = run.points[i].load_factor < run.points[i - 1].load_factor;
    const bool back = run.moved(i, scene.dof()) > run.moved(i - 1, scene.dof());
    if (!falls || !back || w < 0.6 * body.truss.rise || w > 1.4 * body.truss.rise) continue;
    ++comes_back;
    EXPECT_GT(run.points[i].current_stiffness, 0);
    EXPECT_EQ(run.points[i].negative_pivots, 1);
  }
  EXPECT_GE(comes_back, 4) << "else this test shows nothing";
}

// Bergan's procedure makes the loaded point's deflection grow. On a snap-back it reverses the load.
TEST(LimitPoints, BergansSignIsMisledWhereTheDisplacementTurnsBack) {
  const test::ColumnOnTruss body;
  int apex = 0;
  PathScene scene = body.scene(apex);
  scene.load.force[scene.dof()] = -kTrussLoad;
  ArcLengthSettings settings;
  settings.stepping = Stepping::current_stiffness;
  settings.first_increment = 0.03;
  settings.largest_increment = 0.1;
  settings.end_displacement = {3 * apex + 2, -2.1 * body.truss.rise};
  const PathRun run = follow_path(scene, settings);
  EXPECT_FALSE(run.report.converged);
  EXPECT_EQ(run.report.stopped, StopCause::path_reversed);
  EXPECT_LE(run.report.increments, 30);
  const double most = truss_limits(body.truss).first;
  for (size_t i = 1; i < run.points.size(); ++i) {
    const double w = -run.moved(i, 3 * apex + 2);
    SCOPED_TRACE(testing::Message() << "w " << w);
    EXPECT_NEAR(run.points[i].load_factor, body.truss.force(w) / kTrussLoad, kCaps * most);
    EXPECT_GT(w, -run.moved(i - 1, 3 * apex + 2)) << "no point is passed twice";
  }
  const size_t last = run.points.size() - 1;
  EXPECT_EQ(run.report.load_factor, run.points[last].load_factor);
  EXPECT_LT(run.points[last].load_factor, run.points[last - 1].load_factor) << "the load falls";
  EXPECT_GT(run.points[last].current_stiffness, 0) << "and is told to grow";
  EXPECT_LT(run.points[last - 1].current_stiffness, 0) << "at the first point where it is";
}

TEST_P(LimitPointsBy, EarlierLoadsStay) {
  const Truss truss;
  PathScene scene = truss_scene(truss);
  constexpr double kDead = 0.1;
  const LoadCase dead = times(scene.load, kDead);
  const LoadCase all = times(scene.load, kDead + 1);
  const Assembly assembly(scene.model, scene.model.fixed_dofs());
  StaticSolver before(assembly);
  Eigen::VectorXd u = Eigen::VectorXd::Zero(scene.model.num_dofs());
  ASSERT_TRUE(before.ramp(LoadCase::rest(scene.model), dead, u, SolverSettings()).converged);
  ArcLength solver(assembly);
  std::vector<double> differences;
  const SolveReport report =
      solver.follow(dead, all, u, truss_settings(truss, scene, GetParam()),
                    [&](const PathPoint& point, const Eigen::VectorXd& state) {
                      differences.push_back(std::abs(truss.force(-state[scene.dof()]) / kTrussLoad - kDead -
                                                     point.load_factor));
                    });
  ASSERT_TRUE(report.converged);
  EXPECT_LE(*std::ranges::max_element(differences), kCaps);
}

TEST(LimitPoints, AGivenDisplacementIsScaledToo) {
  const Truss truss;
  PathScene scene = truss_scene(truss);
  LoadCase moved = LoadCase::rest(scene.model);
  moved.held[static_cast<size_t>(scene.dof())] = 1;
  moved.displacement[scene.dof()] = -truss.rise;
  scene.load = moved;
  ArcLengthSettings settings;
  settings.first_increment = 0.2;
  settings.end_load_factor = 2.3;
  const PathRun run = follow_path(scene, settings);
  ASSERT_TRUE(run.report.converged);
  EXPECT_EQ(run.report.load_factor, 2.3);
  const Assembly assembly(scene.model, scene.model.fixed_dofs());
  for (size_t i = 1; i < run.points.size(); ++i) {
    const double w = run.points[i].load_factor * truss.rise;
    EXPECT_NEAR(-run.moved(i, scene.dof()), w, 1e-14);
    Eigen::VectorXd force;
    assembly.internal_force(run.states[i], force);
    EXPECT_NEAR(-force[scene.dof()], truss.force(w), kCaps * kTrussLoad);
    EXPECT_EQ(run.points[i].negative_pivots, 0) << "held where it would snap, it is stable";
  }
}

// The truss's mirror image bears no load: the tolerance scales with earlier forces.
TEST_P(LimitPointsBy, AStateWithoutForcesIsPassed) {
  const Truss truss;
  const PathScene scene = truss_scene(truss);
  ArcLengthSettings settings = truss_settings(truss, scene, GetParam());
  settings.end_displacement->value = -2 * truss.rise;
  const PathRun run = follow_path(scene, settings);
  ASSERT_TRUE(run.report.converged);
  EXPECT_EQ(run.report.cutbacks, 0);
  EXPECT_LE(run.report.iterations, 6 * run.report.increments);
  EXPECT_NEAR(run.report.load_factor, 0, 1e-6);
}

TEST_P(LimitPointsBy, EndsAndIncrementsKeepTheirBounds) {
  const Truss truss;
  const PathScene scene = truss_scene(truss);
  ArcLengthSettings settings;
  settings.stepping = GetParam();
  settings.first_increment = 0.05;
  settings.largest_increment = 0.07;
  settings.max_increments = 4;
  PathRun run = follow_path(scene, settings);
  EXPECT_TRUE(run.report.converged) << "without an end the number of increments is one";
  EXPECT_EQ(run.report.increments, 4);
  EXPECT_NEAR(run.points[1].load_factor, 0.05, 0.005) << "a load factor at first";
  EXPECT_NEAR(run.points[1].arc_length, 0.05, 1e-12);
  for (size_t i = 2; i < run.points.size(); ++i)
    EXPECT_LE(run.points[i].arc_length - run.points[i - 1].arc_length, 0.07 + 1e-12);

  settings.end_load_factor = 0.23;
  run = follow_path(scene, settings);
  EXPECT_FALSE(run.report.converged);
  EXPECT_EQ(run.report.stopped, StopCause::increments);
  EXPECT_EQ(run.report.load_factor, run.points.back().load_factor);
  settings.max_increments = 50;
  run = follow_path(scene, settings);
  EXPECT_TRUE(run.report.converged);
  EXPECT_EQ(run.report.load_factor, 0.23);
  EXPECT_NEAR(truss.force(-run.moved(run.points.size() - 1, scene.dof())) / kTrussLoad, 0.23, kCaps);
  EXPECT_LT(-run.moved(run.points.size() - 1, scene.dof()), truss.rise) << "the first time it comes there";
}

// The limit on iterations is too low for any increment; the last equilibrium stays.
TEST_P(LimitPointsBy, AFailureLeavesTheLastEquilibrium) {
  const Truss truss;
  const PathScene scene = truss_scene(truss);
  ArcLengthSettings settings = truss_settings(truss, scene, GetParam());
  settings.smallest_increment = 0.02;
  settings.max_iterations = 2;
  const Assembly assembly(scene.model, scene.model.fixed_dofs());
  ArcLength solver(assembly);
  Eigen::VectorXd u = Eigen::VectorXd::Zero(scene.model.num_dofs());
  Eigen::VectorXd last;
  const SolveReport report =
      solver.follow(LoadCase::rest(scene.model), scene.load, u, settings,
                    [&](const PathPoint&, const Eigen::VectorXd& state) { last = state; });
  EXPECT_FALSE(report.converged);
  EXPECT_EQ(report.stopped, StopCause::iterations);
  EXPECT_GT(report.cutbacks, 0);
  EXPECT_EQ(u, last);
}

// Under load control the solver approaches the limit load from below, and names the limit.
TEST(LimitPoints, AtGivenLoadsASolveStopsAtTheLimitLoad) {
  const Truss truss;
  PathScene scene = truss_scene(truss);
  const double most = truss_limits(truss).first;
  const Assembly assembly(scene.model, scene.model.fixed_dofs());
  struct Try {
    double load;
    double first_increment;
  };
  // The second load is so near to the limit that the tangent is nearly singular.
  for (const auto& [load, first] : {Try{1.1 * most, 1.0}, Try{0.5, 0.1}, Try{4 * most, 1.0}}) {
    SCOPED_TRACE(testing::Message() << load << " first " << first);
    StaticSolver solver(assembly);
    SolverSettings settings;
    settings.first_increment = first;
    settings.smallest_increment = 1e-4;
    settings.keep_to_path = true;
    Eigen::VectorXd u = Eigen::VectorXd::Zero(scene.model.num_dofs());
    const SolveReport report = solver.ramp(LoadCase::rest(scene.model), times(scene.load, load), u, settings);
    EXPECT_FALSE(report.converged);
    EXPECT_EQ(report.stopped, StopCause::limit_point);
    EXPECT_NEAR(report.load_factor * load, most, 1e-3 * most);
    EXPECT_LT(-u[scene.dof()], 0.43 * truss.rise);
  }
  StaticSolver jumps(assembly);
  Eigen::VectorXd u = Eigen::VectorXd::Zero(scene.model.num_dofs());
  ASSERT_TRUE(
      jumps.ramp(LoadCase::rest(scene.model), times(scene.load, 2 * most), u, SolverSettings()).converged);
  EXPECT_GT(-u[scene.dof()], 2 * truss.rise) << "else this test shows nothing: there is another equilibrium";
}

}  // namespace limit_points_test
}  // namespace palpate::limit_points_fixture
