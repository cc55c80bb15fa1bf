// Contacts between sites next to other contacts, on nonlinear zones.
#include <gtest/gtest.h>

#include "tests/support/zone_place_fixture.hpp"

namespace palpate::test::zone_place_fixture {
namespace zone_place_neighbours_test {

// Two contacts that share a zone are near the blend of zone responses at all corners of both.
TEST_P(ZonePlaces, ContactsThatShareAZoneAreNearTheBlend) {
  const Eigen::Vector3d places[2] = {{0.09, 0.14, 0.375}, {0.2, 0.16, 0.375}};
  const Eigen::Vector3d pushes[2] = {kPush, {0, 0.004, -0.015}};
  const auto answer = [&](const std::vector<pal_contact>& contacts) {
    OwnedSession session(pack_.get(), PAL_MODEL_ZONE);
    std::vector<pal_contact_result> results;
    for (int frame = 0; frame <= PAL_ZONE_STIFFNESS_FRAMES; ++frame) results = session.touch(contacts);
    for (const pal_contact_result& result : results)
      EXPECT_EQ(flags_of(result) & ~uint32_t{PAL_FLAG_OVERLAPPING}, 0U)
          << "patches at some corners share nodes";
    Eigen::Matrix<double, 6, 1> forces;
    forces << force_of(results[0]), force_of(results[1]);
    return std::pair(forces, as_vector(session.field()));
  };
  const pal_surface_point points[2] = {point_at(places[0]), point_at(places[1])};
  Eigen::Matrix<double, 6, 1> blend = Eigen::Matrix<double, 6, 1>::Zero();
  Eigen::VectorXd field = Eigen::VectorXd::Zero(3 * Eigen::Index{pack_.info().num_nodes});
  double largest = 0;
  Eigen::Matrix<double, 6, 1> nearest = blend;
  Eigen::VectorXd nearest_field;
  for (int one = 0; one < 3; ++one) {
    for (int other = 0; other < 3; ++other) {
      const double weight = points[0].weights[one] * points[1].weights[other];
      const auto [forces, shown] =
          answer({at_site(points[0].sites[one], pushes[0]), at_site(points[1].sites[other], pushes[1])});
      blend += weight * forces;
      field += weight * shown;
      if (weight <= largest) continue;
      largest = weight;
      nearest = forces;
      nearest_field = shown;
    }
  }
  const auto [forces, shown] = answer({contact_at(places[0], pushes[0]), contact_at(places[1], pushes[1])});
  EXPECT_LE((forces - blend).norm(), 0.3 * (nearest - blend).norm());
  EXPECT_LE((shown - field).lpNorm<Eigen::Infinity>(),
            0.3 * (nearest_field - field).lpNorm<Eigen::Infinity>());
}

// A contact that shares a zone slides: its triangle changes, and the zone's sites change.
TEST_P(ZonePlaces, SlideBesideAnotherWithoutJumps) {
  const Eigen::Vector3d from(0.09, 0.12, 0.375);
  const Eigen::Vector3d way(0, 0.14, 0);
  const pal_contact other = at_site(small_pack().site_at(60), {0, 0.004, -0.015});
  constexpr int kSteps = 280;
  OwnedSession session(pack_.get(), PAL_MODEL_ZONE);
  Eigen::Vector3d before[2];
  double peak = 0;
  double jump = 0;
  for (int step = -30; step <= kSteps; ++step) {
    const double part = std::max(0, step) / static_cast<double>(kSteps);
    const auto results = session.touch({contact_at(from + part * way, kPush), other});
    for (int c = 0; c < 2; ++c) {
      EXPECT_EQ(results[c].flags & PAL_FLAG_NEAREST_SITE, 0U);
      if (step > 0) jump = std::max(jump, (force_of(results[c]) - before[c]).norm());
      before[c] = force_of(results[c]);
      peak = std::max(peak, before[c].norm());
    }
  }
  EXPECT_LE(jump, 0.03 * peak);
}

// Energy, forces and stiffness of contacts that share a zone are consistent between sites, too.
TEST_P(ZonePlaces, ForcesInASharedZoneAreGradients) {
  const pal_contact other = at_site(small_pack().site_at(60), {0, 0.004, -0.015});
  OwnedSession session(pack_.get(), PAL_MODEL_ZONE);
  const auto settle_at = [&](const Eigen::Vector3d& d) {
    std::vector<pal_contact_result> results;
    for (int frame = 0; frame <= PAL_ZONE_STIFFNESS_FRAMES; ++frame)
      results = session.touch({contact_at({0.09, 0.14, 0.375}, d), other});
    return std::pair(results.front(), session.get()->tissue.stored_energy);
  };
  const pal_contact_result at_push = settle_at(kPush).first;
  constexpr double kStep = 1e-4;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d step = kStep * Eigen::Vector3d::Unit(axis);
    const auto [ahead, energy_ahead] = settle_at(kPush + step);
    const auto [behind, energy_behind] = settle_at(kPush - step);
    EXPECT_NEAR(at_push.force[axis], (energy_ahead - energy_behind) / (2 * kStep),
                2e-3 * force_of(at_push).norm());
    for (int i = 0; i < 3; ++i)
      EXPECT_NEAR(at_push.stiffness[i][axis], (ahead.force[i] - behind.force[i]) / (2 * kStep),
                  2e-3 * at_push.stiffness[2][2]);
  }
}

// A set that does not fit the pack's capacities has no groups. A frame that searches for given forces ends there, too.
TEST_P(ZonePlaces, ARefusedSetEndsItsFrame) {
  std::vector<pal_contact> pressed = {contact_at({0.09, 0.14, 0.375}, kPush),
                                      contact_at({0.2, 0.16, 0.375}, {0, 0.004, -0.015})};
  OwnedSession session(pack_.get(), PAL_MODEL_ZONE);
  session.touch(pressed);
  ZoneSet& set = session.get()->tissue.zone.active;
  set.sound = false;
  set.num_groups = 0;
  for (pal_contact& contact : pressed) {
    contact.force_axes = 7;
    contact.force[2] = -1;
  }
  EXPECT_NE(session.touch_once(pressed).front().flags & PAL_FLAG_UNCONVERGED, 0U);
}

// The forces of two displaced contacts, prescribed in turn, bring both contacts to the same places.
TEST_P(ZonePlaces, GivenForcesActWhereBothContactsAre) {
  std::vector<pal_contact> pressed = {contact_at({0.09, 0.14, 0.375}, kPush),
                                      contact_at({0.2, 0.16, 0.375}, {0, 0.004, -0.015})};
  const std::vector<pal_contact> moved = pressed;
  OwnedSession session(pack_.get(), PAL_MODEL_ZONE);
  std::vector<pal_contact_result> there;
  for (int frame = 0; frame <= PAL_ZONE_STIFFNESS_FRAMES; ++frame) there = session.touch(moved);
  for (size_t c = 0; c < 2; ++c) {
    pressed[c].force_axes = 7;
    for (int axis = 0; axis < 3; ++axis) {
      pressed[c].displacement[axis] = 0;
      pressed[c].force[axis] = there[c].force[axis];
    }
  }
  OwnedSession again(pack_.get(), PAL_MODEL_ZONE);
  std::vector<pal_contact_result> results;
  for (int frame = 0; frame < 40; ++frame) results = again.touch(pressed);
  for (size_t c = 0; c < 2; ++c) {
    const Eigen::Vector3d wanted(moved[c].displacement);
    EXPECT_EQ(results[c].flags & PAL_FLAG_UNCONVERGED, 0U);
    EXPECT_LE((Eigen::Vector3d(results[c].displacement) - wanted).norm(), 1e-3 * kPush.norm());
    EXPECT_LE((force_of(results[c]) - force_of(there[c])).norm(), 1e-3 * force_of(there[0]).norm());
  }
}

// Two contacts without common zone nodes match the blend of the pair's zones at the first contact's corners.
// The second contact feels the first's motion.
TEST(ZonePlacesApart, AreEachBetweenTheirSites) {
  const ZoneBlock organ(1, CompressibleNeoHookean{1.0, 4.0}, false, Eigen::Vector3d::Zero(), 8, 0.1);
  const uint32_t corners[3] = {8, 9, 16};
  const double weights[3] = {0.4, 0.35, 0.25};
  const pal_contact other = at_site(40, {0.01, 0, -0.02});
  const auto settled = [&](const pal_contact& contact) {
    OwnedSession session(organ.pack->get(), organ.config(2));
    const auto results = settle(session, {contact, other});
    return std::tuple(results, force_of(results[0]), as_vector(session.field()));
  };
  pal_contact between = at_site(corners[0], kPush);
  Eigen::Vector3d blend = Eigen::Vector3d::Zero();
  Eigen::Vector3d others = Eigen::Vector3d::Zero();
  Eigen::VectorXd field = Eigen::VectorXd::Zero(3 * Eigen::Index{organ.pack->info().num_nodes});
  for (int corner = 0; corner < 3; ++corner) {
    const auto [results, force, own_field] = settled(at_site(corners[corner], kPush));
    blend += weights[corner] * force;
    others += weights[corner] * force_of(results[1]);
    field += weights[corner] * own_field;
    if (corner == 0) continue;
    between.neighbours[corner - 1] = corners[corner];
    between.neighbour_weights[corner - 1] = weights[corner];
  }
  const auto [at_nearest, nearest, nearest_field] = settled(at_site(corners[0], kPush));
  const auto [results, force, own_field] = settled(between);
  EXPECT_EQ(results[0].flags & PAL_FLAG_NEAREST_SITE, 0U);
  EXPECT_LE((force - blend).norm(), 0.3 * (nearest - blend).norm());
  EXPECT_LE((own_field - field).lpNorm<Eigen::Infinity>(),
            0.3 * (nearest_field - field).lpNorm<Eigen::Infinity>());
  EXPECT_LE((force_of(results[1]) - others).norm(), 0.3 * (force_of(at_nearest[1]) - others).norm());
}

}  // namespace zone_place_neighbours_test
}  // namespace palpate::test::zone_place_fixture
