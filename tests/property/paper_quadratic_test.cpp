// The paper's quadratic: its sampling points, and its fit.
#include "offline/precompute/paper_quadratic.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <vector>

#include "offline/precompute/hermite_design.hpp"
#include "tests/support/tetrahedral_block.hpp"

namespace palpate {
namespace paper_quadratic_test {

using test::TestRandom;

constexpr Eigen::Index kRows = 12;
constexpr double kRounding = 1e-12;

// Samples of a field of degree 2 and an energy of degree 3 in x = A d: values and forces, no derivatives.
struct Quadratic {
  Eigen::MatrixXd field = TestRandom(71).matrix(kRows, 9);
  Eigen::VectorXd energy = TestRandom(72).vector(16);

  SiteSamples samples(const std::vector<Eigen::Vector3d>& points) const {
    SiteSamples result;
    result.to_unit << 2, 0.3, 0, -0.1, 3, 0.2, 0, 0.4, 4;
    result.linear.field = Eigen::MatrixXd::Zero(kRows, 3);
    result.linear.stiffness.setZero();
    for (const Eigen::Vector3d& x : points) {
      Sample sample;
      sample.displacement = result.to_unit.inverse() * x;
      sample.field = field * hermite_rows(x, 1, 2, 0).transpose();
      const Eigen::VectorXd energies = hermite_rows(x, 2, 3, 1) * energy;
      sample.energy = energies[0];
      sample.force = result.to_unit.transpose() * energies.tail<3>();
      result.samples.push_back(sample);
    }
    return result;
  }
};

TEST(PaperQuadratic, GridPointsAreThoseOfACubeInTheBall) {
  for (const bool half : {false, true}) {
    const std::vector<Eigen::Vector3d> points = grid_points(half);
    // |x|^2 = 1/4, 1/2, 3/4 and 1 have 6, 12, 8 and 6 points; 12 of these points have z = 0.
    EXPECT_EQ(points.size(), half ? 22U : 32U);
    for (const Eigen::Vector3d& x : points) {
      EXPECT_LE(x.norm(), 1);
      EXPECT_GE(x.norm(), 0.5);
      EXPECT_TRUE(!half || x.z() >= 0);
      EXPECT_EQ(Eigen::Vector3d(2 * x), Eigen::Vector3d((2 * x).array().round()));
    }
  }
}

TEST(PaperQuadratic, RayPointsGrowToItsEnd) {
  const Eigen::Vector3d end(0.1, -0.4, 0.8);
  const std::vector<Eigen::Vector3d> points = ray_points(end);
  ASSERT_EQ(points.size(), 10U);
  for (size_t i = 0; i < 10; ++i)
    EXPECT_LE((points[i] - end * (static_cast<double>(i) + 1) / 10).norm(), kRounding);
}

TEST(PaperQuadratic, GivesBackAQuadraticSampledOnTheGrid) {
  const Quadratic truth;
  for (const bool half : {false, true}) {
    const SiteSamples samples = truth.samples(grid_points(half));
    const SitePolynomial fit = fit_paper_quadratic(samples);
    EXPECT_EQ(fit.to_unit, samples.to_unit);
    EXPECT_EQ(fit.degree, 2);
    EXPECT_LE((fit.linear - truth.field.leftCols<3>()).cwiseAbs().maxCoeff(), kRounding);
    EXPECT_LE((fit.basis * fit.coefficients.transpose() - truth.field.rightCols<6>()).cwiseAbs().maxCoeff(),
              kRounding);
    EXPECT_LE((fit.energy - truth.energy).cwiseAbs().maxCoeff(), kRounding);
  }
}

// On a ray the fit matches the samples, and no other matching polynomial is smaller.
TEST(PaperQuadratic, OnARayItIsTheSmallestThatFits) {
  const Quadratic truth;
  const Eigen::Vector3d end(0.3, -0.5, 0.8);
  const SiteSamples samples = truth.samples(ray_points(end));
  const SitePolynomial fit = fit_paper_quadratic(samples);
  for (const Sample& sample : samples.samples)
    EXPECT_LE((field_at(fit, sample.displacement) - sample.field).norm(), kRounding);
  Eigen::MatrixXd coefficients(kRows, 9);
  coefficients << fit.linear, fit.basis * fit.coefficients.transpose();
  EXPECT_LT(coefficients.norm(), 0.9 * truth.field.norm());
  // The smallest fit has no part that vanishes on the ray.
  Eigen::MatrixXd on_ray(10, 9);
  for (Eigen::Index i = 0; i < 10; ++i) on_ray.row(i) = hermite_rows(end * (i + 1) / 10, 1, 2, 0);
  const Eigen::MatrixXd vanishing = on_ray.fullPivLu().kernel();
  ASSERT_EQ(vanishing.cols(), 7);
  EXPECT_LE((coefficients * vanishing).cwiseAbs().maxCoeff(), kRounding);
}

}  // namespace paper_quadratic_test
}  // namespace palpate
