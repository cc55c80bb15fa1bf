// Tools: rigid motion of their contacts, forces and torques in the world frame, and invalid input.
#include <gtest/gtest.h>

#include "tests/support/tools_fixture.hpp"

namespace palpate::test::tools_fixture {
namespace tools_test {

TEST_F(Tools, HeldAtTheOriginThePositionIsTheDisplacement) {
  const Eigen::Vector3d d(0.01, -0.02, -0.03);
  tools_.hold(1, pal_default_hold(4));
  const pal_tool_result result = tools_.frame({at({0, 0, 0}), at(d)})[1];
  const pal_contact_result expected = contacts_.touch({{4, {d[0], d[1], d[2]}, 0, {}, {}, {}}})[0];
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(result.force[i], expected.force[i]) << "the same bits";
    for (int j = 0; j < 3; ++j) EXPECT_EQ(result.stiffness[i][j], expected.stiffness[i][j]);
  }
  EXPECT_EQ(result.model, PAL_MODEL_POLYNOMIAL);
  EXPECT_EQ(result.site, 4U);
  EXPECT_EQ(result.num_contacts, 1U);
  EXPECT_EQ(result.displacement_error, expected.displacement_error);
  EXPECT_EQ(result.flags, 0U);
  EXPECT_EQ(tools_.field(), contacts_.field());
}

TEST_F(Tools, AToolThatHoldsNothingFeelsNothing) {
  tools_.hold(0, pal_default_hold(2));
  const auto results = tools_.frame({at({0, 0, -0.02}), at({9, 9, 9})});
  EXPECT_GT(force_of(results[0]).norm(), 0);
  for (size_t tool = 1; tool < 4; ++tool) {
    EXPECT_EQ(force_of(results[tool]).norm(), 0);
    EXPECT_EQ(results[tool].num_contacts, 0U);
    EXPECT_EQ(results[tool].model, PAL_MODEL_AUTO);
  }
}

TEST_F(Tools, AGraspStartsWithoutForce) {
  const pal_pose grip = pose({0.3, 0.2, 0.7}, {0.4, -0.2, 0.5});
  pal_hold hold = pal_default_hold(3);
  hold.unstrained = grip;
  tools_.hold(0, hold);
  EXPECT_LE(force_of(tools_.frame({grip})[0]).norm(), kRounding);
}

// Two sites of a tool: each moves by (p - p0) + (R R0^T - 1)(x - p0).
TEST_F(Tools, ContactsMoveRigidlyWithTheirTool) {
  const Eigen::Vector3d p0(0.1, 0.15, 0.5);
  const Eigen::Matrix3d R0 = rotation_vector({0.3, 0.1, -0.2});
  pal_hold hold = pal_default_hold(2);
  hold.unstrained = pose(p0, {0.3, 0.1, -0.2});
  tools_.hold(0, hold);
  hold.sites[0] = 9;
  tools_.hold(0, hold);
  const Eigen::Vector3d p = p0 + Eigen::Vector3d(0.01, 0.005, -0.02);
  const Eigen::Vector3d turn(0.25, 0.13, -0.1);
  const Eigen::Matrix3d R = rotation_vector(turn);

  std::vector<pal_contact> contacts;
  std::vector<Eigen::Vector3d> arms;
  for (const uint32_t site : {2u, 9u}) {
    const Eigen::Vector3d r0 = site_position(pack_, site) - p0;
    const Eigen::Vector3d arm = R * R0.transpose() * r0;
    const Eigen::Vector3d d = p - p0 + arm - r0;
    contacts.push_back({site, {d[0], d[1], d[2]}, 0, {}, {}, {}});
    arms.push_back(arm);
  }
  const auto expected = contacts_.touch(contacts);
  Eigen::Vector3d force = Eigen::Vector3d::Zero();
  Eigen::Vector3d torque = Eigen::Vector3d::Zero();
  for (size_t c = 0; c < 2; ++c) {
    force += Eigen::Vector3d(expected[c].force);
    torque += arms[c].cross(Eigen::Vector3d(expected[c].force));
  }
  const pal_tool_result result = tools_.frame({pose(p, turn)})[0];
  expect_near(force_of(result), force, kRounding, "force");
  expect_near(torque_of(result), torque, kRounding, "torque");
  EXPECT_EQ(result.num_contacts, 2U);
  EXPECT_EQ(result.model, PAL_MODEL_LINEAR);
  EXPECT_TRUE(result.flags & PAL_FLAG_LINEAR_FALLBACK);
}

// d force / d position, for tools with one and with two contacts.
TEST_F(Tools, StiffnessIsTheDerivativeOfTheForce) {
  constexpr double kStep = 1e-6;
  for (const int held : {1, 2}) {
    ToolSession tools(pack_.get(), raw_config(pack_));
    tools.hold(0, pal_default_hold(1));
    if (held == 2) tools.hold(0, pal_default_hold(10));
    tools.hold(2, pal_default_hold(6));
    const Eigen::Vector3d p(0.01, 0.012, -0.02);
    const auto force = [&](const Eigen::Vector3d& position) {
      return force_of(tools.frame({at(position), at({0, 0, 0}), at({0, 0, -0.01})})[0]);
    };
    Eigen::Matrix3d difference;
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d step = kStep * Eigen::Vector3d::Unit(axis);
      difference.col(axis) = (force(p + step) - force(p - step)) / (2 * kStep);
    }
    force(p);
    expect_near(stiffness_of(tools.last()[0]), difference, 1e-8, "stiffness");
  }
}

// Organ and tools moved and rotated together: the same response, rotated.
TEST_F(Tools, AnswersTurnWithTheOrgan) {
  const Eigen::Vector3d turn(0.7, -1.1, 0.4);
  const Eigen::Matrix3d Q = rotation_vector(turn);
  const Eigen::Vector3d t(2, -1, 3);
  pal_session_config config = raw_config(pack_);
  config.organ = pose(t, turn);
  ToolSession turned(pack_.get(), config);

  const Eigen::Vector3d p0(0.2, 0.2, 0.5);
  const Eigen::Vector3d w0(0.2, -0.3, 0.1);
  pal_hold hold = pal_default_hold(5);
  hold.unstrained = pose(p0, w0);
  tools_.hold(0, hold);
  hold.unstrained = pose_of(Q * p0 + t, Q * rotation_vector(w0));
  turned.hold(0, hold);
  const Eigen::Vector3d p = p0 + Eigen::Vector3d(0.02, 0.01, -0.03);
  const Eigen::Vector3d w(0.3, -0.25, 0.05);
  const pal_tool_result here = tools_.frame({pose(p, w)})[0];
  const pal_tool_result there = turned.frame({pose_of(Q * p + t, Q * rotation_vector(w))})[0];
  expect_near(force_of(there), Q * force_of(here), kRounding, "force");
  expect_near(torque_of(there), Q * torque_of(here), kRounding, "torque");
  expect_near(stiffness_of(there), Q * stiffness_of(here) * Q.transpose(), kRounding, "stiffness");
  EXPECT_EQ(there.flags, here.flags);
}

TEST_F(Tools, ReleasingFreesTheTissue) {
  tools_.hold(0, pal_default_hold(2));
  tools_.hold(3, pal_default_hold(8));
  tools_.frame({at({0, 0, -0.02}), at({0, 0, 0}), at({0, 0, 0}), at({0.01, 0, 0})});
  require(pal_tool_release(tools_.get(), 0), "release");
  const auto results = tools_.frame({at({0, 0, -0.02}), at({0, 0, 0}), at({0, 0, 0}), at({0.01, 0, 0})});
  EXPECT_EQ(force_of(results[0]).norm(), 0);
  const pal_contact_result alone = contacts_.touch({{8, {0.01, 0, 0}, 0, {}, {}, {}}})[0];
  expect_near(force_of(results[3]), Eigen::Vector3d(alone.force), kRounding, "the other tool, now alone");
  require(pal_tool_release(tools_.get(), 3), "release");
  tools_.frame({});
  for (const pal_real u : tools_.field()) EXPECT_EQ(u, 0.0f);
}

TEST_F(Tools, ARefusedHoldChangesNothing) {
  tools_.hold(0, pal_default_hold(1));
  const auto before = tools_.frame({at({0, 0, -0.01})})[0];
  const auto refuse = [&](uint32_t tool, const pal_hold& hold, pal_status expected) {
    EXPECT_EQ(pal_tool_hold(tools_.get(), tool, &hold), expected);
  };
  const uint32_t sites = pack_.info().num_sites;
  refuse(4, pal_default_hold(1), PAL_STATUS_NO_SUCH_TOOL);
  refuse(0, pal_default_hold(sites), PAL_STATUS_NO_SUCH_SITE);
  pal_hold hold = pal_default_hold(1);
  hold.weights[0] = 0.5;
  refuse(0, hold, PAL_STATUS_BAD_ARGUMENT);
  hold.weights[1] = 0.7;
  hold.weights[2] = -0.2;
  refuse(0, hold, PAL_STATUS_BAD_ARGUMENT);
  hold.weights[1] = std::nan("");
  refuse(0, hold, PAL_STATUS_NOT_FINITE);
  hold = pal_default_hold(1);
  hold.unstrained.orientation[0] = 0;
  refuse(0, hold, PAL_STATUS_BAD_ARGUMENT);
  hold = pal_default_hold(1);
  hold.unstrained.position[1] = HUGE_VAL;
  refuse(0, hold, PAL_STATUS_BAD_ARGUMENT);
  hold = pal_default_hold(1);
  const int unknown_law = 9;
  std::memcpy(&hold.law, &unknown_law, sizeof unknown_law);
  refuse(0, hold, PAL_STATUS_BAD_ARGUMENT);
  hold = pal_default_hold(1);
  hold.struct_size = 8;
  refuse(0, hold, PAL_STATUS_BAD_STRUCT_SIZE);
  EXPECT_EQ(pal_tool_hold(tools_.get(), 0, nullptr), PAL_STATUS_NULL_ARGUMENT);
  EXPECT_EQ(pal_tool_release(tools_.get(), 4), PAL_STATUS_NO_SUCH_TOOL);
  EXPECT_EQ(pal_tool_set_touch(tools_.get(), 4, nullptr), PAL_STATUS_NO_SUCH_TOOL);
  const auto after = tools_.frame({at({0, 0, -0.01})})[0];
  EXPECT_EQ(std::memcmp(before.force, after.force, sizeof before.force), 0);

  for (uint32_t site = 4; site < 7; ++site) tools_.hold(1, pal_default_hold(site));
  refuse(2, pal_default_hold(9), PAL_STATUS_CAPACITY_EXCEEDED);
  ToolSession polynomial(pack_.get(), raw_config(pack_, PAL_MODEL_POLYNOMIAL));
  polynomial.hold(0, pal_default_hold(1));
  hold = pal_default_hold(2);
  EXPECT_EQ(pal_tool_hold(polynomial.get(), 1, &hold), PAL_STATUS_MODEL_CANNOT_ANSWER);
}

TEST_F(Tools, InputThatMakesNoSenseIsReplacedByTheLast) {
  tools_.hold(0, pal_default_hold(7));
  const pal_pose good = at({0.01, 0, -0.03});
  const Eigen::Vector3d force = force_of(tools_.frame({good})[0]);
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const auto expect_last = [&](const pal_pose& bad, double dt, double age, const char* what) {
    const pal_tool_result result = tools_.frame_with({bad}, dt, {age})[0];
    EXPECT_EQ(force_of(result), force) << what;
    EXPECT_TRUE(result.flags & PAL_FLAG_BAD_INPUT) << what;
  };
  pal_pose bad = good;
  bad.position[2] = kNan;
  expect_last(bad, 0, 0, "a position that is no number");
  bad.position[2] = HUGE_VAL;
  expect_last(bad, 0, 0, "an infinite position");
  bad = good;
  bad.orientation[0] = 0;
  expect_last(bad, 0, 0, "a quaternion of zeros");
  bad.orientation[3] = kNan;
  expect_last(bad, 0, 0, "a quaternion that is no number");
  bad.orientation[3] = 1.1;
  expect_last(bad, 0, 0, "a quaternion that is too long");
  for (const double dt : {-0.001, 1.5, kNan, HUGE_VAL, -HUGE_VAL}) expect_last(good, dt, 0, "dt");
  for (const double age : {-1.0, kNan, HUGE_VAL}) expect_last(good, 0, age, "age");
  EXPECT_EQ(tools_.frame({good})[0].flags, 0U);
}

TEST_F(Tools, AnyFinitePoseIsAnsweredFinitely) {
  tools_.hold(0, pal_default_hold(7));
  tools_.hold(1, pal_default_hold(2));
  for (const double size : {5e-324, 1e-300, 1e30, 1e150, 1e300, 1.7e308}) {
    for (int signs = 0; signs < 8; ++signs) {
      const Eigen::Vector3d p(signs & 1 ? size : -size, signs & 2 ? size : -size, signs & 4 ? size : -size);
      for (const pal_tool_result& result : tools_.frame({at(p), at(-0.5 * p)})) {
        EXPECT_TRUE(force_of(result).allFinite() && torque_of(result).allFinite() &&
                    stiffness_of(result).allFinite())
            << size;
      }
    }
  }
}

TEST_F(Tools, ResultsMayBeWiderThanOurs) {
  struct Newer {
    pal_tool_result known;
    double unknown[2];
  };
  tools_.hold(1, pal_default_hold(7));
  const std::vector<pal_pose> poses = {at({0, 0, 0}), at({0, 0, -0.02})};
  const auto expected = tools_.frame(poses);
  std::vector<Newer> results(4);
  for (Newer& result : results) result.unknown[0] = result.unknown[1] = 5;
  pal_haptic_input input = tools_.input(poses, 0);
  input.result_bytes = sizeof(Newer);
  ASSERT_EQ(pal_haptic_frame(tools_.get(), &input, &results[0].known), PAL_STATUS_OK);
  for (size_t tool = 0; tool < 4; ++tool) {
    EXPECT_EQ(std::memcmp(&results[tool].known, &expected[tool], sizeof expected[tool]), 0);
    EXPECT_EQ(results[tool].unknown[0], 0);
    EXPECT_EQ(results[tool].unknown[1], 0);
  }
  input.result_bytes = sizeof(pal_tool_result) - 8;
  EXPECT_EQ(pal_haptic_frame(tools_.get(), &input, &results[0].known), PAL_STATUS_BAD_STRUCT_SIZE);
  input.result_bytes = sizeof(pal_tool_result);
  input.num_tools = 5;
  EXPECT_EQ(pal_haptic_frame(tools_.get(), &input, &results[0].known), PAL_STATUS_NO_SUCH_TOOL);
  input.num_tools = 1;
  input.poses = nullptr;
  EXPECT_EQ(pal_haptic_frame(tools_.get(), &input, nullptr), PAL_STATUS_NULL_ARGUMENT);
  input.num_tools = 0;
  EXPECT_EQ(pal_haptic_frame(tools_.get(), &input, nullptr), PAL_STATUS_OK);
}

}  // namespace tools_test
}  // namespace palpate::test::tools_fixture
