// Zones in a session: changing contact sets, jumps, budgets, and packs that contradict themselves.
#include <gtest/gtest.h>

#include "tests/support/nonlinear_zone_fixture.hpp"

namespace palpate::test::nonlinear_zone_fixture {
namespace zone_sessions_test {

TEST(NonlinearZone, ReturnsToRest) {
  const ZoneBlock& organ = tissue_block(2);
  OwnedSession session(organ.pack->get(), organ.config(2));
  settle(session, kApart);
  session.touch({});
  EXPECT_EQ(as_vector(session.field()).lpNorm<Eigen::Infinity>(), 0.0);
  const auto again = session.touch({{4, {0, 0, 0}, 0, {}, {}, {}}}).front();
  EXPECT_LE(Eigen::Vector3d(again.force).norm(), 1e-12);
  // Back by way of the contacts, too.
  settle(session, kOne);
  const auto back = settle(session, {{4, {0, 0, 0}, 0, {}, {}, {}}}).front();
  EXPECT_LE(Eigen::Vector3d(back.force).norm(), 1e-9);
  EXPECT_LE(as_vector(session.field()).lpNorm<Eigen::Infinity>(), 1e-9);
}

// A new contact set starts from the current state.
TEST(NonlinearZone, GoesOnWhereItWas) {
  constexpr double kNodeAlone = 0.1;
  const ZoneBlock& organ = tissue_block(2, false, Eigen::Vector3d::Zero(), 4, kNodeAlone);
  OwnedSession session(organ.pack->get(), organ.config(2));
  settle(session, {{4, {0.01, 0, -0.04}, 0, {}, {}, {}}});
  const Eigen::VectorXd before = as_vector(session.field());
  const Eigen::Vector3d place = before.segment<3>(3 * organ.block.sites.sites[0].packed_node);
  std::vector<pal_contact> both = {{4, {0.01, 0, -0.04}, 0, {}, {}, {}}};
  both.push_back({0, {place[0], place[1], place[2]}, 0, {}, {}, {}});
  session.touch(both);
  EXPECT_LE((as_vector(session.field()) - before).lpNorm<Eigen::Infinity>(),
            0.02 * before.lpNorm<Eigen::Infinity>());
}

// A hundredth of an edge a frame, with a tangent of some frames before.
TEST(NonlinearZone, MovingContactsAreAsThoseHeld) {
  const ZoneBlock& organ = tissue_block(2);
  for (const std::vector<pal_contact>& contacts : {kOne, kAdjacent, kApart}) {
    SCOPED_TRACE(contacts.size());
    OwnedSession moving(organ.pack->get(), organ.config(4));
    OwnedSession held(organ.pack->get(), organ.config(4));
    constexpr int kFrames = 60;
    for (int frame = 0; frame <= kFrames; ++frame) {
      std::vector<pal_contact> here = contacts;
      const double t = 2 * std::numbers::pi * frame / kFrames;
      for (pal_contact& contact : here) {
        contact.displacement[0] = 0.03 * std::cos(t);
        contact.displacement[1] = 0.03 * std::sin(t);
      }
      const auto found = frame == 0 ? settle_unrefined(moving, here) : moving.touch(here);
      if (frame % 20 != 7) continue;
      const auto expected = settle_unrefined(held, here);
      for (size_t c = 0; c < contacts.size(); ++c) {
        const Eigen::Vector3d force(expected[c].force);
        EXPECT_EQ(found[c].flags & PAL_FLAG_UNCONVERGED, 0U);
        EXPECT_LE((Eigen::Vector3d(found[c].force) - force).norm(), 1e-3 * force.norm());
      }
      EXPECT_LE((as_vector(moving.field()) - as_vector(held.field())).lpNorm<Eigen::Infinity>(), 1e-3 * 0.1);
    }
  }
}

// One, two and three contacts, to four times the scene's range and beyond. On the way back every result
// without a flag is right.
TEST(NonlinearZone, FarPushesAreFiniteAndFlagged) {
  const ZoneBlock& organ = tissue_block(2);
  const double edge = organ.block.sites.mean_surface_edge;
  TestRandom random(11);
  for (const auto& sites : {std::vector<uint32_t>{4}, {4, 0}, {4, 0, 5}}) {
    SCOPED_TRACE(sites.size());
    const auto pushed = [&](double length) {
      std::vector<pal_contact> contacts;
      for (const uint32_t site : sites) {
        const Eigen::Vector3d d = length * random.vector().normalized();
        contacts.push_back({site, {d[0], d[1], d[2]}, 0, {}, {}, {}});
      }
      return contacts;
    };
    const std::vector<pal_contact> near = pushed(0.5 * organ.block.scene.max_displacement);
    OwnedSession never_far(organ.pack->get(), organ.config(3));
    const auto expected = settle_unrefined(never_far, near);
    ASSERT_EQ(flags_of(expected[0]) & ~uint32_t{PAL_FLAG_OVERLAPPING}, 0U);
    for (const double length : {4 * organ.block.scene.max_displacement, 4 * edge, 1e3, 1e200}) {
      SCOPED_TRACE(length);
      for (int direction = 0; direction < 20; ++direction) {
        const std::vector<pal_contact> far = pushed(length);
        OwnedSession session(organ.pack->get(), organ.config(3));
        const auto touch = [&](const std::vector<pal_contact>& contacts, int frame) {
          auto results = session.touch(contacts);
          for (const pal_contact_result& result : results) EXPECT_TRUE(all_finite(result)) << frame;
          EXPECT_TRUE(all_finite(session.field())) << frame;
          return results;
        };
        for (int frame = 0; frame < 30; ++frame) {
          for (const pal_contact_result& result : touch(far, frame))
            EXPECT_NE(result.flags & PAL_FLAG_EXTRAPOLATED, 0U) << frame;
        }
        int answered = 0;
        double error = 0;
        for (int frame = 0; frame < 100; ++frame) {
          const auto found = touch(near, frame);
          if ((flags_of(found[0]) & ~uint32_t{PAL_FLAG_OVERLAPPING}) != 0) continue;
          ++answered;
          error = worst_force_error(found, expected);
          EXPECT_LE(error, 1e-3) << frame;
        }
        EXPECT_GE(answered, 20) << "it has to come back";
        EXPECT_LE(error, 1e-6);
      }
    }
  }
}

// A pack that understates its zones: linear_dd answers, or the result has a flag.
TEST(NonlinearZone, LargerThanThePackSaysItIsNone) {
  const ZoneBlock& organ = tissue_block(1, false, Eigen::Vector3d::Zero(), 6, 0.1);
  const std::vector<pal_contact> apart = {{0, {0.01, 0, -0.02}, 0, {}, {}, {}},
                                          {24, {0, 0.01, -0.02}, 0, {}, {}, {}}};
  const auto lie = [&](int ZoneTables::*most, int value) {
    ZoneTables lying = organ.zone;
    lying.*most = value;
    lying.most_boundary_nodes = std::min(lying.most_boundary_nodes, lying.most_nodes);
    return lying;
  };
  // The last two zones together exceed the arena's boundary capacity, though each matrix fits.
  for (const ZoneTables& lying :
       {lie(&ZoneTables::most_nodes, 2), lie(&ZoneTables::most_elements, 2),
        lie(&ZoneTables::most_boundary_nodes, 2),
        lie(&ZoneTables::most_boundary_nodes, organ.zone.most_boundary_nodes * 3 / 4)}) {
    const AlignedBytes bytes = pack_of(organ, lying);
    const OpenPack pack(bytes);
    OwnedSession automatic(pack.get(), PAL_MODEL_AUTO, 2, 0);
    OwnedSession linear(pack.get(), PAL_MODEL_LINEAR, 2, 0);
    const auto expected = linear.touch(apart);
    const auto found = automatic.touch(apart);
    for (size_t c = 0; c < apart.size(); ++c) {
      EXPECT_EQ(found[c].model, PAL_MODEL_LINEAR);
      EXPECT_LE((Eigen::Vector3d(found[c].force) - Eigen::Vector3d(expected[c].force)).norm(), 1e-12);
    }
    // Nodes fixed while running join every group, beyond the pack's numbers.
    OwnedSession fixing(pack.get(), PAL_MODEL_ZONE, 2, 32);
    std::vector<uint32_t> fixed;
    for (uint32_t node = 0; node < std::min(32u, pack.info().num_contact_nodes); ++node)
      fixed.push_back(node);
    fixing.fix(fixed);
    for (const pal_contact_result& result : fixing.touch(apart)) EXPECT_TRUE(all_finite(result));
    EXPECT_TRUE(all_finite(fixing.field()));
    OwnedSession zone(pack.get(), PAL_MODEL_ZONE, 2, 0);
    for (const pal_contact_result& result : zone.touch(apart)) {
      EXPECT_TRUE(all_finite(result));
      EXPECT_TRUE(result.flags & PAL_FLAG_ILL_CONDITIONED);
    }
    EXPECT_TRUE(all_finite(zone.field()));
  }
}

// A zone that follows another response model starts from rest, not from its own last state.
TEST(NonlinearZone, BeginsAtRestAfterAnotherModel) {
  const ZoneBlock& organ = tissue_block(2);
  OwnedSession session(organ.pack->get(), session_config(organ.pack->get(), PAL_MODEL_AUTO, 9, 0));
  settle(session, {{4, {0, 0, 0.3}, 0, {}, {}, {}}});  // further than a frame brings the contact back
  const std::vector<pal_contact> more_than_zones_answer(9, kOne[0]);
  EXPECT_EQ(session.touch(more_than_zones_answer)[0].model, PAL_MODEL_LINEAR);
  std::vector<pal_contact> light = kOne;
  for (double& d : light[0].displacement) d *= 0.01;
  const auto result = session.touch(light)[0];
  EXPECT_EQ(result.model, PAL_MODEL_ZONE);
  OwnedSession fresh(organ.pack->get(), organ.config(1));
  const Eigen::Vector3d expected(settle(fresh, light)[0].force);
  EXPECT_LE((Eigen::Vector3d(result.force) - expected).norm(), 1e-3 * expected.norm());
}

// A second tool comes down beside a deep one. It feels linear tissue in the next frame, and the zone of the first goes on,
// until the refining lane has prepared the zone of both, in slices between frames.
TEST(NonlinearZone, ASecondToolIsFeltInTheNextFrame) {
  const ZoneBlock& organ = tissue_block(2, false, Eigen::Vector3d::Zero(), 6, 0.1);
  pal_session_config config = organ.config(2);
  config.max_tools = 2;
  ToolSession session(organ.pack->get(), config);
  session.hold(0, pal_default_hold(4));
  constexpr double kDepth = 0.06;
  std::vector<pal_pose> poses = {at({0, 0, 0}), at({0, 0, 0})};
  for (int frame = 0; frame < 120; ++frame) {
    poses[0] = at({0, 0, -kDepth * std::min(1.0, frame / 80.0)});
    session.frame(poses);
    refine(session);
  }
  const pal_tool_result alone = session.last()[0];
  EXPECT_EQ(alone.model, PAL_MODEL_ZONE);
  session.hold(1, pal_default_hold(22));
  poses[1] = at({0, 0, -0.01});
  pal_refinement refinement = {};
  refinement.struct_size = sizeof refinement;
  int frames = 0;
  for (bool is_prepared = false; !is_prepared; ++frames) {
    const std::vector<pal_tool_result> results = session.frame_once(poses);
    is_prepared = (results[1].flags & PAL_FLAG_PREPARING) == 0;
    if (is_prepared) break;
    EXPECT_EQ(results[0].model, PAL_MODEL_ZONE);
    EXPECT_LE((force_of(results[0]) - force_of(alone)).norm(), 1e-6 * force_of(alone).norm());
    EXPECT_EQ(results[1].model, PAL_MODEL_LINEAR);
    EXPECT_GT(force_of(results[1]).norm(), 0);
    require(pal_session_refine(session.get(), 100'000, &refinement), "refine");
    ASSERT_LT(frames, 1000);
  }
  EXPECT_GT(frames, 10);
  // The zone of both goes on where the deep tool is, and its first answer is right to first order.
  EXPECT_EQ(session.last()[1].model, PAL_MODEL_ZONE);
  const std::vector<pal_contact> contacts = {{4, {0, 0, -kDepth}, 0, {}, {}, {}},
                                             {22, {0, 0, -0.01}, 0, {}, {}, {}}};
  const ContactAnswer truth = organ.solve(contacts);
  const auto worst = [&] {
    double largest = 0;
    for (size_t tool = 0; tool < 2; ++tool)
      largest = std::max(largest, (force_of(session.last()[tool]) - truth.forces[tool]).norm());
    return largest / truth.forces[0].norm();
  };
  EXPECT_LE(worst(), 1e-3);
  for (int frame = 0; frame < 40; ++frame) {
    refine(session);
    session.frame(poses);
  }
  EXPECT_LE(worst(), 1e-5);
}

// Without the refining lane linear_dd answers, and says so.
TEST(NonlinearZone, WithoutTheRefiningLaneLinearDdAnswers) {
  const ZoneBlock& organ = tissue_block(2);
  OwnedSession session(organ.pack->get(), organ.config(2));
  OwnedSession linear(organ.pack->get(), session_config(organ.pack->get(), PAL_MODEL_LINEAR, 2, 0));
  for (int frame = 0; frame < 20; ++frame) {
    const auto found = session.touch_once(kApart);
    const auto expected = linear.touch(kApart);
    for (size_t c = 0; c < found.size(); ++c) {
      EXPECT_EQ(found[c].model, PAL_MODEL_LINEAR);
      EXPECT_EQ(found[c].flags & (PAL_FLAG_PREPARING | PAL_FLAG_UNREFINED),
                uint32_t{PAL_FLAG_PREPARING | PAL_FLAG_UNREFINED});
      EXPECT_TRUE(std::equal(found[c].force, found[c].force + 3, expected[c].force));
    }
  }
  EXPECT_EQ(session.field(), linear.field());
}

}  // namespace zone_sessions_test
}  // namespace palpate::test::nonlinear_zone_fixture
