// The stiffness of zones, and the work on closed paths.
#include <gtest/gtest.h>

#include <tuple>

#include "tests/support/nonlinear_zone_fixture.hpp"

namespace palpate::test::nonlinear_zone_fixture {
namespace zone_stiffness_test {

// `skew`: tolerance for the antisymmetric part of the derivative.
void expect_stiffness(const pal_pack* pack, double tolerance, double skew,
                      const std::vector<pal_contact>& neighbours = {}) {
  const auto force_at = [&](const Eigen::Vector3d& d, double* stiffness) {
    OwnedSession session(pack, session_config(pack, PAL_MODEL_ZONE, 2, 0));
    std::vector<pal_contact> contacts = {{4, {d[0], d[1], d[2]}, 0, {}, {}, {}}};
    contacts.insert(contacts.end(), neighbours.begin(), neighbours.end());
    const auto result = settle_unrefined(session, contacts).front();
    if (stiffness != nullptr) std::memcpy(stiffness, result.stiffness, sizeof result.stiffness);
    return Eigen::Vector3d(result.force);
  };
  const Eigen::Vector3d d(0.03, -0.02, -0.1);
  Eigen::Matrix<double, 3, 3, Eigen::RowMajor> stiffness;
  force_at(d, stiffness.data());
  EXPECT_LE((stiffness - stiffness.transpose()).norm(), 1e-12 * stiffness.norm());
  constexpr double kStep = 1e-5;
  Eigen::Matrix3d difference;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d step = kStep * Eigen::Vector3d::Unit(axis);
    difference.col(axis) = (force_at(d + step, nullptr) - force_at(d - step, nullptr)) / (2 * kStep);
  }
  EXPECT_LE((stiffness - 0.5 * (difference + difference.transpose())).norm(), tolerance * stiffness.norm());
  EXPECT_LE((difference - difference.transpose()).norm(), skew * stiffness.norm());
}

// Between two iterations of the refining lane the stiffness is symmetric and the derivative of the force. Tangents are
// eliminated in float32.
TEST(NonlinearZone, StiffnessIsTheDerivativeOfTheForce) {
  for (const auto& [rings, tolerance, skew] : {std::tuple{2, 1e-4, 3e-4}, {8, 1e-5, 3e-8}}) {
    SCOPED_TRACE(rings);
    expect_stiffness(ZoneBlock(rings, kTissue).pack->get(), tolerance, skew);
    expect_stiffness(sharing_block(rings, CompressibleNeoHookean{1.0, 20.0}).pack->get(), tolerance, skew);
  }
}

TEST(NonlinearZone, StiffnessBesideANeighbourIsTheDerivativeOfTheForce) {
  const ZoneBlock& organ = tissue_block(1, false, Eigen::Vector3d::Zero(), 6, 0.1);
  ASSERT_GT(organ.zone.most_boundary_nodes, 0);
  const std::vector<pal_contact> neighbour = {{3, {-0.02, 0.03, -0.05}, 0, {}, {}, {}}};
  expect_stiffness(organ.pack->get(), 1e-4, 0.015, neighbour);
}

TEST(NonlinearZone, OneContactIsTheSameInAnySession) {
  const ZoneBlock& organ = tissue_block(2, false, Eigen::Vector3d::Zero(), 4, 0.26);
  OwnedSession alone(organ.pack->get(), organ.config(1));
  OwnedSession of_several(organ.pack->get(), organ.config(2));
  const auto found = settle(alone, kOne).front();
  const auto expected = settle(of_several, kOne).front();
  const Eigen::Matrix3d stiffness = Eigen::Map<const Eigen::Matrix3d>(expected.stiffness[0]);
  EXPECT_GT(stiffness.norm(), 0.1);
  EXPECT_LE((Eigen::Map<const Eigen::Matrix3d>(found.stiffness[0]) - stiffness).norm(),
            1e-9 * stiffness.norm());
  EXPECT_LE((Eigen::Vector3d(found.force) - Eigen::Vector3d(expected.force)).norm(), 1e-9);
}

// Work on closed paths of this size, with the contacts a third of a turn apart, over the largest work on the
// way. Separate zones exchange forces a frame late, so each step runs frames until convergence.
double work_around(const ZoneBlock& organ, const std::vector<uint32_t>& sites, double size) {
  constexpr int kSteps = 240;
  const auto at = [&](int step) {
    std::vector<pal_contact> contacts;
    for (size_t c = 0; c < sites.size(); ++c) {
      const double angle = 2 * std::numbers::pi * (step / double{kSteps} + static_cast<double>(c) / 3);
      contacts.push_back(
          {sites[c],
           {size * std::cos(angle), size * std::sin(angle), -size * (1.2 + 0.6 * std::sin(2 * angle))},
           0,
           {},
           {},
           {}});
    }
    return contacts;
  };
  OwnedSession session(organ.pack->get(), organ.config(static_cast<uint32_t>(sites.size())));
  std::vector<pal_contact> contacts = at(0);
  settle_unrefined(session, contacts);
  std::vector<pal_contact_result> results = session.touch(contacts);
  double work = 0;
  double most = 0;
  for (int step = 1; step <= kSteps; ++step) {
    const std::vector<pal_contact> before = std::exchange(contacts, at(step));
    const std::vector<pal_contact_result> felt = std::exchange(results, session.touch(contacts));
    for (int frame = 0; frame < 11; ++frame) results = session.touch(contacts);
    for (size_t c = 0; c < contacts.size(); ++c) {
      EXPECT_EQ(results[c].flags, uint32_t{PAL_FLAG_UNREFINED});
      for (int i = 0; i < 3; ++i) {
        work += 0.5 * (results[c].force[i] + felt[c].force[i]) *
                (contacts[c].displacement[i] - before[c].displacement[i]);
      }
    }
    most = std::max(most, std::abs(work));
  }
  return std::abs(work) / most;
}

// Without the refining lane forces are the gradient of an energy.
TEST(NonlinearZone, ClosedPathsGiveNoEnergy) {
  constexpr double kConverged = 1e-4;  // as frames are done
  EXPECT_LE(work_around(tissue_block(2), {4}, 0.05), 2e-5);
  const ZoneBlock& organ = tissue_block(1, false, Eigen::Vector3d::Zero(), 6, 0.1);
  for (const std::vector<uint32_t>& sites : {std::vector<uint32_t>{0, 4}, {6, 7}, {0, 4, 22}, {6, 7, 12}})
    EXPECT_LE(work_around(organ, sites, 0.1 * organ.block.sites.mean_surface_edge), kConverged);
}

}  // namespace zone_stiffness_test
}  // namespace palpate::test::nonlinear_zone_fixture
