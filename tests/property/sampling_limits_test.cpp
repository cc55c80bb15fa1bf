// Displacements without a sample: impossible, unsolved, or on another equilibrium branch.
#include "offline/precompute/sampling.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "offline/precompute/ball_polynomials.hpp"
#include "offline/precompute/hermite_design.hpp"
#include "offline/precompute/patch_reach.hpp"
#include "offline/precompute/site_survey.hpp"
#include "schemas/monomials.hpp"
#include "tests/support/sampling_site.hpp"

namespace palpate {
namespace sampling_limits_test {

using test::BlockShape;
using test::nodes_on_plane;
using test::tetrahedral_block;
using test::touched_block;
using test::TouchedBlock;
using test::with_fixed_base;

// A slender column with its top edge pushed down. It buckles to either side, so a push may have two
// equilibria.
struct SamplingColumn : ::testing::Test {
  SamplingColumn() {
    BlockShape shape;
    shape.cells = {2, 1, 16};
    shape.size = {0.2, 0.3, 2.0};
    shape.jitter = 0;
    model = with_fixed_base(tetrahedral_block(shape));
    Scene scene;
    scene.max_displacement = 0.3;
    for (const int node : nodes_on_plane(model, 2, 2.0)) {
      if (std::abs(model.positions[static_cast<size_t>(node)].x() - 0.1) < 1e-9) scene.sites.push_back(node);
    }
    scene.output_nodes = extract_surface(model).nodes;
    sites = find_contact_sites(scene, model);
    // Both nodes of the middle edge move as one patch, which may rotate.
    site = sites.sites.front();
    site.patch.push_back(sites.sites.back().patch.front());
    site.patch_nodes.push_back(sites.sites.back().patch_nodes.front());
  }

  Model model;
  ContactSites sites;
  ContactSite site;
  RestState rest;
};

// A single step from rest may end on either branch. A state on the other branch is no sample.
TEST_F(SamplingColumn, TheOtherBranchIsNoSample) {
  const Assembly assembly(model, model.fixed_dofs());
  StaticSolver solver(assembly);
  const auto load_of = [&](const Eigen::Vector3d& d) {
    LoadCase load = rest.load_case(model);
    for (const int node : site.patch_nodes) {
      for (int axis = 0; axis < 3; ++axis) load.held[static_cast<size_t>(3 * node + axis)] = 1;
      load.displacement.segment<3>(3 * node) = d;
    }
    return load;
  };
  Eigen::MatrixXd motion = Eigen::MatrixXd::Zero(model.num_dofs(), 3);
  for (const int node : site.patch_nodes) motion.middleRows<3>(3 * node).setIdentity();
  // Energy of the stable state after one step along the tangent; none where no stable state exists.
  const auto energy_after_a_step = [&](const Eigen::Vector3d& d) -> std::optional<double> {
    const Eigen::VectorXd at_rest = Eigen::VectorXd::Zero(model.num_dofs());
    Eigen::MatrixXd tangent;
    solver.forget_factor();
    if (!solver.tangent_response(load_of(Eigen::Vector3d::Zero()), at_rest, motion, tangent)) return {};
    Eigen::VectorXd u = tangent * d;
    if (!solver.correct(load_of(d), u, SolverSettings()).converged) return {};
    if (!solver.tangent_response(load_of(d), u, motion, tangent)) return {};
    Eigen::VectorXd force;
    double energy = 0;
    assembly.internal_force(u, force, &energy);
    return energy;
  };
  int on_the_other = 0;
  int on_the_same = 0;
  for (const double down : {0.02, 0.05, 0.1, 0.15, 0.2, 0.3}) {
    for (const double side : {-0.05, -0.02, -0.01, -0.005, 0.005, 0.01, 0.02, 0.05}) {
      const Eigen::Vector3d d(side, 0, -down);
      SCOPED_TRACE(d.transpose());
      SiteSampler sampler(solver, sites, site, rest);
      Sample from_rest;
      if (!sampler.solve_from_rest(d, 4, from_rest)) continue;
      const std::optional<double> stepped = energy_after_a_step(d);
      const bool is_other = stepped && std::abs(*stepped - from_rest.energy) > 1e-3 * from_rest.energy;
      Sample sample;
      SiteSampler again(solver, sites, site, rest);
      const bool solved = again.solve(d, sample) == PushOutcome::solved;
      on_the_other += is_other;
      on_the_same += solved;
      if (is_other) {
        EXPECT_FALSE(solved);
      }
      if (!solved) continue;
      EXPECT_NEAR(sample.energy, from_rest.energy, 1e-6 * from_rest.energy);
      EXPECT_LE((sample.field - from_rest.field).norm(), 1e-5 * from_rest.field.norm());
    }
  }
  EXPECT_GT(on_the_other, 0) << "else this test shows nothing";
  EXPECT_GT(on_the_same, 20);
}

// All nodes fixed but a site: its elements are flat once the site is down by their height, 1/2.
struct SamplingLimit : ::testing::Test {
  SamplingLimit() {
    block.model.fixed.clear();
    const int only = block.scene.sites.front();
    for (int node = 0; node < block.model.num_nodes(); ++node) {
      if (node == only) continue;
      for (int axis = 0; axis < 3; ++axis) block.model.fixed.push_back({node, axis, 0.0});
    }
    block.scene.directions = Directions::inward;
    plan.least_samples = 8;
    plan.most_samples = 12;
  }

  std::vector<SiteResult> sample() {
    const Assembly assembly(block.model, block.model.fixed_dofs());
    return sample_sites(assembly, block.scene, block.sites, compute_linear_dd(assembly, block.sites), plan);
  }

  TouchedBlock block = touched_block(2, 0.0);
  SamplingPlan plan;
};

TEST_F(SamplingLimit, AnImpossiblePushIsNoSample) {
  const Assembly assembly(block.model, block.model.fixed_dofs());
  StaticSolver solver(assembly);
  const RestState rest;
  SiteSampler sampler(solver, block.sites, block.sites.sites.front(), rest);
  Sample sample;
  EXPECT_EQ(sampler.solve({0, 0, -0.2}, sample), PushOutcome::solved);
  EXPECT_NE(sampler.solve({0, 0, -0.6}, sample), PushOutcome::solved);
  EXPECT_EQ(sampler.solve({0, 0, -0.25}, sample), PushOutcome::solved) << "a failure must not stick";
}

// A survey counts an unsolved push as an error of 1, in its bin and in total.
TEST_F(SamplingLimit, UnsolvedPushesAreErrors) {
  block.scene.max_displacement = 0.6;
  block.scene.polynomial = false;  // no fit, which would shrink the ball
  const SiteResult result = sample().front();
  ASSERT_GT(result.unsolved, 0);
  ASSERT_LT(result.unsolved, static_cast<int>(result.survey.size()));
  EXPECT_EQ(static_cast<int>(result.survey.size()), plan.survey_samples);
  const Eigen::Index rows = 3 * static_cast<Eigen::Index>(block.sites.packed_nodes.size());
  const SurveyTable table = survey_errors(result.survey, 0.6, [&](size_t, const Eigen::Vector3d& d) {
    for (const SurveySample& sample : result.survey) {
      if (sample.solved && sample.truth.displacement == d)
        return Answer{sample.truth.field, sample.truth.force};
    }
    ADD_FAILURE() << "asked for a push without a truth";
    return Answer{Eigen::VectorXd::Zero(rows), Eigen::Vector3d::Zero()};
  });
  EXPECT_EQ(table.overall.samples, plan.survey_samples);
  EXPECT_EQ(table.overall.displacement.max, 1);
  EXPECT_EQ(table.overall.force.max, 1);
  EXPECT_EQ(table.bins.back().displacement.max, 1) << "the far end";
  EXPECT_EQ(table.bins.front().displacement.max, 0) << "the near end is solved, and the model perfect";
}

TEST_F(SamplingLimit, ABallThatReachesTooFarShrinks) {
  block.scene.max_displacement = 0.6;
  const SiteResult result = sample().front();
  const Eigen::Matrix3d& A = result.polynomial.to_unit;
  EXPECT_TRUE(is_shortened(least_reach(A), 0.6));
  EXPECT_GE(least_reach(A), 0.25 * 0.6);
  EXPECT_GT(result.min_jacobian, 0);
  EXPECT_FALSE(result.survey.empty());
  for (const SurveySample& sample : result.survey)
    EXPECT_LE((A * sample.truth.displacement).norm(), 1 + 1e-15);
}

// A block three times as wide: only downward pushes go too far, and only there the domain shrinks.
TEST_F(SamplingLimit, ABallIsCutOnlyWhereItReachesTooFar) {
  constexpr double kReach = 0.47;
  for (Eigen::Vector3d& position : block.model.positions) position.head<2>() *= 3;
  block.sites = find_contact_sites(block.scene, block.model);
  block.scene.max_displacement = kReach;
  plan.survey_samples = 400;
  const SiteResult result = sample().front();
  const Eigen::Matrix3d& A = result.polynomial.to_unit;
  const auto reach_along = [&](const Eigen::Vector3d& direction) { return 1 / (A * direction).norm(); };
  const Eigen::Vector3d inward = block.sites.sites.front().inward;
  ASSERT_LE((inward + Eigen::Vector3d::UnitZ()).norm(), 1e-12);
  EXPECT_LT(reach_along(inward), 0.75 * kReach);
  EXPECT_GT(reach_along(Eigen::Vector3d::UnitX()), 0.95 * kReach);
  EXPECT_GT(reach_along(Eigen::Vector3d::UnitY()), 0.95 * kReach);
  EXPECT_NEAR(least_reach(A), reach_along(inward), 0.05 * kReach);
  EXPECT_GE(result.min_jacobian, 0.1);
  EXPECT_NE(result.cut_by, PushOutcome::solved);
  // The survey covers the inward half of the ellipsoid.
  double least_inward = 1;
  for (const SurveySample& sample : result.survey) {
    EXPECT_LE((A * sample.truth.displacement).norm(), 1 + 1e-15);
    least_inward = std::min(least_inward, sample.truth.displacement.normalized().dot(inward));
  }
  EXPECT_GE(least_inward, -1e-12);
}

TEST_F(SamplingLimit, ReachIsThatOfTheShortestAxis) {
  EXPECT_NEAR(least_reach(Eigen::Matrix3d::Identity() / 0.3), 0.3, 1e-15);
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, -1).normalized()).matrix();
  const Eigen::Matrix3d A = turn * Eigen::Vector3d(2, 5, 4).asDiagonal() * turn.transpose();
  EXPECT_NEAR(least_reach(A), 0.2, 1e-15);
  EXPECT_FALSE(is_shortened(least_reach(Eigen::Matrix3d(turn / 0.6)), 0.6));
  EXPECT_TRUE(is_shortened(0.5999, 0.6));
}

// A push fails that even the smallest domain, of a quarter of max_displacement, contains.
TEST_F(SamplingLimit, AHopelessOneIsNotSampled) {
  block.scene.max_displacement = 8;
  const SiteResult result = sample().front();
  EXPECT_GE(result.out_of_reach, (1 - 1e-9) * 0.25 * 8);
  EXPECT_LE(result.out_of_reach, 8);
  EXPECT_EQ(result.polynomial.degree, 0);
  EXPECT_TRUE(result.survey.empty());
}

// The next cut of a failed push would go below a quarter of max_displacement: the domain ends at the quarter.
TEST_F(SamplingLimit, ABallIsCutDownToAQuarter) {
  const double reach = patch_reaches(block.scene, block.model, block.sites).front();
  block.scene.max_displacement = 3.2 * reach;
  const SiteResult result = sample().front();
  EXPECT_EQ(result.out_of_reach, 0);
  EXPECT_GE(least_reach(result.polynomial.to_unit), (1 - 1e-9) * 0.8 * reach);
  EXPECT_LE(least_reach(result.polynomial.to_unit), reach);
}

}  // namespace sampling_limits_test
}  // namespace palpate
