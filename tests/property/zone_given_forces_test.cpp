// Contacts of a zone of which the force is given along some axes.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <vector>

#include "tests/support/runtime_session.hpp"
#include "tests/support/small_pack.hpp"

namespace palpate::test {
namespace {

constexpr double kNotRead = 77;  // a displacement, or a force, that must not matter

Eigen::Vector3d vector(const double numbers[3]) {
  return Eigen::Vector3d(numbers[0], numbers[1], numbers[2]);
}

// What is given comes out, and the displacements found are those that full elements take under it.
TEST(GivenForcesOfAZone, AreBorne) {
  const OpenPack pack(zone_pack_bytes());
  OwnedSession session(pack.get(), PAL_MODEL_AUTO);
  OwnedSession other(pack.get(), PAL_MODEL_ZONE);
  const uint32_t middle = small_pack().site_at(54);
  const auto settle = [](OwnedSession& at_hand, const std::vector<pal_contact>& contacts) {
    std::vector<pal_contact_result> results;
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
  // Let go, it comes back.
  pal_contact_result result;
  for (int frame = 0; frame < 100; ++frame)
    result = session.touch({{small_pack().site_at(54), {}, 7, {}, {}, {}}}).front();
  EXPECT_LE(vector(result.displacement).norm(), 1e-3 * kMaxDisplacement);
}

}  // namespace
}  // namespace palpate::test
