// The range of the exterior's series: loads beyond it get a flag, and no spurious root passes for the organ's
// state.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <random>
#include <vector>

#include "tests/support/zone_block.hpp"

namespace palpate::test {
namespace zone_series_test {

constexpr double kReach = 0.25;

// YEOH, a stiffening law, `times` as stiff.
InvariantLaw stiffening(double times) {
  return {0.52 * times, 0, 0.13 * times, 0.065 * times, {{5 * times}}};
}

// Half as high as wide, with a stiff lump below the middle: the exterior has a large second-order part.
ZoneBlock flat_block(int rings, double tip_radius) {
  constexpr double kHeight = 0.5;
  TouchedBlock block = touched_block(4, tip_radius);
  for (Eigen::Vector3d& position : block.model.positions) position.z() *= kHeight;
  block.model.materials.front().law = stiffening(1);
  block.model.materials.push_back({"LUMP", stiffening(6)});
  for (Tetrahedron& element : block.model.elements) {
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (const int node : element.corners())
      middle += block.model.positions[static_cast<std::size_t>(node)] / 4;
    if ((middle - Eigen::Vector3d(0.5, 0.5, 0.6 * kHeight)).norm() < 0.3) element.material = 1;
  }
  block.scene.max_displacement = kReach;
  show_every_node(block);
  return {rings, std::move(block)};
}

std::vector<pal_contact> push(uint32_t site, const Eigen::Vector3d& d) {
  return {{site, {d[0], d[1], d[2]}, 0, {}, {}, {}}};
}

// Pulled three times as far as the scene's range, contacts reach spurious roots of the series with det F < 0
// outside and huge forces. The zone leaves these roots and finds the state of a push from rest.
TEST(ZoneSeries, OtherRootsAreLeft) {
  const ZoneBlock organ = flat_block(1, 0.3);
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  int met = 0;
  for (uint32_t site = 0; site < 9; ++site) {
    for (int direction = 0; direction < 3; ++direction) {
      SCOPED_TRACE(testing::Message() << "site " << site << ", direction " << direction);
      const Eigen::Vector3d d =
          kReach * Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized();
      OwnedSession session(organ.pack->get(), organ.config(1));
      const auto go = [&](double from, double to) {
        for (int frame = 1; frame <= 20; ++frame)
          session.touch(push(site, (from + (to - from) * frame / 20) * d));
      };
      go(0, 3);
      go(3, 0.3);
      pal_contact_result result = session.touch(push(site, 0.3 * d))[0];
      OwnedSession fresh(organ.pack->get(), organ.config(1));
      const Eigen::Vector3d expected(settle(fresh, push(site, 0.3 * d))[0].force);
      if (Eigen::Vector3d(result.force).norm() > 5 * expected.norm()) {
        EXPECT_NE(result.flags, 0U);
        ++met;
      }
      for (int frame = 0; frame < 120; ++frame) result = session.touch(push(site, 0.3 * d))[0];
      EXPECT_EQ(result.flags, 0U);
      EXPECT_LE((Eigen::Vector3d(result.force) - expected).norm(), 1e-6 * expected.norm());
    }
  }
  EXPECT_GE(met, 3);
}

// A prescribed force leads to a spurious root from rest, too. The contact must not oscillate between both
// roots, and rarely restarts from rest.
TEST(ZoneSeries, GivenForcesDoNotSwing) {
  const ZoneBlock organ = flat_block(1, 0.3);
  OwnedSession session(organ.pack->get(), organ.config(1));
  const double force = Eigen::Vector3d(settle(session, push(4, {0, 0, -0.5 * kReach}))[0].force).norm();
  for (const double times : {3.0, 10.0}) {
    for (const Eigen::Vector3d& direction : {Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(0.6, 0, -0.8)}) {
      SCOPED_TRACE(testing::Message() << times << ", " << direction.transpose());
      const Eigen::Vector3d given = times * force * direction;
      int returns = 0;
      bool was_at_rest = true;
      for (int frame = 0; frame < 2000; ++frame) {
        const pal_contact_result result =
            session.touch({{4, {}, 7, {given[0], given[1], given[2]}, {}, {}}})[0];
        const bool is_at_rest = Eigen::Vector3d(result.displacement).norm() == 0;
        if (is_at_rest && !was_at_rest) ++returns;
        was_at_rest = is_at_rest;
        ASSERT_TRUE(all_finite(result));
      }
      EXPECT_LE(returns, 30);
      session.touch({});
    }
  }
}

// Where a load induces almost as much load outside, the stiffness is still the derivative of the force.
// Nearer to the singular point a flag says that it is not.
TEST(ZoneSeries, StiffnessKnowsWhatLoadsBringAlong) {
  const ZoneBlock organ = flat_block(2, 0.1);
  constexpr double kStep = 1e-5;
  int beyond = 0;
  for (const double part : {0.3, 0.4, 0.5, 0.6, 0.7}) {
    for (uint32_t site = 0; site < 9; ++site) {
      SCOPED_TRACE(testing::Message() << part << " of the reach, site " << site);
      OwnedSession session(organ.pack->get(), organ.config(1));
      const Eigen::Vector3d d = part * kReach * Eigen::Vector3d(0.5, 0.3, -0.8).normalized();
      const pal_contact_result result = settle(session, push(site, d))[0];
      if (result.flags != 0) {
        ++beyond;
        continue;
      }
      const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> stiffness(result.stiffness[0]);
      Eigen::Matrix3d difference;
      for (int axis = 0; axis < 3; ++axis) {
        const Eigen::Vector3d step = kStep * Eigen::Vector3d::Unit(axis);
        const Eigen::Vector3d more(settle(session, push(site, d + step))[0].force);
        const Eigen::Vector3d less(settle(session, push(site, d - step))[0].force);
        difference.col(axis) = (more - less) / (2 * kStep);
      }
      difference =
          (difference + difference.transpose()).eval() / 2;  // the rest is of orders beyond the series
      EXPECT_LE((stiffness - difference).norm(), 1e-4 * difference.norm());
    }
  }
  EXPECT_GE(beyond, 1);
  EXPECT_LE(beyond, 9);
}

}  // namespace zone_series_test
}  // namespace palpate::test
