// Interaction of contacts with nonlinear zones, compared with the full solve.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <array>
#include <tuple>
#include <utility>

#include "tests/support/nightly.hpp"
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

// Two neighbours pulled apart bear several times a single contact's force. The exterior hardly feels the sum,
// so second-order terms and a common basis for all pairs would be too coarse.
TEST(ZoneNeighbours, NeighboursThatPullAgainstEachOther) {
  const ZoneBlock& organ = tissue_block(2, false, Eigen::Vector3d::Zero(), 6, 0.1, true);
  const double size = 0.5 * organ.block.sites.mean_surface_edge;
  const std::vector<pal_contact> contacts = {{6, {-size, 0, 0}, 0, {}, {}, {}},
                                             {7, {size, 0, 0}, 0, {}, {}, {}}};
  const ContactAnswer truth = organ.solve(contacts);
  OwnedSession session(organ.pack->get(), organ.config(2));
  const auto apart = settle(session, contacts);
  for (size_t c = 0; c < 2; ++c) {
    EXPECT_EQ(apart[c].flags, 0U);
    EXPECT_LE((Eigen::Vector3d(apart[c].force) - truth.forces[c]).norm(), 6e-4 * truth.forces[c].norm());
  }
  EXPECT_LE((as_vector(session.field()) - truth.field).lpNorm<Eigen::Infinity>(), 0.007 * size);
  const auto alone = settle(session, {contacts[0]});
  EXPECT_GE(Eigen::Vector3d(apart[0].force).norm(), 3 * Eigen::Vector3d(alone[0].force).norm());
}

// The interaction terms of two contacts remove part of the error. For neighbours, whose loads share a part,
// they remove less.
TEST(ZoneNeighbours, PairsAddToEachOther) {
  if (!is_nightly()) GTEST_SKIP() << "only in ./dev test --all";
  for (const auto& [first, second, left] : {std::tuple{6u, 18u, 0.3}, {6u, 7u, 0.75}}) {
    SCOPED_TRACE(second);
    const auto error_of = [&, first = first, second = second](bool pairs) {
      const ZoneBlock& organ = tissue_block(1, false, Eigen::Vector3d::Zero(), 6, 0.1, pairs);
      const double size = 0.3 * organ.block.sites.mean_surface_edge;
      const std::vector<pal_contact> contacts = {{first, {0.3 * size, 0, -size}, 0, {}, {}, {}},
                                                 {second, {0, 0.3 * size, -size}, 0, {}, {}, {}}};
      return field_error(organ, organ.pack->get(), contacts) / size;
    };
    const double error = error_of(true);
    EXPECT_LE(error, 4.5e-3);
    EXPECT_LE(error, left * error_of(false));
  }
}

// Third order, for contacts with patches outside each other's zones; near contacts stay the same. The packs'
// zones hold no tissue between contacts, or near contacts would have nothing to compare.
TEST(ZoneNeighbours, PairsAddToThirdOrder) {
  const ZoneBlock& organ = tissue_block(1, false, Eigen::Vector3d::Zero(), 6, 0.1, true);
  ASSERT_EQ(organ.zone.pair_degree, 3);
  ZoneTables higher = organ.zone;
  higher.between = false;
  const AlignedBytes higher_bytes = pack_of(organ, higher);
  const OpenPack of_third(higher_bytes);
  ZoneTables lower = higher;
  lower.pair_degree = 2;
  lower.num_pair_fields -= kThirdOrderFields;
  compute_zone_mutual(organ.assembly, organ.block.scene, organ.block.sites, organ.rest, 2, {}, lower);
  const AlignedBytes bytes = pack_of(organ, lower);
  const OpenPack of_second(bytes);
  const double size = 0.4 * organ.block.sites.mean_surface_edge;
  for (const auto& [first, second, least, most] :
       {std::tuple{0u, 4u, 0.0, 0.45}, {0u, 24u, 0.0, 0.45}, {6u, 7u, 0.9, 1.1}}) {
    SCOPED_TRACE(second);
    const std::vector<pal_contact> contacts = {{first, {0.3 * size, 0, -size}, 0, {}, {}, {}},
                                               {second, {0, 0.3 * size, size}, 0, {}, {}, {}}};
    const double part =
        field_error(organ, of_third.get(), contacts) / field_error(organ, of_second.get(), contacts);
    EXPECT_GE(part, least);
    EXPECT_LE(part, most);
  }
}

// A near contact has no third-order terms alone. The third-order interaction with a third contact, by itself,
// would increase the error.
TEST(ZoneNeighbours, NearContactsAddToOthersToSecondOrder) {
  const ZoneBlock& organ = tissue_block(1, false, Eigen::Vector3d::Zero(), 6, 0.1, true);
  const double size = 0.5 * organ.block.sites.mean_surface_edge;
  for (const auto& [third, most] : {std::pair{3u, 2.9e-3}, {16u, 1.8e-3}, {18u, 1.4e-3}}) {
    SCOPED_TRACE(third);
    const std::vector<pal_contact> contacts = {{6, {0.1 * size, 0, -0.4 * size}, 0, {}, {}, {}},
                                               {7, {0, 0.3 * size, -size}, 0, {}, {}, {}},
                                               {third, {-0.2 * size, 0, -size}, 0, {}, {}, {}}};
    EXPECT_LE(field_error(organ, organ.pack->get(), contacts) / size, most);
  }
}

// Neighbours that shear the tissue between them. The series has only second order for elements beside both
// zones. A common zone holds these elements in full, and the error then falls with the square of the loads,
// by 16 to a quarter.
TEST(ZoneNeighbours, NearContactsHoldTheTissueBetween) {
  if (!is_nightly()) GTEST_SKIP() << "only in ./dev test --all";
  const ZoneBlock organ(2, CompressibleNeoHookean{1.0, 12.0}, false, Eigen::Vector3d::Zero(), 6, 0.1, true);
  ASSERT_TRUE(organ.zone.between);
  ZoneTables apart = organ.zone;
  apart.between = false;
  const AlignedBytes bytes = pack_of(organ, apart);
  const OpenPack without(bytes);
  for (const uint32_t other : {8u, 11u}) {
    SCOPED_TRACE(other);
    const auto error_at = [&](double size, const pal_pack* pack) {
      const std::vector<pal_contact> contacts = {{6, {0, 0, -size}, 0, {}, {}, {}},
                                                 {other, {0, 0, 0.8 * size}, 0, {}, {}, {}}};
      return field_error(organ, pack, contacts) / size;
    };
    const double size = 0.5 * organ.block.sites.mean_surface_edge;
    const double error = error_at(size, organ.pack->get());
    EXPECT_LE(error, 0.65 * error_at(size, without.get()));
    EXPECT_LE(error_at(size / 4, organ.pack->get()), error / 12);
  }
}

// Any two contacts fit with the tissue between them, whose boundary may exceed two zones' boundaries. A
// session of two contacts equals a session of four, which has more room.
TEST(ZoneNeighbours, AnyTwoFit) {
  if (!is_nightly()) GTEST_SKIP() << "only in ./dev test --all";
  const ZoneBlock& organ = tissue_block(1, true, Eigen::Vector3d::Zero(), 3, 0.01, true);
  ASSERT_TRUE(organ.zone.between);
  OwnedSession of_two(organ.pack->get(), organ.config(2));
  OwnedSession of_four(organ.pack->get(), organ.config(4));
  const auto num_sites = static_cast<uint32_t>(organ.block.sites.sites.size());
  const double size = 0.3 * organ.block.sites.mean_surface_edge;
  for (uint32_t first = 0; first < num_sites; ++first) {
    for (uint32_t second = 0; second < num_sites; ++second) {
      if (first == second) continue;
      const std::vector<pal_contact> contacts = {{first, {0, 0, -size}, 0, {}, {}, {}},
                                                 {second, {size, 0, 0}, 0, {}, {}, {}}};
      of_two.touch({});
      of_four.touch({});
      const auto found = of_two.touch(contacts);
      const Eigen::Vector3d expected(of_four.touch(contacts)[0].force);
      EXPECT_EQ(found[0].flags & PAL_FLAG_ILL_CONDITIONED, 0U) << first << ", " << second;
      EXPECT_LE((Eigen::Vector3d(found[0].force) - expected).norm(), 1e-6 * expected.norm())
          << first << ", " << second;
    }
  }
}

// Three contacts: in separate zones, in a common zone, or two together. Double-counting correction leaves an
// error of second order, which falls with the square of the loads, by 16 to a quarter. The interaction
// columns of neighbours in a row leave a remainder.
TEST(ZoneNeighbours, ThreeContactsCountNothingTwice) {
  const ZoneBlock& organ = tissue_block(1, false, Eigen::Vector3d::Zero(), 6, 0.1, true);
  const std::tuple<std::array<uint32_t, 3>, double, double> cases[] = {
      {{0, 4, 22}, 4.5e-4, 13}, {{6, 7, 8}, 4.8e-3, 7}, {{6, 7, 23}, 3.6e-3, 14}};
  for (const auto& [sites, most, falls] : cases) {
    SCOPED_TRACE(sites[2]);
    const auto error_at = [&organ, &sites = sites](double size) {
      const std::vector<pal_contact> contacts = {{sites[0], {0.3 * size, 0, -size}, 0, {}, {}, {}},
                                                 {sites[1], {0, 0.3 * size, -size}, 0, {}, {}, {}},
                                                 {sites[2], {-0.2 * size, 0, size}, 0, {}, {}, {}}};
      return field_error(organ, organ.pack->get(), contacts) / size;
    };
    const double size = 0.3 * organ.block.sites.mean_surface_edge;
    const double error = error_at(size);
    EXPECT_LE(error, most);
    EXPECT_LE(error_at(size / 4), error / falls);
  }
}

}  // namespace zone_neighbours_test
}  // namespace palpate::test
