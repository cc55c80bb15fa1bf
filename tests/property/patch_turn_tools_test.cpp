// Tools that rotate their patches.
#include <gtest/gtest.h>

#include "tests/support/patch_rotation_fixture.hpp"

namespace palpate::test::patch_rotation_fixture {
namespace patch_turn_tools_test {

Vector3d place_of(const ZoneBlock& organ, uint32_t site) {
  return organ.block.model.positions[static_cast<size_t>(organ.block.sites.sites[site].node)];
}

// A hold at the site by a tool without rotation.
pal_hold at_site(const ZoneBlock& organ, uint32_t site) {
  pal_hold hold = pal_default_hold(site);
  hold.unstrained = at(place_of(organ, site));
  return hold;
}

// A tool moves and rotates on a closed path: the work is zero. Forces and torques equal those of a contact on
// the same path.
TEST(PatchRotation, ToolsFeelTheTorqueAndGiveItBack) {
  const ZoneBlock& organ = tissue_block(2);
  pal_session_config config = turning(organ);
  config.blend_seconds = 0;
  ToolSession tools(organ.pack->get(), config);
  OwnedSession contacts(organ.pack->get(), config);
  const Vector3d place = place_of(organ, 4);
  const Vector3d grip = place + Vector3d(0.1, 0.2, 0.5);  // of the tool; the patch is at the end of an arm
  pal_hold hold = pal_default_hold(4);
  hold.unstrained = pose_of(grip, rotation_vector({0.4, 0, -0.2}));
  tools.hold(0, hold);
  const Matrix3d R0 = rotation_vector({0.4, 0, -0.2});
  double work = 0;
  double given = 0;
  Vector3d last_position = grip;
  Matrix3d last_rotation = R0;
  Wrench last = Wrench::Zero();
  constexpr int kFrames = 3000;
  for (int frame = 0; frame <= kFrames; ++frame) {
    const double angle = 2 * M_PI * frame / kFrames;
    const double part = 1 - std::cos(angle);
    const Matrix3d R =
        rotation_vector(Vector3d(0.1 * part, 0.15 * std::sin(angle), 0.2 * std::sin(2 * angle)));
    // Rotation about the site; about the tool, the arm would swing the site far out of the tissue.
    const Vector3d d = 0.04 * Vector3d(std::sin(angle), std::sin(2 * angle), -part);
    const Vector3d position = place + d - R * (place - grip);
    const pal_tool_result result = tools.frame({pose_of(position, R * R0)})[0];
    orient(contacts, {R});
    const pal_contact_result at_site = contacts.touch({{4, {d[0], d[1], d[2]}, 0, {}, {}, {}}})[0];
    const Vector3d force(at_site.force);
    const Vector3d torque = Vector3d(torque_of(contacts, 0).torque) + (R * (place - grip)).cross(force);
    if (frame > 0) {
      ASSERT_LE((force_of(result) - force).norm(), 1e-6 * force.norm() + 1e-9);
      ASSERT_LE((test::torque_of(result) - torque).norm(), 1e-6 * torque.norm() + 1e-9);
    }
    Wrench wrench;
    wrench << force_of(result), test::torque_of(result);
    const Eigen::AngleAxisd turn(Matrix3d(R * R0 * last_rotation.transpose()));
    Wrench step;
    step << position - last_position, turn.angle() * turn.axis();
    work += 0.5 * (wrench + last).dot(step);
    given += std::abs(0.5 * (wrench + last).dot(step));
    last = wrench;
    last_position = position;
    last_rotation = R * R0;
  }
  EXPECT_LE(std::abs(work), 2e-3 * given);
}

TEST(PatchRotation, StopsAtAQuarterTurn) {
  const ZoneBlock& organ = tissue_block(2);
  OwnedSession session(organ.pack->get(), turning(organ));
  const pal_contact press = {4, {0, 0, -0.01}, 0, {}, {}, {}};
  orient(session, {rotation_vector({0, 0, 1.5})});
  EXPECT_EQ(session.touch({press})[0].flags & PAL_FLAG_CLAMPED, 0U);
  const auto settled_at = [&](double angle) {
    orient(session, {rotation_vector({0, 0, angle})});
    uint32_t flags = 0;
    for (int frame = 0; frame < 40; ++frame) flags = flags_of(session.touch({press})[0]);
    return std::pair(Vector3d(torque_of(session, 0).torque), flags);
  };
  const auto [most, flags] = settled_at(M_PI / 2 - 1e-9);
  EXPECT_EQ(flags, 0U);
  const auto [beyond, beyond_flags] = settled_at(2.5);
  EXPECT_EQ(beyond_flags, PAL_FLAG_CLAMPED);
  EXPECT_GT(most.norm(), 1e-3);
  EXPECT_LE((beyond - most).norm(), 1e-4 * most.norm());
}

// A tool that turns round and round slips. Its torque stays at the value of a quarter turn, never jumps, and
// falls on the way back.
TEST(PatchRotation, ToolsSlipBeyondAQuarterTurn) {
  const ZoneBlock& organ = tissue_block(2);
  pal_session_config config = turning(organ);
  config.blend_seconds = 0;
  ToolSession tools(organ.pack->get(), config);
  tools.hold(0, at_site(organ, 4));
  const Vector3d grip = place_of(organ, 4);
  Vector3d last = Vector3d::Zero();
  double most = 0;
  double jump = 0;
  const auto turn_to = [&](double angle) {
    const Vector3d torque = test::torque_of(tools.frame({pose(grip, {0, 0, angle})})[0]);
    jump = std::max(jump, (torque - last).norm());
    last = torque;
  };
  constexpr double kStep = 0.01;
  double angle = 0;
  for (; angle < 2 * M_PI; angle += kStep) {
    turn_to(angle);
    if (angle < M_PI / 2) most = last.norm();
    if (angle > M_PI / 2 + 0.1) {
      EXPECT_NEAR(last.norm(), most, 0.02 * most);
    }
  }
  EXPECT_LE(jump, 0.05 * most);
  for (const double end = angle - M_PI / 2; angle > end; angle -= kStep) turn_to(angle);
  EXPECT_LE(last.norm(), 0.05 * most);
  EXPECT_LE(jump, 0.05 * most);
}

// Tools that hold and release while rotated get no more energy out than they put in.
TEST(PatchRotation, IsPassive) {
  const ZoneBlock& organ = tissue_block(2, false, Vector3d::Zero(), 6, 0.18);
  pal_session_config config = turning(organ);
  config.max_tools = 2;
  config.budget_operations = 40000;
  ToolSession tools(organ.pack->get(), config);
  tools.hold(0, at_site(organ, 12));
  const Vector3d first = place_of(organ, 12);
  const Vector3d second = place_of(organ, 13);
  double work = 0;
  double put_in = 0;
  std::array<pal_pose, 2> last = {pose(first, {0, 0, 0}), pose(second, {0, 0, 0})};
  std::array<Wrench, 2> wrenches = {Wrench::Zero(), Wrench::Zero()};
  for (int frame = 0; frame < 4000; ++frame) {
    const double angle = 0.6 * std::sin(2 * M_PI * frame / 1000.0);
    const double depth = 0.02 * (1 - std::cos(2 * M_PI * frame / 1000.0));
    if (frame % 1000 == 250) {
      pal_hold hold = at_site(organ, 13);
      hold.unstrained = pose(second, {0.5 * angle, 0, 0});
      tools.hold(1, hold);
    }
    if (frame % 1000 == 700) require(pal_tool_release(tools.get(), 1), "release");
    const std::array<pal_pose, 2> poses = {pose(first - Vector3d(0, 0, depth), {0, 0, angle}),
                                           pose(second, {0.5 * angle, 0, 0})};
    const auto& results = tools.frame({poses[0], poses[1]});
    for (size_t tool = 0; tool < 2; ++tool) {
      Wrench wrench;
      wrench << force_of(results[tool]), test::torque_of(results[tool]);
      ASSERT_TRUE(wrench.allFinite());
      const auto rotation = [](const pal_pose& of) {
        return Eigen::Quaterniond(of.orientation[0], of.orientation[1], of.orientation[2], of.orientation[3]);
      };
      const Eigen::AngleAxisd turn(rotation(poses[tool]) * rotation(last[tool]).conjugate());
      Wrench step;
      step << Vector3d(poses[tool].position) - Vector3d(last[tool].position), turn.angle() * turn.axis();
      const double done = 0.5 * (wrench + wrenches[tool]).dot(step);
      work += done;
      put_in = std::max(put_in, work);
      wrenches[tool] = wrench;
      last[tool] = poses[tool];
    }
  }
  EXPECT_GE(work, -0.02 * put_in);
}

// A grasp of twisted tissue brings its energy along, and gets the energy back without a reduced force.
TEST(PatchRotation, BringsItsEnergy) {
  const ZoneBlock& organ = tissue_block(2, false, Vector3d::Zero(), 6, 0.18);
  pal_session_config config = turning(organ);
  config.max_tools = 2;
  ToolSession tools(organ.pack->get(), config);
  tools.hold(0, at_site(organ, 12));
  const pal_pose still = at(place_of(organ, 12));
  for (int frame = 0; frame < 20; ++frame) tools.frame({still, still});
  tools.hold(1, at_site(organ, 13));
  uint32_t flags = 0;
  double largest = 0;
  for (int frame = 0; frame <= 400; ++frame) {
    const double angle = 0.4 * (1 - frame / 400.0);
    const pal_tool_result result = tools.frame({still, pose(place_of(organ, 13), {0, 0, angle})})[1];
    flags |= result.flags;
    largest = std::max(largest, test::torque_of(result).norm());
  }
  EXPECT_EQ(flags & PAL_FLAG_REDUCED, 0U);
  EXPECT_GT(largest, 1e-3);
}

TEST(PatchRotation, IsRecorded) {
  const ZoneBlock& organ = tissue_block(1);
  alignas(8) static std::array<unsigned char, 1 << 16> buffer;
  OwnedSession session(organ.pack->get(), turning(organ));
  require(pal_session_record(session.get(), buffer.data(), buffer.size()), "record");
  for (int frame = 1; frame <= 20; ++frame) {
    orient(session, {rotation_vector(0.05 * frame * kTwist)});
    session.touch(kPress);
  }
  size_t bytes = 0;
  uint32_t complete = 0;
  require(pal_session_stop_recording(session.get(), &bytes, &complete), "stop");
  EXPECT_EQ(complete, 1U);
  OwnedSession again(organ.pack->get(), turning(organ));
  pal_replay replay = {};
  replay.struct_size = sizeof replay;
  while (replay.ended == 0) {
    require(pal_session_replay(again.get(), buffer.data(), bytes, &replay), "replay");
    EXPECT_EQ(replay.diverged, 0U);
  }
  EXPECT_EQ(replay.frames, 21U) << "the first one again, once its zone was prepared";
  EXPECT_EQ(Vector3d(torque_of(session, 0).torque), Vector3d(torque_of(again, 0).torque));
}

TEST(PatchRotation, RefusesWhatMakesNoSense) {
  const ZoneBlock& organ = tissue_block(1);
  const double upright[8] = {1, 0, 0, 0, 1, 0, 0, 0};
  OwnedSession still(organ.pack->get(), organ.config(1));
  pal_contact_torque torque = {};
  torque.struct_size = sizeof torque;
  EXPECT_EQ(pal_session_set_orientations(still.get(), upright, 1), PAL_STATUS_NO_SUCH_MODEL);
  EXPECT_EQ(pal_session_get_torque(still.get(), 0, &torque), PAL_STATUS_NO_SUCH_MODEL);
  OwnedSession session(organ.pack->get(), turning(organ, 1));
  EXPECT_EQ(pal_session_set_orientations(nullptr, upright, 1), PAL_STATUS_NULL_ARGUMENT);
  EXPECT_EQ(pal_session_set_orientations(session.get(), nullptr, 1), PAL_STATUS_NULL_ARGUMENT);
  EXPECT_EQ(pal_session_set_orientations(session.get(), upright, 2), PAL_STATUS_CAPACITY_EXCEEDED);
  const double bad[4] = {std::numeric_limits<double>::quiet_NaN(), 0, 0, 1};
  EXPECT_EQ(pal_session_set_orientations(session.get(), bad, 1), PAL_STATUS_BAD_ARGUMENT);
  EXPECT_EQ(pal_session_set_orientations(session.get(), nullptr, 0), PAL_STATUS_OK);
  EXPECT_EQ(pal_session_get_torque(session.get(), 0, &torque), PAL_STATUS_MODEL_CANNOT_ANSWER)
      << "no frame yet";
  session.touch({{4, {0, 0, -0.01}, 0, {}, {}, {}}});
  EXPECT_EQ(pal_session_get_torque(session.get(), 0, nullptr), PAL_STATUS_NULL_ARGUMENT);
  EXPECT_EQ(pal_session_get_torque(session.get(), 1, &torque), PAL_STATUS_BAD_ARGUMENT);
  EXPECT_EQ(pal_session_get_torque(session.get(), 0, &torque), PAL_STATUS_OK);
  torque.struct_size = 8;
  EXPECT_EQ(pal_session_get_torque(session.get(), 0, &torque), PAL_STATUS_BAD_STRUCT_SIZE);
  session.touch({});
  EXPECT_EQ(pal_session_get_torque(session.get(), 0, &torque), PAL_STATUS_MODEL_CANNOT_ANSWER);
  size_t bytes = 0;
  pal_session_config config = turning(organ);
  config.patches_turn = 2;
  EXPECT_EQ(pal_session_required_bytes(organ.pack->get(), &config, &bytes), PAL_STATUS_BAD_ARGUMENT);
  config = turning(organ);
  config.reserved = 1;
  EXPECT_EQ(pal_session_required_bytes(organ.pack->get(), &config, &bytes), PAL_STATUS_BAD_ARGUMENT);
  config = turning(organ);
  config.model = PAL_MODEL_LINEAR;
  EXPECT_EQ(pal_session_required_bytes(organ.pack->get(), &config, &bytes), PAL_STATUS_NO_SUCH_MODEL);
}

}  // namespace patch_turn_tools_test
}  // namespace palpate::test::patch_rotation_fixture
