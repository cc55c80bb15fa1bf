// An arch and a strip followed past their limit points, compared with rod theory.
#include <gtest/gtest.h>

#include "tests/support/limit_points_fixture.hpp"

namespace palpate::limit_points_fixture {
namespace limit_point_structures_test {

using test::Arch;
using test::ArchRod;
using test::Strip;

// A clamped arch two and four times as high as thick. The rod has no shear: the difference is its size, and
// half in the thinner arch.
TEST_P(LimitPointsBy, AShallowArchIsARod) {
  for (const double thickness : {0.5, 0.25}) {
    SCOPED_TRACE(thickness);
    const double shear = 0.014 * thickness;
    Arch arch;
    arch.thickness = thickness;
    const double rise = arch.radius * (1 - std::cos(arch.half_angle));
    ArchRod rod(arch);
    std::vector<double> force;  // at every thousandth of the rise
    for (int i = 0; i <= 1300; ++i) force.push_back(rod.force(1e-3 * i * rise));
    const double most = *std::max_element(force.begin(), force.begin() + 1000);
    const double least = *std::min_element(force.begin() + 700, force.end());

    PathScene scene = arch.scene(static_cast<int>(20 / thickness));
    scene.load.force *= most;
    ArcLengthSettings settings;
    settings.stepping = GetParam();
    settings.first_increment = 0.1;
    settings.largest_increment = 0.4;
    settings.end_displacement = {scene.dof(), -1.29 * rise};
    const PathRun run = follow_path(scene, settings);
    ASSERT_TRUE(run.report.converged);
    for (size_t i = 0; i < run.points.size(); ++i) {
      const double place = -run.moved(i, scene.dof()) / rise * 1000;
      const size_t at = static_cast<size_t>(std::clamp(place, 0.0, 1299.0));
      const double part = place - static_cast<double>(at);
      const double expected = (force[at] + part * (force[at + 1] - force[at])) / most;
      EXPECT_NEAR(run.points[i].load_factor, expected, shear) << place;
    }
    const std::vector<double> limits = limit_load_factors(run.points);
    ASSERT_EQ(limits.size(), 2U);
    EXPECT_NEAR(limits[0], 1, shear);
    EXPECT_NEAR(limits[1], least / most, shear);
  }
}

// A follower pressure on the top, with a tangent that is not symmetric.
TEST_P(LimitPointsBy, AnArchSnapsUnderPressure) {
  const Arch arch;
  PathScene scene = arch.scene();
  scene.load.force.setZero();
  for (size_t element = 0; element < scene.model.elements.size(); ++element) {
    for (int face = 0; face < 4; ++face) {
      const std::array<int, 6> nodes = outward_face(scene.model.elements[element], face);
      const bool on_top = std::ranges::all_of(nodes, [&](int node) {
        return scene.model.positions[static_cast<size_t>(node)].norm() >
               arch.radius + 0.5 * arch.thickness - 1e-6;
      });
      if (on_top) scene.load.pressures[{static_cast<int>(element), face}] = 1e-4;
    }
  }
  ASSERT_EQ(scene.load.pressures.size(), 40U);
  ArcLengthSettings settings;
  settings.stepping = GetParam();
  settings.first_increment = 0.1;
  settings.end_displacement = {scene.dof(), -1.5};
  const PathRun run = follow_path(scene, settings);
  ASSERT_TRUE(run.report.converged);
  double most = 0;
  for (const PathPoint& point : run.points) most = std::max(most, point.load_factor);
  EXPECT_GE(limit_load_factors(run.points).size(), 1U);
  const double scale = most * 1e-4 * arch.length() * arch.width;
  for (size_t i = 0; i < run.points.size(); ++i)
    EXPECT_LE(imbalance(scene, times(scene.load, run.points[i].load_factor), run.states[i], scale), 1e-8);
}

// Thickness to length 1 : 100: the elastica's error is of the square of the ratio.
TEST_P(LimitPointsBy, AThinStripBucklesAsTheElastica) {
  constexpr double kEuler = std::numbers::pi * std::numbers::pi / 4;
  const Strip strip;
  const PathScene scene = strip.scene(2 * kEuler, 40);
  ArcLengthSettings settings;
  settings.stepping = GetParam();
  settings.first_increment = 0.05;
  settings.end_load_factor = 1;
  settings.max_increments = 150;  // current_stiffness takes most of them, as the stiffness falls by 1e4
  const PathRun run = follow_path(scene, settings);
  ASSERT_TRUE(run.report.converged);
  EXPECT_EQ(run.report.load_factor, 1);
  std::vector<double> deflection;
  std::vector<double> compliance;  // deflection over force
  for (size_t i = 1; i < run.points.size(); ++i) {
    const double force = 2 * kEuler * run.points[i].load_factor;
    SCOPED_TRACE(testing::Message() << "force over Euler's " << force / kEuler);
    const test::ElasticaTip expected = test::elastica({-force, strip.aside * force}, 0, std::numbers::pi);
    const Eigen::Vector3d tip = run.states[i].segment<3>(3 * scene.node) / strip.length;
    EXPECT_NEAR(1 + tip.x(), expected.x, 0.001);
    EXPECT_NEAR(tip.z(), expected.y, 0.001);
    EXPECT_EQ(run.points[i].negative_pivots, 0);
    if (force > 0.5 * kEuler && force < 0.92 * kEuler) {
      deflection.push_back(tip.z());
      compliance.push_back(tip.z() / force);
    }
  }
  // Southwell 1932: w = w0 F / (F_E - F), so w / F = (w + w0) / F_E.
  ASSERT_GE(deflection.size(), 5U);
  const double slope = (compliance.back() - compliance.front()) / (deflection.back() - deflection.front());
  EXPECT_NEAR(1 / slope, kEuler, 0.01 * kEuler);
}

}  // namespace limit_point_structures_test
}  // namespace palpate::limit_points_fixture
