// The samples of a site: one equilibrium for each displacement, with consistent derivatives.
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
namespace sampling_test {

using test::SamplingSite;

// The path from rest and the paths from neighbours lead to the same equilibrium.
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
  const std::vector<float> single(d.begin(), d.end());  // fields are stored in single precision
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
  // The remainder is quadratic: halving d halves the relative error.
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
  // Central differences with two steps and Richardson extrapolation: the error is of fourth order.
  constexpr double kStep = 4e-3;
  constexpr double kDifference = 1e-5;
  Eigen::Vector3d force;
  Eigen::Matrix3d stiffness;
  Eigen::MatrixXd tangent(middle.field.size(), 3);
  std::array<Eigen::MatrixXd, 3> curvature;  // for each axis: d field_tangent
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
  // d_i of the j-th derivative, for both orders of i and j: second derivatives are symmetric, differences
  // need not be.
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
  // Far enough from rest for a meaningful comparison.
  const SiteLinearResponse at_rest = linear_response(linear, site);
  EXPECT_GT((middle.stiffness - at_rest.stiffness).norm(), 0.05 * at_rest.stiffness.norm());
  EXPECT_GT(curved, 0.1 * middle.field_tangent.norm());
  EXPECT_GT(hardened, 0.1 * middle.stiffness.norm());
}

TEST_F(SamplingSite, EarlierSamplesDoNotMatter) {
  const Eigen::Vector3d d(0.05, 0.0, -0.1);
  SiteSampler alone(solver, block.sites, site, rest);
  const Sample expected = solved(alone, d);
  SiteSampler after(solver, block.sites, site, rest);
  for (const Eigen::Vector3d& other : {Eigen::Vector3d(0, 0.1, 0), Eigen::Vector3d(0.06, 0.02, -0.08)})
    solved(after, other);
  const Sample sample = solved(after, d);
  // Both solves converged to 1e-10, along different paths.
  EXPECT_LE((sample.field - expected.field).norm(), 1e-8 * expected.field.norm());
  EXPECT_LE((sample.force - expected.force).norm(), 1e-8 * expected.force.norm());

  // A new sampler gives the same bits, whatever the state of its solver.
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

}  // namespace sampling_test
}  // namespace palpate
