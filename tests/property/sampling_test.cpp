// Where a site is sampled, and what the samples must satisfy among themselves.
#include "offline/precompute/sampling.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "offline/precompute/site_survey.hpp"
#include "tests/support/touched_block.hpp"

namespace palpate {
namespace {

using test::touched_block;
using test::TouchedBlock;

TEST(SamplingPoints, AreAFunctionOfTheRequest) {
  for (const bool half : {false, true}) {
    const auto once = choose_sample_points(4, 12, half);
    EXPECT_EQ(once, choose_sample_points(4, 12, half));
    EXPECT_EQ(choose_survey_points(20, half, 7), choose_survey_points(20, half, 7));
    EXPECT_NE(choose_survey_points(20, half, 7), choose_survey_points(20, half, 8));
  }
}

TEST(SamplingPoints, LieInTheBallAndReachItsEdge) {
  constexpr double kEdge = 1 + 1e-15;
  for (const bool half : {false, true}) {
    for (const int count : {6, 12, 40}) {
      const auto points = choose_sample_points(4, count, half);
      ASSERT_EQ(points.size(), static_cast<size_t>(count));
      double farthest = 0;
      double lowest = 1;
      for (const Eigen::Vector3d& point : points) {
        EXPECT_LE(point.norm(), kEdge);
        farthest = std::max(farthest, point.norm());
        lowest = std::min(lowest, point.z());
      }
      EXPECT_GT(farthest, 0.99);
      if (half) {
        EXPECT_GE(lowest, 0);
      } else {
        EXPECT_LT(lowest, -0.3) << "both halves";
      }
    }
    for (const Eigen::Vector3d& point : choose_survey_points(500, half, 3)) {
      EXPECT_LE(point.norm(), kEdge);
      EXPECT_GT(point.norm(), 0);
      if (half) {
        EXPECT_GE(point.z(), 0);
      }
    }
  }
}

TEST(SamplingPoints, AreDistinct) {
  const auto points = choose_sample_points(4, 12, false);
  for (size_t i = 0; i < points.size(); ++i) {
    for (size_t j = 0; j < i; ++j) EXPECT_GT((points[i] - points[j]).norm(), 0.1) << i << " " << j;
  }
}

TEST(SamplingPoints, SurveyIsUniformInEveryQuarter) {
  constexpr int kCount = 8000;
  // Means of 8000 numbers of standard deviation 0.6 and less: 0.007 at one sigma.
  constexpr double kMean = 0.03;
  for (const bool half : {false, true}) {
    const auto points = choose_survey_points(kCount, half, 99);
    std::array<int, 4> in_quarter{};
    std::array<double, 4> mean_place{};
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
    for (size_t i = 0; i < points.size(); ++i) {
      const double radius = points[i].norm();
      const auto quarter = static_cast<size_t>(3 - i % 4);  // the largest first
      EXPECT_GT(radius, 0.25 * static_cast<double>(quarter) * (1 - 1e-15));
      EXPECT_LE(radius, 0.25 * static_cast<double>(quarter + 1) * (1 + 1e-15));
      ++in_quarter[quarter];
      mean_place[quarter] += 4 * radius - static_cast<double>(quarter);
      mean += points[i] / radius / kCount;
      spread += points[i] * points[i].transpose() / (radius * radius) / kCount;
    }
    for (size_t quarter = 0; quarter < 4; ++quarter) {
      EXPECT_EQ(in_quarter[quarter], kCount / 4);
      EXPECT_NEAR(mean_place[quarter] / (kCount / 4.0), 0.5, kMean);
    }
    EXPECT_LE((mean - Eigen::Vector3d(0, 0, half ? 0.5 : 0)).norm(), kMean);
    EXPECT_LE((spread - Eigen::Matrix3d::Identity() / 3).norm(), kMean);
  }
}

TEST(SamplingPoints, FrameTurnsTheHalfBall) {
  for (const Eigen::Vector3d& axis : {Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(0, 0, -1),
                                      Eigen::Vector3d(0.6, 0, -0.8), Eigen::Vector3d(1, 2, 3).normalized()}) {
    const Eigen::Matrix3d frame = frame_about(axis);
    EXPECT_LE((frame.col(2) - axis).norm(), 1e-14);
    EXPECT_LE((frame.transpose() * frame - Eigen::Matrix3d::Identity()).norm(), 1e-14);
    EXPECT_NEAR(frame.determinant(), 1, 1e-14);
  }
}

struct SamplingSite : ::testing::Test {
  TouchedBlock block = touched_block(4, 0.26);
  Assembly assembly{block.model, block.model.fixed_dofs()};
  StaticSolver solver{assembly};
  const ContactSite& site = block.sites.sites[4];  // of nine: in the middle
  LinearDd linear = compute_linear_dd(assembly, block.sites);
  const RestState rest;

  static Sample solved(SiteSampler& sampler, const Eigen::Vector3d& d) {
    Sample sample;
    EXPECT_TRUE(sampler.solve(d, sample));
    EXPECT_EQ(sample.displacement, d);
    return sample;
  }
};

// The path from rest and the neighbours lead to the one equilibrium that there is.
TEST_F(SamplingSite, FromRestAndFromANeighbourItIsTheSame) {
  SiteSampler sampler(solver, block.sites, site, rest);
  const Eigen::Vector3d d(0.03, -0.05, -0.1);
  solved(sampler, 0.8 * d);
  const Sample expected = solved(sampler, d);
  for (const int increments : {1, 2, 5}) {
    Sample sample;
    ASSERT_TRUE(sampler.solve_from_rest(d, increments, sample));
    EXPECT_EQ(sample.displacement, d);
    EXPECT_LE((sample.field - expected.field).norm(), 1e-8 * expected.field.norm()) << increments;
    EXPECT_LE((sample.force - expected.force).norm(), 1e-8 * expected.force.norm());
    EXPECT_NEAR(sample.energy, expected.energy, 1e-8 * expected.energy);
  }
}

TEST_F(SamplingSite, PatchMovesAsOne) {
  SiteSampler sampler(solver, block.sites, site, rest);
  const Eigen::Vector3d d(0.03, -0.05, -0.1);
  const Sample sample = solved(sampler, d);
  ASSERT_GE(site.patch.size(), 5U);
  for (const int member : site.patch) {
    const int packed = block.sites.contact_nodes[static_cast<size_t>(member)];
    EXPECT_EQ(sample.field.segment<3>(3 * packed), d);
    EXPECT_EQ(sample.field_tangent.middleRows<3>(3 * packed), Eigen::Matrix3d::Identity());
  }
  for (const PrescribedDisplacement& fixed : block.model.fixed) {
    for (size_t packed = 0; packed < block.sites.packed_nodes.size(); ++packed) {
      if (block.sites.packed_nodes[packed] != fixed.node) continue;
      EXPECT_EQ(sample.field[static_cast<Eigen::Index>(3 * packed) + fixed.axis], 0.0);
    }
  }
  EXPECT_EQ(sampler.counts().solves, 1);
  EXPECT_GT(sampler.counts().iterations, 0);
}

TEST_F(SamplingSite, SmallDisplacementsAreLinear) {
  SiteSampler sampler(solver, block.sites, site, rest);
  const SiteLinearResponse response = linear_response(linear, site);
  const Eigen::Vector3d direction = Eigen::Vector3d(1, -2, -3).normalized();
  std::array<double, 3> field_errors{};
  std::array<double, 3> force_errors{};
  for (size_t i = 0; i < 3; ++i) {
    const Eigen::Vector3d d = 4e-3 * std::pow(0.5, i) * direction;
    const Sample sample = solved(sampler, d);
    field_errors[i] = (sample.field - response.field * d).norm() / d.norm();
    force_errors[i] = (sample.force - response.stiffness * d).norm() / d.norm();
    EXPECT_GT(sample.force.dot(d), 0);
    EXPECT_NEAR(sample.energy, 0.5 * d.dot(response.stiffness * d), 0.05 * sample.energy);
  }
  // What is left is quadratic: halving d halves the relative error.
  for (size_t i = 1; i < 3; ++i) {
    EXPECT_NEAR(field_errors[i - 1] / field_errors[i], 2.0, 0.1);
    EXPECT_NEAR(force_errors[i - 1] / force_errors[i], 2.0, 0.1);
  }
  EXPECT_LE(field_errors[2], 0.05);
}

TEST_F(SamplingSite, EnergyForceStiffnessAndTangentBelongTogether) {
  SiteSampler sampler(solver, block.sites, site, rest);
  const Eigen::Vector3d d(0.04, 0.03, -0.11);
  const Sample middle = solved(sampler, d);
  // Central differences with two steps, taken to step zero (Richardson): what is left is of fourth order.
  constexpr double kStep = 4e-3;
  constexpr double kDifference = 1e-5;
  Eigen::Vector3d force;
  Eigen::Matrix3d stiffness;
  Eigen::MatrixXd tangent(middle.field.size(), 3);
  for (int axis = 0; axis < 3; ++axis) {
    const auto slope = [&](double step) {
      const Sample ahead = solved(sampler, d + step * Eigen::Vector3d::Unit(axis));
      const Sample behind = solved(sampler, d - step * Eigen::Vector3d::Unit(axis));
      Sample result;
      result.energy = (ahead.energy - behind.energy) / (2 * step);
      result.force = (ahead.force - behind.force) / (2 * step);
      result.field = (ahead.field - behind.field) / (2 * step);
      return result;
    };
    const Sample coarse = slope(kStep);
    const Sample fine = slope(0.5 * kStep);
    force[axis] = (4 * fine.energy - coarse.energy) / 3;
    stiffness.col(axis) = (4 * fine.force - coarse.force) / 3;
    tangent.col(axis) = (4 * fine.field - coarse.field) / 3;
  }
  EXPECT_LE((middle.force - force).norm(), kDifference * force.norm());
  EXPECT_LE((middle.stiffness - stiffness).norm(), kDifference * stiffness.norm());
  EXPECT_LE((middle.field_tangent - tangent).norm(), kDifference * tangent.norm());
  // Far enough from rest to mean something.
  const SiteLinearResponse at_rest = linear_response(linear, site);
  EXPECT_GT((middle.stiffness - at_rest.stiffness).norm(), 0.05 * at_rest.stiffness.norm());
}

TEST_F(SamplingSite, WhatWasSampledBeforeDoesNotMatter) {
  const Eigen::Vector3d d(0.05, 0.0, -0.1);
  SiteSampler alone(solver, block.sites, site, rest);
  const Sample expected = solved(alone, d);
  SiteSampler after(solver, block.sites, site, rest);
  for (const Eigen::Vector3d& other : {Eigen::Vector3d(0, 0.1, 0), Eigen::Vector3d(0.06, 0.02, -0.08)})
    solved(after, other);
  const Sample sample = solved(after, d);
  // Both converged to 1e-10 along different paths.
  EXPECT_LE((sample.field - expected.field).norm(), 1e-8 * expected.field.norm());
  EXPECT_LE((sample.force - expected.force).norm(), 1e-8 * expected.force.norm());

  // A sampler that begins anew gives the same bits, whatever its solver did.
  SiteSampler again(solver, block.sites, site, rest);
  const Sample repeated = solved(again, d);
  EXPECT_EQ(repeated.field, expected.field);
  EXPECT_EQ(repeated.force, expected.force);
  EXPECT_EQ(repeated.energy, expected.energy);
}

TEST_F(SamplingSite, ScheduleDoesNotChangeABit) {
  SamplingPlan plan;
  plan.degree = 2;
  plan.samples = 6;
  plan.survey_samples = 4;
  block.scene.directions = Directions::inward;
  std::array<std::vector<SiteResult>, 3> results;
  for (int jobs = 1; jobs <= 3; ++jobs) {
    plan.jobs = jobs;
    int calls = 0;
    results[static_cast<size_t>(jobs - 1)] =
        sample_sites(assembly, block.scene, block.sites, linear, plan, [&](int done, int total) {
          EXPECT_EQ(done, ++calls);
          EXPECT_EQ(total, 9);
        });
    EXPECT_EQ(calls, 9);
  }
  for (size_t site_index = 0; site_index < 9; ++site_index) {
    const SiteResult& one = results[0][site_index];
    ASSERT_EQ(one.survey.size(), 4U);
    EXPECT_EQ(one.polynomial.radius, block.scene.max_displacement);
    EXPECT_LT(one.min_jacobian, 1);
    for (const SurveySample& sample : one.survey) {
      EXPECT_EQ(sample.site, site_index);
      EXPECT_LT(sample.truth.displacement.z(), 0) << "inward is down";
    }
    for (size_t jobs = 1; jobs < 3; ++jobs) {
      const SiteResult& other = results[jobs][site_index];
      EXPECT_EQ(one.polynomial.field, other.polynomial.field);
      EXPECT_EQ(one.polynomial.energy, other.polynomial.energy);
      EXPECT_EQ(one.polynomial.radius, other.polynomial.radius);
      EXPECT_EQ(one.min_jacobian, other.min_jacobian);
      EXPECT_EQ(one.counts.iterations, other.counts.iterations);
      EXPECT_EQ(one.counts.factorizations, other.counts.factorizations);
      ASSERT_EQ(other.survey.size(), one.survey.size());
      for (size_t i = 0; i < one.survey.size(); ++i) {
        EXPECT_EQ(one.survey[i].truth.displacement, other.survey[i].truth.displacement);
        EXPECT_EQ(one.survey[i].truth.field, other.survey[i].truth.field);
        EXPECT_EQ(one.survey[i].truth.force, other.survey[i].truth.force);
      }
    }
  }
}

// All nodes fixed but one site: its elements are flat when it has gone down by their height, 1/2.
struct SamplingLimit : ::testing::Test {
  SamplingLimit() {
    block.model.fixed.clear();
    const int only = block.scene.sites.front();
    for (int node = 0; node < block.model.num_nodes(); ++node) {
      if (node == only) continue;
      for (int axis = 0; axis < 3; ++axis) block.model.fixed.push_back({node, axis, 0.0});
    }
    block.scene.directions = Directions::inward;
    plan.samples = 8;
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
  EXPECT_TRUE(sampler.solve({0, 0, -0.2}, sample));
  EXPECT_FALSE(sampler.solve({0, 0, -0.6}, sample));
  EXPECT_TRUE(sampler.solve({0, 0, -0.25}, sample)) << "a failure must not stick";
}

// A survey counts what it could not measure as wholly wrong, in its bin and over all.
TEST_F(SamplingLimit, UnsolvedPushesAreErrors) {
  block.scene.max_displacement = 0.6;
  block.scene.polynomial = false;  // no fit, whose ball would shrink
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
  EXPECT_LT(result.polynomial.radius, 0.6);
  EXPECT_GE(result.polynomial.radius, 0.25 * 0.6);
  EXPECT_GT(result.min_jacobian, 0);
  EXPECT_FALSE(result.survey.empty());
  for (const SurveySample& sample : result.survey)
    EXPECT_LE(sample.truth.displacement.norm(), result.polynomial.radius * (1 + 1e-15));
}

TEST_F(SamplingLimit, AHopelessOneNamesTheNode) {
  block.scene.max_displacement = 8;
  try {
    sample();
    FAIL() << "a push through sixteen elements was answered";
  } catch (const std::runtime_error& error) {
    const std::string label =
        std::to_string(block.model.labels[static_cast<size_t>(block.scene.sites.front())]);
    EXPECT_NE(std::string(error.what()).find("node " + label + ","), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace palpate
