// The displacements at which the builder samples a site.
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
namespace sampling_points_test {

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

// The sequence does not depend on order of request or number of threads.
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
      threads.reserve(seen.size());
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

// Condition of least squares in orthonormal polynomials, with values and derivatives at the points.
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

// At every length the sequence determines all polynomials with half as many unknowns as equations, and does
// so better than random points.
TEST(SamplingPoints, DetermineAPolynomialWell) {
  constexpr double kCondition = 1000;  // loses three of sixteen digits
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
  // Means of 8000 numbers with standard deviation 0.6 or less: 0.007 at one sigma.
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
    EXPECT_NEAR(frame.trace(), 1 + 2 * axis.z(), 1e-14) << "not the smallest rotation";
  }
}

// Points on the boundary miss functions that no polynomial follows: later points cover the inside.
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

// As many distinct points as a target of 0.1 % may take of the ball, and more for the half ball.
TEST(SamplingPoints, ThereAreEnough) {
  for (const bool half : {false, true}) {
    const auto points = first_points(150, half);
    for (size_t i = 0; i < points.size(); ++i) {
      for (size_t j = 0; j < i; ++j) EXPECT_GT((points[i] - points[j]).norm(), 1e-3) << i << " " << j;
    }
  }
}

}  // namespace sampling_points_test
}  // namespace palpate
