// Contacts of a zone with a prescribed force along some axes.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/support/runtime_session.hpp"
#include "tests/support/small_pack.hpp"
#include "tests/support/zone_block.hpp"

namespace palpate::test {
namespace zone_given_forces_test {

constexpr double kNotRead = 77;  // fills the entries that the runtime must not read

Eigen::Vector3d vector(const double numbers[3]) {
  return Eigen::Vector3d(numbers[0], numbers[1], numbers[2]);
}

// The contact bears the prescribed force, and its displacement matches the full elements under this force.
TEST(GivenForcesOfAZone, AreBorne) {
  const OpenPack pack(zone_pack_bytes());
  OwnedSession session(pack.get(), PAL_MODEL_AUTO);
  OwnedSession other(pack.get(), PAL_MODEL_ZONE);
  const uint32_t middle = small_pack().site_at(54);
  const auto settle = [](OwnedSession& at_hand, const std::vector<pal_contact>& contacts) {
    std::vector<pal_contact_result> results;
    for (int frame = 0; frame < 30; ++frame) {
      at_hand.touch(contacts);
      refine(at_hand);
    }
    for (int frame = 0; frame <= PAL_ZONE_STIFFNESS_FRAMES; ++frame) results = at_hand.touch(contacts);
    return results;
  };
  const double scale = vector(settle(other, {{middle, {0, 0, -0.03}, 0, {}, {}, {}}})[0].force).norm();
  for (uint32_t axes = 1; axes <= 7; ++axes) {
    std::vector<pal_contact> contacts = {{middle, {}, axes, {}, {}, {}},
                                         {small_pack().site_at(62), {0, 0, -0.01}, axes ^ 7U, {}, {}, {}}};
    for (pal_contact& contact : contacts) {
      for (int axis = 0; axis < 3; ++axis) {
        const bool given = (contact.force_axes >> axis & 1) != 0;
        contact.displacement[axis] = given ? kNotRead : (axis == 2 ? -0.02 : 0.008);
        contact.force[axis] = given ? scale * (axis == 2 ? -0.4 : 0.1) : kNotRead;
      }
    }
    const auto results = settle(session, contacts);
    std::vector<pal_contact> moved = contacts;
    for (size_t c = 0; c < 2; ++c) {
      EXPECT_EQ(results[c].model, PAL_MODEL_ZONE);
      EXPECT_EQ(results[c].flags & (PAL_FLAG_UNCONVERGED | PAL_FLAG_CLAMPED), 0U) << axes;
      moved[c].force_axes = 0;
      for (int axis = 0; axis < 3; ++axis) {
        moved[c].displacement[axis] = results[c].displacement[axis];
        if ((contacts[c].force_axes >> axis & 1) == 0) continue;
        EXPECT_NEAR(results[c].force[axis], contacts[c].force[axis], 5e-4 * scale) << axes;
      }
    }
    const auto by_displacement = settle(other, moved);
    for (size_t c = 0; c < 2; ++c)
      EXPECT_LE((vector(by_displacement[c].force) - vector(results[c].force)).norm(), 1e-3 * scale) << axes;
  }
}

// Contacts move first, then bear six tenths of the force along the chosen axes.
void expect_truth(const ZoneBlock& organ, const std::vector<uint32_t>& sites,
                  const std::vector<uint32_t>& axes, double tolerance_of_field) {
  SCOPED_TRACE(testing::Message() << "axes " << axes[0] << " of " << sites.size() << " contacts");
  const Eigen::Vector3d pushes[] = {{0.03, -0.02, -0.08}, {-0.02, 0.05, 0.04}, {0.04, 0.02, -0.03}};
  std::vector<pal_contact> contacts;
  for (size_t c = 0; c < sites.size(); ++c)
    contacts.push_back({sites[c], {pushes[c][0], pushes[c][1], pushes[c][2]}, 0, {}, {}, {}});
  OwnedSession session(organ.pack->get(), organ.config(3));
  const auto moved = settle(session, contacts);
  for (size_t c = 0; c < sites.size(); ++c) {
    contacts[c].force_axes = axes[c];
    for (int axis = 0; axis < 3; ++axis) contacts[c].force[axis] = 0.6 * moved[c].force[axis];
  }
  const auto results = settle(session, contacts);
  const ZoneErrors errors = errors_where_it_is(organ, session, contacts, results);
  EXPECT_LE(errors.field, tolerance_of_field);
  EXPECT_LE(errors.force, 1e-11);
  for (size_t c = 0; c < sites.size(); ++c) {
    for (int axis = 0; axis < 3; ++axis) {
      if ((axes[c] >> axis & 1) == 0) continue;
      EXPECT_NEAR(results[c].force[axis], contacts[c].force[axis], 1e-5 * largest_force(results));
    }
  }
}

TEST(GivenForcesOfAZone, AreThoseOfTheFullSolveWhereItIsTheWholeOrgan) {
  constexpr CompressibleNeoHookean kTissue = {1.0, 4.0};
  constexpr double kTolerance = field_tolerance(4e-7);
  const ZoneBlock linear_elements(8, kTissue);
  const ZoneBlock quadratic(8, kTissue, true, Eigen::Vector3d::Zero(), 2, 0.3);
  for (const ZoneBlock* organ : {&linear_elements, &quadratic}) {
    for (uint32_t axes = 1; axes <= 7; ++axes) {
      expect_truth(*organ, {4}, {axes}, kTolerance);
      expect_truth(*organ, {3, 4}, {axes, axes ^ 7U}, kTolerance);  // patches with common nodes
      expect_truth(*organ, {0, 8}, {axes, axes}, kTolerance);
    }
  }
}

TEST(GivenForcesOfAZone, AreThoseOfTheFullSolveAtSmallStrain) {
  constexpr LinearElastic kTissue = {1.0, 2.0};
  constexpr double kTolerance = field_tolerance(2e-6);
  const ZoneBlock wide(1, kTissue, false, Eigen::Vector3d::Zero(), 6, 0.18);
  const ZoneBlock narrow(1, kTissue, false, Eigen::Vector3d::Zero(), 6, 0.1);
  ASSERT_GT(std::min(wide.zone.most_boundary_nodes, narrow.zone.most_boundary_nodes), 0);
  for (uint32_t axes = 1; axes <= 7; ++axes) {
    expect_truth(wide, {12}, {axes}, kTolerance);
    expect_truth(wide, {12, 13}, {axes, axes}, kTolerance);
    // Separate zones.
    expect_truth(wide, {0, 24}, {axes, axes ^ 7U}, kTolerance);
    expect_truth(narrow, {0, 24}, {axes, axes}, kTolerance);
    // Near contacts with all forces prescribed: a group's tangent underestimates the interaction of groups.
    expect_truth(wide, {0, 24}, {axes, axes}, kTolerance);
    expect_truth(narrow, {0, 4, 22}, {axes, axes, axes}, kTolerance);
  }
}

// A fixed node lies between the contacts: separate zones interact less than the organ without the fixed node
// predicts.
TEST(GivenForcesOfAZone, SettleBesideFixedNodes) {
  const ZoneBlock organ(1, LinearElastic{1.0, 2.0}, false, Eigen::Vector3d::Zero(), 6, 0.18);
  pal_session_config config = organ.config(2);
  config.max_fixed = 1;
  OwnedSession session(organ.pack->get(), config);
  session.fix(contact_nodes_at(organ, {organ.block.sites.sites[12].node}));
  std::vector<pal_contact> contacts = {{0, {}, 7, {0.01, 0, -0.02}, {}, {}},
                                       {24, {}, 7, {0, 0.01, -0.02}, {}, {}}};
  std::vector<pal_contact_result> results;
  for (int frame = 0; frame < 60; ++frame) results = session.touch(contacts);
  for (size_t c = 0; c < 2; ++c) {
    EXPECT_EQ(results[c].flags & PAL_FLAG_UNCONVERGED, 0U);
    EXPECT_LE((vector(results[c].force) - vector(contacts[c].force)).norm(), 1e-4 * 0.02);
  }
}

TEST(GivenForcesOfAZone, BeyondWhatItBearsAreFiniteAndFlagged) {
  const OpenPack pack(zone_pack_bytes());
  OwnedSession session(pack.get(), PAL_MODEL_ZONE);
  for (const double size : {1e3, 1e300}) {
    pal_contact pushed = {small_pack().site_at(54), {}, 7, {0, 0, -size}, {}, {}};
    for (int frame = 0; frame < 50; ++frame) {
      const pal_contact_result result = session.touch({pushed}).front();
      EXPECT_TRUE(all_finite(result));
      EXPECT_NE(result.flags & (PAL_FLAG_UNCONVERGED | PAL_FLAG_CLAMPED), 0U);
      EXPECT_TRUE(all_finite(session.field()));
    }
  }
  // The contact returns after release.
  pal_contact_result result;
  for (int frame = 0; frame < 100; ++frame)
    result = session.touch({{small_pack().site_at(54), {}, 7, {}, {}, {}}}).front();
  EXPECT_LE(vector(result.displacement).norm(), 1e-3 * kMaxDisplacement);
}

}  // namespace zone_given_forces_test
}  // namespace palpate::test
