// Zones at small displacements, and the order of their errors.
#include <gtest/gtest.h>

#include "tests/support/nonlinear_zone_fixture.hpp"

namespace palpate::test::nonlinear_zone_fixture {
namespace zone_linearity_test {

// To first order every zone equals linear_dd, because the exterior is exact.
TEST(NonlinearZone, IsLinearForSmallDisplacements) {
  const ZoneBlock& organ = tissue_block(1, false, {0.02, 0.01, -0.06});
  ASSERT_GT(organ.zone.most_boundary_nodes, 0);
  for (const auto* contacts : {&kOne, &kAdjacent, &kApart}) {
    std::vector<pal_contact> small = *contacts;
    for (pal_contact& contact : small) {
      for (double& d : contact.displacement) d *= 1e-6;
    }
    OwnedSession zone(organ.pack->get(), organ.config(2));
    OwnedSession linear(organ.pack->get(), PAL_MODEL_LINEAR, 2, 0);
    std::vector<pal_contact_result> found;
    for (int frame = 0; frame < 6; ++frame) found = zone.touch(small);  // groups converge against each other
    const auto expected = linear.touch(small);
    for (size_t c = 0; c < small.size(); ++c) {
      const Eigen::Vector3d force(expected[c].force);
      EXPECT_LE((Eigen::Vector3d(found[c].force) - force).norm(), 1e-4 * force.norm());
      EXPECT_EQ(found[c].flags & ~uint32_t{PAL_FLAG_UNREFINED}, expected[c].flags);
    }
  }
}

// The field is linear, too.
TEST(NonlinearZone, FieldIsLinearForSmallDisplacements) {
  const ZoneBlock& organ = tissue_block(1);
  ASSERT_GT(organ.zone.most_boundary_nodes, 0);
  for (const auto* contacts : {&kOne, &kAdjacent, &kApart}) {
    std::vector<pal_contact> small = *contacts;
    double push = 0;
    for (pal_contact& contact : small) {
      for (double& d : contact.displacement) d *= 1e-6;
      push = std::max(push, Eigen::Vector3d(contact.displacement).norm());
    }
    OwnedSession zone(organ.pack->get(), organ.config(2));
    OwnedSession linear(organ.pack->get(), PAL_MODEL_LINEAR, 2, 0);
    for (int frame = 0; frame < 6; ++frame) zone.touch(small);  // groups converge against each other
    linear.touch(small);
    EXPECT_LE((as_vector(zone.field()) - as_vector(linear.field())).lpNorm<Eigen::Infinity>(), 5e-6 * push);
  }
}

// Before the refining lane, too. An element lies between the zones, so each boundary moves the other one.
TEST(NonlinearZone, FieldOfTwoZonesIsLinearBeforeTheRefiningLane) {
  constexpr double kOfSweeps = 5e-3;  // left by the sweeps of field_response.cpp
  const ZoneBlock organ(1, kTissue, false, Eigen::Vector3d::Zero(), 6, 0.1);
  const double push = 1e-6;
  const std::vector<pal_contact> contacts = {{6, {0, 0, -push}, 0, {}, {}, {}},
                                             {9, {push, 0, 0}, 0, {}, {}, {}}};
  OwnedSession zone(organ.pack->get(), organ.config(2));
  OwnedSession linear(organ.pack->get(), PAL_MODEL_LINEAR, 2, 0);
  settle_unrefined(zone, contacts);
  linear.touch(contacts);
  EXPECT_LE((as_vector(zone.field()) - as_vector(linear.field())).lpNorm<Eigen::Infinity>(),
            kOfSweeps * push);
}

// Before the refining lane: the exterior is exact to first order, so the relative error grows with the push.
TEST(NonlinearZone, UnrefinedErrorsAreOfSecondOrder) {
  const Law yeoh = kYeoh;
  const ZoneBlock organs[] = {ZoneBlock(1, kTissue, false, Eigen::Vector3d::Zero(), 6, 0.1),
                              ZoneBlock(1, yeoh, false, {0.01, 0.02, -0.04}, 6, 0.1),
                              ZoneBlock(1, kTissue, true, Eigen::Vector3d::Zero(), 3, 0.2)};
  for (const ZoneBlock& organ : organs) {
    const auto site = static_cast<uint32_t>(organ.block.sites.sites.size() / 2);
    const auto errors_at = [&](double size) {
      const std::vector<pal_contact> contacts = {{site, {0.3 * size, -0.3 * size, -size}, 0, {}, {}, {}}};
      const ContactAnswer truth = organ.solve(contacts);
      OwnedSession session(organ.pack->get(), organ.config(1));
      const Eigen::Vector3d force(settle_unrefined(session, contacts)[0].force);
      return std::pair((as_vector(session.field()) - truth.field).lpNorm<Eigen::Infinity>() / size,
                       (force - truth.forces[0]).norm() / size);
    };
    const double size = 0.4 * organ.block.sites.mean_surface_edge;
    const auto [field, force] = errors_at(size);
    const auto [field_of_half, force_of_half] = errors_at(size / 2);
    EXPECT_LE(field, 0.1);
    EXPECT_LE(field_of_half, field / 1.7);
    EXPECT_LE(force_of_half, force / 1.7);
  }
}

}  // namespace zone_linearity_test
}  // namespace palpate::test::nonlinear_zone_fixture
