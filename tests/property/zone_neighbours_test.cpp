// Interaction of contacts with nonlinear zones, compared with the full solve.
#include <gtest/gtest.h>

#include <Eigen/Core>

#include "runtime/src/session/session_state.hpp"
#include "tests/support/zone_block.hpp"

namespace palpate::test {
namespace zone_neighbours_test {

// A new contact finds the organ deformed by the contacts before and after it in the list.
TEST(ZoneNeighbours, NewContactsFeelPresentContacts) {
  const ZoneBlock& organ = tissue_block(1);
  OwnedSession session(organ.pack->get(), organ.config(4));
  const std::vector<pal_contact> both = {{0, {0, 0, -0.001}, 0, {}, {}, {}},
                                         {8, {0, 0.04, 0.03}, 0, {}, {}, {}}};
  settle(session, {both[1]});
  auto found = session.touch(both);
  for (int frame = 0; frame < 8 && !has_ended(found); ++frame) found = session.touch(both);
  OwnedSession held(organ.pack->get(), organ.config(4));
  const auto expected = settle(held, both);
  for (size_t c = 0; c < both.size(); ++c) {
    EXPECT_LE((Eigen::Vector3d(found[c].force) - Eigen::Vector3d(expected[c].force)).norm(),
              2e-3 * Eigen::Vector3d(expected[1].force).norm());
  }
}

// Two neighbours pulled apart bear several times a single contact's force.
TEST(ZoneNeighbours, NeighboursThatPullAgainstEachOther) {
  const ZoneBlock& organ = tissue_block(2, false, Eigen::Vector3d::Zero(), 6, 0.1);
  const double size = 0.5 * organ.block.sites.mean_surface_edge;
  const std::vector<pal_contact> contacts = {{6, {-size, 0, 0}, 0, {}, {}, {}},
                                             {7, {size, 0, 0}, 0, {}, {}, {}}};
  const ContactAnswer truth = organ.solve(contacts);
  OwnedSession session(organ.pack->get(), organ.config(2));
  const auto apart = settle(session, contacts);
  for (size_t c = 0; c < 2; ++c) {
    EXPECT_EQ(apart[c].flags, 0U);
    EXPECT_LE((Eigen::Vector3d(apart[c].force) - truth.forces[c]).norm(), 1e-6 * truth.forces[c].norm());
  }
  EXPECT_LE((as_vector(session.field()) - truth.field).lpNorm<Eigen::Infinity>(),
            field_tolerance(2e-6) * size);
  const auto alone = settle(session, {contacts[0]});
  EXPECT_GE(Eigen::Vector3d(apart[0].force).norm(), 3 * Eigen::Vector3d(alone[0].force).norm());
}

// A group that goes to rest drops the correction of all groups. The others do not take this for an
// equilibrium that they missed.
TEST(ZoneNeighbours, RestOfAGroupIsNoSetbackOfOthers) {
  const ZoneBlock& organ = tissue_block(1, false, Eigen::Vector3d::Zero(), 6, 0.1);
  const double edge = organ.block.sites.mean_surface_edge;
  std::vector<pal_contact> contacts = {{0, {-0.4 * edge, 0, -edge}, 0, {}, {}, {}},
                                       {1, {0.4 * edge, 0, -edge}, 0, {}, {}, {}},
                                       {24, {0, 0, -edge}, 0, {}, {}, {}}};
  OwnedSession session(organ.pack->get(), organ.config(3));
  settle(session, contacts);
  ZoneSet& set = session.get()->tissue.zone.active;
  ASSERT_EQ(set.num_groups, 2U);
  ZoneGroup& alone = set.groups[is_alone_in_zone(set, set.groups[0].contacts[0]) ? 0 : 1];
  const ZoneGroup& neighbours = set.groups[&alone == set.groups ? 1 : 0];
  rest_group(*session.get()->tissue.pack, set, alone);
  for (pal_contact& contact : contacts) contact.displacement[2] -= 0.1 * edge;
  session.touch(contacts);
  EXPECT_EQ(neighbours.setbacks.failures, 0U);
  EXPECT_FALSE(neighbours.setbacks.is_back);
}

}  // namespace zone_neighbours_test
}  // namespace palpate::test
