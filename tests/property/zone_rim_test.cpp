// The near-field ring: elements next to the zones of neighbouring contacts, to second order.
#include "runtime/src/zone/zone_rim.hpp"

#include <gtest/gtest.h>

#include <random>
#include <utility>

#include "runtime/src/session/session_state.hpp"
#include "tests/support/nightly.hpp"
#include "tests/support/zone_block.hpp"

namespace palpate::test {
namespace zone_rim_test {

const std::vector<Law>& laws() {
  static const std::vector<Law> kLaws = {CompressibleNeoHookean{1.0, 4.0},
                                         StVenantKirchhoff{1.0, 4.0},
                                         LinearElastic{1.0, 4.0},
                                         InvariantLaw{0.5, 0.0, 0.2, 0.05, {{1.5, 0.1, 0.0}}},
                                         InvariantLaw{0.4, 0.2, 0.0, 0.0, {{1.5, 0.0, 0.0}}},
                                         Ogden{{{1.0, 3.0}, {0.4, -2.0}}, {{1.5, 0.0, 0.0}}}};
  return kLaws;
}

// n2(a, b) of an element: from differences of its forces, and from the near-field ring's code.
template <int kNodes>
void compare_second_order(const pal_pack& pack) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> any(-1, 1);
  const uint32_t count = std::min(7u, pack.num_zone_elements);
  std::vector<ZoneBatch<kNodes>> zone(2);
  std::vector<RimBatch<kNodes>> rim(2);
  const SecondOrderLaw law = second_order_law(pack.zone_materials[0]);
  std::array<int, kNodes> nodes;
  for (uint32_t i = 0; i < count; ++i) {
    for (size_t a = 0; a < kNodes; ++a) nodes[a] = static_cast<int>(pack.zone_elements[i].nodes[a]);
    for (int lane = static_cast<int>(i % kLanes); lane < kLanes; ++lane) {
      ASSERT_TRUE(set_zone_element<kNodes>(pack.zone_nodes, pack.zone_materials, pack.zone_elements[i],
                                           nodes.data(), pack::kNoPatch, lane, zone[i / kLanes]));
      ASSERT_TRUE(set_rim_element<kNodes>(pack, pack.zone_elements[i], nodes.data(),
                                          lane == static_cast<int>(i % kLanes) ? law : SecondOrderLaw(), lane,
                                          rim[i / kLanes]));
    }
    zone[i / kLanes].count = static_cast<int>(i % kLanes) + 1;
  }
  ZoneBatches batches = {};
  if constexpr (kNodes == 4) {
    batches.linear = zone.data();
    batches.num_linear = (count + kLanes - 1) / kLanes;
  } else {
    batches.quadratic = zone.data();
    batches.num_quadratic = (count + kLanes - 1) / kLanes;
  }
  const auto size = static_cast<Eigen::Index>(3 * pack.num_zone_nodes);
  const Eigen::VectorXd a = Eigen::VectorXd::NullaryExpr(size, [&] { return any(random); });
  const Eigen::VectorXd b = Eigen::VectorXd::NullaryExpr(size, [&] { return any(random); });
  const auto forces_at = [&](const Eigen::VectorXd& u) {
    Eigen::VectorXd forces = Eigen::VectorXd::Zero(size);
    add_zone_forces(batches, u.data(), forces.data());
    return forces;
  };
  constexpr double kStep = 2e-4;  // elements have edges of a quarter
  const auto even = [&](const Eigen::VectorXd& u) {
    return Eigen::VectorXd(forces_at(kStep * u) + forces_at(-kStep * u));
  };
  const Eigen::VectorXd expected = (even(a + b) - even(a - b)) / (8 * kStep * kStep);
  Eigen::VectorXd found = Eigen::VectorXd::Zero(size);
  const double squares =
      add_second_order<kNodes>(rim.data(), (count + kLanes - 1) / kLanes, a.data(), b.data(), found.data());
  EXPECT_LE((found - expected).norm(), 1e-4 * std::max(expected.norm(), 1e-3 * a.squaredNorm()));
  EXPECT_GT(squares, 0);
  // Half of (a + b) at both arguments: n2 is bilinear, so the value is its own gradient.
  const Eigen::VectorXd mean = 0.5 * (a + b);
  EXPECT_NEAR(add_second_order<kNodes>(rim.data(), (count + kLanes - 1) / kLanes, mean.data(), mean.data(),
                                       found.data()),
              squares, 1e-9 * squares);
}

TEST(ZoneRim, ElementsHaveTheSecondOrderOfTheirForces) {
  for (size_t i = 0; i < laws().size(); ++i) {
    SCOPED_TRACE(i);
    compare_second_order<4>(*ZoneBlock(1, laws()[i]).pack->get());
    compare_second_order<10>(*ZoneBlock(1, laws()[i], true, Eigen::Vector3d::Zero(), 2).pack->get());
  }
}

// Neighbours crush the tissue between them, with a ring about each. The near-field ring improves the forces
// (boundary) and the field (ring and beyond). A zone that holds the tissue between leaves little to improve.
TEST(ZoneRim, NeighboursThatCrushEachOther) {
  for (const bool quadratic : {false, true}) {
    if (quadratic && !is_nightly()) continue;
    SCOPED_TRACE(quadratic);
    const ZoneBlock& organ =
        tissue_block(1, quadratic, Eigen::Vector3d::Zero(), quadratic ? 4 : 6, 0.1, true);
    ZoneTables zone = organ.zone;
    zone.between = false;
    const AlignedBytes bytes = pack_of(organ, zone);
    const OpenPack rimmed(bytes);
    zone.most_rim_nodes = zone.most_rim_elements = 0;
    const AlignedBytes bare_bytes = pack_of(organ, zone);
    const OpenPack bare(bare_bytes);
    const double size = 0.35 * organ.block.sites.mean_surface_edge;
    const std::vector<pal_contact> contacts = {{6, {size, 0, -0.3 * size}, 0, {}, {}, {}},
                                               {7, {-size, 0, -0.3 * size}, 0, {}, {}, {}}};
    const ContactAnswer truth = organ.solve(contacts);
    const auto errors = [&](const pal_pack* pack) {
      OwnedSession session(pack, organ.config(2));
      double of_forces = 0;
      const auto results = settle(session, contacts);
      for (size_t c = 0; c < results.size(); ++c) {
        EXPECT_EQ(results[c].flags, 0u);
        of_forces = std::max(of_forces, (Eigen::Vector3d(results[c].force) - truth.forces[c]).norm());
      }
      return std::pair{(as_vector(session.field()) - truth.field).lpNorm<Eigen::Infinity>(), of_forces};
    };
    const auto [field, forces] = errors(rimmed.get());
    const auto [bare_field, bare_forces] = errors(bare.get());
    EXPECT_LE(field, 0.5 * bare_field) << field << " for " << bare_field;
    EXPECT_LE(forces, 0.7 * bare_forces) << forces << " for " << bare_forces;
  }
}

// Number of near-field nodes of the session's current set.
uint32_t num_rim_nodes(OwnedSession& session) {
  uint32_t count = 0;
  const ZoneSet& set = session.get()->tissue.zone.active;
  for (uint32_t g = 0; g < set.num_groups; ++g) count += set.groups[g].rim.num_nodes;
  return count;
}

TEST(ZoneRim, IsThereForNeighboursAlone) {
  const ZoneBlock& organ = tissue_block(1, false, Eigen::Vector3d::Zero(), 6, 0.1, true);
  const auto rim_of = [&](const ZoneBlock& of, const std::vector<uint32_t>& sites, uint32_t fixed) {
    OwnedSession session(of.pack->get(), session_config(of.pack->get(), PAL_MODEL_ZONE,
                                                        static_cast<uint32_t>(sites.size()), fixed));
    if (fixed > 0) session.fix({of.pack->info().num_contact_nodes - 1});
    std::vector<pal_contact> contacts;
    contacts.reserve(sites.size());
    for (const uint32_t site : sites) contacts.push_back({site, {0, 0, -0.01}, 0, {}, {}, {}});
    settle(session, contacts);
    return num_rim_nodes(session);
  };
  EXPECT_EQ(rim_of(organ, {6}, 0), 0u);
  EXPECT_EQ(rim_of(organ, {0, 24}, 0), 0u);
  EXPECT_GT(rim_of(organ, {6, 7}, 0), 0u);
  EXPECT_EQ(rim_of(organ, {6, 7}, 1), 0u) << "no loads count beside fixed nodes";
  EXPECT_EQ(rim_of(organ, {6, 6}, 0), 0u) << "a site and itself are no pair";
  const ZoneBlock hookean(1, LinearElastic{1.0, 4.0}, false, Eigen::Vector3d::Zero(), 6, 0.1, true);
  EXPECT_EQ(rim_of(hookean, {6, 7}, 0), 0u) << "what is linear adds nothing";
}

// A steady tool takes an iteration a step with a small error: the near-field ring does not lag behind.
TEST(ZoneRim, MovingNeighboursAreAsThoseHeld) {
  const ZoneBlock& organ = tissue_block(1, false, Eigen::Vector3d::Zero(), 6, 0.1, true);
  const double size = 0.3 * organ.block.sites.mean_surface_edge;
  const auto at = [&](double part) {
    return std::vector<pal_contact>{{6, {part * size, 0, -0.3 * part * size}, 0, {}, {}, {}},
                                    {7, {-part * size, 0, 0}, 0, {}, {}, {}}};
  };
  OwnedSession moving(organ.pack->get(), organ.config(2));
  std::vector<pal_contact_result> felt;
  for (int frame = 0; frame <= 100; ++frame) felt = moving.touch(at(0.01 * frame));
  OwnedSession held(organ.pack->get(), organ.config(2));
  const auto settled = settle(held, at(1));
  for (size_t c = 0; c < felt.size(); ++c) {
    EXPECT_EQ(felt[c].flags, 0u);
    EXPECT_LE((Eigen::Vector3d(felt[c].force) - Eigen::Vector3d(settled[c].force)).norm(),
              1e-3 * Eigen::Vector3d(settled[c].force).norm());
  }
  EXPECT_LE((as_vector(moving.field()) - as_vector(held.field())).lpNorm<Eigen::Infinity>(), 1e-4 * size);
}

// Near-field rings of groups may share nodes and elements, zones may not: as many contacts as a small block
// takes.
TEST(ZoneRim, SeveralGroupsFit) {
  const ZoneBlock& organ = tissue_block(1, false, Eigen::Vector3d::Zero(), 6, 0.1, true);
  for (const std::vector<uint32_t>& sites :
       {std::vector<uint32_t>{3, 5, 9, 10, 20, 23, 24}, {0, 1, 3, 4, 20, 21, 23, 24}, {0, 1, 23, 24}}) {
    OwnedSession session(organ.pack->get(), organ.config(static_cast<uint32_t>(sites.size())));
    std::vector<pal_contact> contacts;
    contacts.reserve(sites.size());
    for (const uint32_t site : sites) contacts.push_back({site, {0, 0, -0.01}, 0, {}, {}, {}});
    for (const pal_contact_result& result : settle(session, contacts)) EXPECT_EQ(result.flags, 0u);
  }
}

// A pack that understates its near-field rings: zones set a flag or linear_dd answers.
TEST(ZoneRim, LargerThanThePackSaysItIsNone) {
  const ZoneBlock& organ = tissue_block(1, false, Eigen::Vector3d::Zero(), 6, 0.1, true);
  for (int ZoneTables::*most : {&ZoneTables::most_rim_nodes, &ZoneTables::most_rim_elements}) {
    ZoneTables lying = organ.zone;
    lying.*most = 2;
    const AlignedBytes bytes = pack_of(organ, lying);
    const OpenPack pack(bytes);
    OwnedSession session(pack.get(), session_config(pack.get(), PAL_MODEL_ZONE, 2, 0));
    for (const pal_contact_result& result :
         session.touch({{6, {0, 0, -0.01}, 0, {}, {}, {}}, {7, {0, 0, -0.01}, 0, {}, {}, {}}})) {
      EXPECT_TRUE(all_finite(result));
      EXPECT_TRUE(result.flags & PAL_FLAG_ILL_CONDITIONED);
    }
    EXPECT_TRUE(all_finite(session.field()));
  }
}

// Beyond the range of second order the ring's displacement is limited.
TEST(ZoneRim, TornBeyondAllBoundsIsLimited) {
  const ZoneBlock& organ = tissue_block(1, false, Eigen::Vector3d::Zero(), 6, 0.1, true);
  const double edge = organ.block.sites.mean_surface_edge;
  OwnedSession session(organ.pack->get(), organ.config(2));
  bool is_limited = false;
  for (int frame = 0; frame < 400; ++frame) {
    const double size = 2 * edge * frame / 400;
    const auto results =
        session.touch({{6, {-size, 0, -size}, 0, {}, {}, {}}, {7, {size, 0, -size}, 0, {}, {}, {}}});
    for (const pal_contact_result& result : results) {
      ASSERT_TRUE(all_finite(result)) << frame;
    }
    ASSERT_TRUE(all_finite(session.field())) << frame;
    const ZoneSet& set = session.get()->tissue.zone.active;
    for (uint32_t g = 0; g < set.num_groups; ++g) {
      if (!set.groups[g].rim.is_limited) continue;
      is_limited = true;
      for (const pal_contact_result& result : results) EXPECT_TRUE(result.flags & PAL_FLAG_EXTRAPOLATED);
    }
  }
  EXPECT_TRUE(is_limited);
  const auto rest = settle(session, {{6, {0, 0, 0}, 0, {}, {}, {}}, {7, {0, 0, 0}, 0, {}, {}, {}}});
  for (const pal_contact_result& result : rest) EXPECT_LE(Eigen::Vector3d(result.force).norm(), 1e-6);
}

}  // namespace zone_rim_test
}  // namespace palpate::test
