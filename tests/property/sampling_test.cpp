// Where a site is sampled, and what the samples must satisfy among themselves.
#include "offline/precompute/sampling.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "offline/precompute/ball_polynomials.hpp"
#include "offline/precompute/hermite_design.hpp"
#include "offline/precompute/site_survey.hpp"
#include "schemas/monomials.hpp"
#include "tests/support/sampling_site.hpp"

namespace palpate {
namespace {

using test::BlockShape;
using test::nodes_on_plane;
using test::SamplingSite;
using test::tetrahedral_block;
using test::touched_block;
using test::TouchedBlock;
using test::with_fixed_base;

std::vector<Eigen::Vector3d> first_points(size_t count, bool half) {
  SamplePoints points(half);
  std::vector<Eigen::Vector3d> result;
  for (size_t i = 0; i < count; ++i) result.push_back(points[i]);
  return result;
}

TEST(SamplingPoints, AreAFunctionOfTheRequest) {
  for (const bool half : {false, true}) {
    EXPECT_EQ(choose_survey_points(20, half, 7), choose_survey_points(20, half, 7));
    EXPECT_NE(choose_survey_points(20, half, 7), choose_survey_points(20, half, 8));
  }
}

// One sequence, in whatever order and by however many threads it is asked for.
TEST(SamplingPoints, AreOneSequence) {
  constexpr size_t kCount = 24;
  for (const bool half : {false, true}) {
    const std::vector<Eigen::Vector3d> expected = first_points(kCount, half);
    SamplePoints backwards(half);
    for (size_t i = kCount; i-- > 0;) EXPECT_EQ(backwards[i], expected[i]);
    SamplePoints shared(half);
    std::array<std::vector<Eigen::Vector3d>, 4> seen;
    {
      std::vector<std::jthread> threads;
      for (std::vector<Eigen::Vector3d>& of_thread : seen) {
        threads.emplace_back([&] {
          for (size_t i = 0; i < kCount; ++i) of_thread.push_back(shared[i]);
        });
      }
    }
    for (const std::vector<Eigen::Vector3d>& of_thread : seen) EXPECT_EQ(of_thread, expected);
  }
}

TEST(SamplingPoints, LieInTheBallAndReachItsEdge) {
  constexpr double kEdge = 1 + 1e-15;
  for (const bool half : {false, true}) {
    const auto points = first_points(60, half);
    for (const size_t count : {6, 12, 60}) {
      double farthest = 0;
      double lowest = 1;
      for (size_t i = 0; i < count; ++i) {
        EXPECT_LE(points[i].norm(), kEdge);
        farthest = std::max(farthest, points[i].norm());
        lowest = std::min(lowest, points[i].z());
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
  for (const bool half : {false, true}) {
    const auto points = first_points(60, half);
    for (size_t i = 0; i < points.size(); ++i) {
      for (size_t j = 0; j < i; ++j) EXPECT_GE((points[i] - points[j]).norm(), 0.2) << i << " " << j;
    }
  }
}

// Of least squares in orthonormal polynomials of the degree, known at the points as samples are.
double condition_of(const std::vector<Eigen::Vector3d>& points, size_t count, int degree, bool half) {
  const Eigen::MatrixXd to_orthonormal = orthonormal_on_ball(2, degree, half);
  Eigen::MatrixXd design(kEquationsPerSample * static_cast<Eigen::Index>(count), to_orthonormal.cols());
  for (size_t i = 0; i < count; ++i) {
    Eigen::MatrixXd rows = hermite_rows(points[i], 2, degree, 2);
    rows.middleRows<3>(1) *= derivative_weight(degree, 1);
    rows.middleRows<6>(4) *= derivative_weight(degree, 2);
    design.middleRows<kEquationsPerSample>(kEquationsPerSample * static_cast<Eigen::Index>(i)) =
        rows * to_orthonormal;
  }
  const Eigen::VectorXd sizes = design.jacobiSvd().singularValues();
  return sizes[0] / sizes[sizes.size() - 1];
}

// At every length the sequence determines the polynomials that it has twice the equations for, and better than points
// anywhere in the ball do.
TEST(SamplingPoints, DetermineAPolynomialWell) {
  constexpr double kCondition = 1000;  // of sixteen digits three; 20 as a rule
  for (const bool half : {false, true}) {
    const auto points = first_points(60, half);
    const auto anywhere = choose_survey_points(60, half, 5);
    for (int degree = 3; degree <= highest_fit_degree(half); ++degree) {
      const auto terms = static_cast<size_t>(pack::num_monomials(2, static_cast<std::uint32_t>(degree)));
      for (size_t count = 2 * terms / kEquationsPerSample + 1; count <= points.size(); count += 9) {
        SCOPED_TRACE(testing::Message() << degree << " " << count << (half ? " half" : ""));
        const double condition = condition_of(points, count, degree, half);
        EXPECT_LE(condition, kCondition);
        EXPECT_LT(condition, condition_of(anywhere, count, degree, half));
      }
    }
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

// What no polynomial of a degree follows is between the points of the boundary: the inside is covered, too.
TEST(SamplingPoints, LaterOnesCoverTheInside) {
  for (const bool half : {false, true}) {
    SamplePoints points(half);
    double farthest = 0;
    for (const Eigen::Vector3d& x : choose_survey_points(2000, half, 1)) {
      if (x.norm() > 0.9) continue;
      double nearest = x.norm();  // rest is known
      for (size_t i = 0; i < 60; ++i) nearest = std::min(nearest, (points[i] - x).norm());
      farthest = std::max(farthest, nearest);
    }
    EXPECT_LE(farthest, half ? 0.38 : 0.47);
  }
}

// As many as a target of 0.1 % may take of the ball, and more in the half; no two the same.
TEST(SamplingPoints, ThereAreEnough) {
  for (const bool half : {false, true}) {
    const auto points = first_points(150, half);
    for (size_t i = 0; i < points.size(); ++i) {
      for (size_t j = 0; j < i; ++j) EXPECT_GT((points[i] - points[j]).norm(), 1e-3) << i << " " << j;
    }
  }
}

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
  const std::vector<float> single(d.begin(), d.end());  // as fields are kept
  ASSERT_GE(site.patch.size(), 5U);
  for (const int member : site.patch) {
    const int packed = block.sites.contact_nodes[static_cast<size_t>(member)];
    for (int axis = 0; axis < 3; ++axis)
      EXPECT_EQ(sample.field[3 * packed + axis], static_cast<double>(single[static_cast<size_t>(axis)]));
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

TEST_F(SamplingSite, EveryDerivativeIsThatOfTheOneBefore) {
  SiteSampler sampler(solver, block.sites, site, rest);
  const Eigen::Vector3d d(0.04, 0.03, -0.11);
  const Sample middle = solved(sampler, d);
  // Central differences with two steps, taken to step zero (Richardson): what is left is of fourth order.
  constexpr double kStep = 4e-3;
  constexpr double kDifference = 1e-5;
  Eigen::Vector3d force;
  Eigen::Matrix3d stiffness;
  Eigen::MatrixXd tangent(middle.field.size(), 3);
  std::array<Eigen::MatrixXd, 3> curvature;  // of each axis: d field_tangent
  std::array<Eigen::Matrix3d, 3> hardening;  // d stiffness
  for (int axis = 0; axis < 3; ++axis) {
    const auto slope = [&](double step) {
      const Sample ahead = solved(sampler, d + step * Eigen::Vector3d::Unit(axis));
      const Sample behind = solved(sampler, d - step * Eigen::Vector3d::Unit(axis));
      Sample result;
      result.energy = (ahead.energy - behind.energy) / (2 * step);
      result.force = (ahead.force - behind.force) / (2 * step);
      result.stiffness = (ahead.stiffness - behind.stiffness) / (2 * step);
      result.field = (ahead.field - behind.field) / (2 * step);
      result.field_tangent = (ahead.field_tangent - behind.field_tangent) / (2 * step);
      return result;
    };
    const Sample coarse = slope(kStep);
    const Sample fine = slope(0.5 * kStep);
    force[axis] = (4 * fine.energy - coarse.energy) / 3;
    stiffness.col(axis) = (4 * fine.force - coarse.force) / 3;
    tangent.col(axis) = (4 * fine.field - coarse.field) / 3;
    curvature[static_cast<size_t>(axis)] = (4 * fine.field_tangent - coarse.field_tangent) / 3;
    hardening[static_cast<size_t>(axis)] = (4 * fine.stiffness - coarse.stiffness) / 3;
  }
  EXPECT_LE((middle.force - force).norm(), kDifference * force.norm());
  EXPECT_LE((middle.stiffness - stiffness).norm(), kDifference * stiffness.norm());
  EXPECT_LE((middle.field_tangent - tangent).norm(), kDifference * tangent.norm());

  ASSERT_EQ(middle.field_curvature.rows(), middle.field.size());
  ASSERT_EQ(middle.field_curvature.cols(), 6);
  const double curved = middle.field_curvature.norm();
  const double hardened = middle.hardening.norm();
  // d_i of the j-th, with i and j in both orders: second derivatives are symmetric, which differences do not know.
  Eigen::Index second = 0;
  Eigen::Index third = 0;
  for (int i = 0; i < 3; ++i) {
    for (int j = i; j < 3; ++j, ++second) {
      for (const auto& [by, of] : {std::pair(i, j), std::pair(j, i)}) {
        EXPECT_LE((middle.field_curvature.col(second) - curvature[static_cast<size_t>(by)].col(of)).norm(),
                  kDifference * curved)
            << by << of;
      }
      for (int k = j; k < 3; ++k, ++third) {
        EXPECT_NEAR(middle.hardening[third], hardening[static_cast<size_t>(i)](j, k), kDifference * hardened);
        EXPECT_NEAR(middle.hardening[third], hardening[static_cast<size_t>(k)](i, j), kDifference * hardened);
      }
    }
  }
  // Far enough from rest to mean something.
  const SiteLinearResponse at_rest = linear_response(linear, site);
  EXPECT_GT((middle.stiffness - at_rest.stiffness).norm(), 0.05 * at_rest.stiffness.norm());
  EXPECT_GT(curved, 0.1 * middle.field_tangent.norm());
  EXPECT_GT(hardened, 0.1 * middle.stiffness.norm());
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
  plan.least_samples = 6;
  plan.most_samples = 8;
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
    EXPECT_FALSE(is_shortened(least_reach(one.polynomial.to_unit), block.scene.max_displacement));
    EXPECT_GE(one.samples, plan.least_samples);
    EXPECT_LE(one.samples, plan.most_samples);
    EXPECT_LT(one.min_jacobian, 1);
    for (const SurveySample& sample : one.survey) {
      EXPECT_EQ(sample.site, site_index);
      EXPECT_LT(sample.truth.displacement.z(), 0) << "inward is down";
    }
    for (size_t jobs = 1; jobs < 3; ++jobs) {
      const SiteResult& other = results[jobs][site_index];
      EXPECT_EQ(one.polynomial.to_unit, other.polynomial.to_unit);
      EXPECT_EQ(one.polynomial.degree, other.polynomial.degree);
      EXPECT_EQ(one.polynomial.linear, other.polynomial.linear);
      EXPECT_EQ(one.polynomial.basis, other.polynomial.basis);
      EXPECT_EQ(one.polynomial.coefficients, other.polynomial.coefficients);
      EXPECT_EQ(one.polynomial.energy, other.polynomial.energy);
      EXPECT_EQ(one.polynomial.basis_error, other.polynomial.basis_error);
      EXPECT_EQ(one.samples, other.samples);
      EXPECT_EQ(one.held_out_error, other.held_out_error);
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

// A slender column whose top edge is pushed down: it buckles to either side, so that many a push has two equilibria.
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
    // Both nodes of the middle edge as one: it may turn about itself.
    site = sites.sites.front();
    site.patch.push_back(sites.sites.back().patch.front());
    site.patch_nodes.push_back(sites.sites.back().patch_nodes.front());
  }

  Model model;
  ContactSites sites;
  ContactSite site;
  RestState rest;
};

// A single step from rest may end on either branch; what ends on the other one is no sample.
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
  // Energy of a stable state that is reached in one step along the tangent; none where there is no such state.
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
  const Eigen::Matrix3d& A = result.polynomial.to_unit;
  EXPECT_TRUE(is_shortened(least_reach(A), 0.6));
  EXPECT_GE(least_reach(A), 0.25 * 0.6);
  EXPECT_GT(result.min_jacobian, 0);
  EXPECT_FALSE(result.survey.empty());
  for (const SurveySample& sample : result.survey)
    EXPECT_LE((A * sample.truth.displacement).norm(), 1 + 1e-15);
}

// The same on a block three times as wide: only down is too far, and only there the domain is cut.
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
  // The survey is of that ellipsoid, of its inward half.
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
