// Tools: rigid motion of what they hold, forces and torques in the world, and what comes between model and
// device.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>

#include "tests/support/runtime_session.hpp"
#include "tests/support/small_pack.hpp"
#include "tests/support/tool_session.hpp"

namespace palpate::test {
namespace {

// Sums of a few products of doubles near 1, of displacements near 0.05.
constexpr double kRounding = 1e-12;
constexpr double kFrame = 0.001;

Eigen::Vector3d site_position(const OpenPack& pack, uint32_t site) {
  uint32_t node = 0;
  require(pal_pack_get_site_node(pack.get(), site, &node), "site node");
  return Eigen::Map<const Eigen::Vector3d>(pack.face().geometry().positions + size_t{3} * node);
}

pal_session_config raw_config(const OpenPack& pack, pal_model model = PAL_MODEL_AUTO) {
  return session_config(pack.get(), model, 4, 4);
}

class Tools : public ::testing::Test {
 protected:
  OpenPack pack_{small_pack_bytes()};
  ToolSession tools_{pack_.get(), raw_config(pack_)};
  OwnedSession contacts_{pack_.get(), PAL_MODEL_AUTO, 4, 4};
};

void expect_near(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b, double tolerance, const char* what) {
  EXPECT_LE((a - b).norm(), tolerance * (b.norm() + 1e-3)) << what << "\n" << a << "\nagainst\n" << b;
}

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

// Two sites of one tool: each moves by (p - p0) + (R R0^T - 1)(x - p0).
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

// d force / d position, of tools with one contact and with two.
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

// The organ placed elsewhere and turned, and the tools with it: the same answer, turned.
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

TEST_F(Tools, WhatCannotBeHeldIsRefusedAndNothingChanges) {
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

// ---- touching

class Touch : public Tools {
 protected:
  static pal_touch touch(pal_contact_law law, double distance = 0) {
    pal_touch touch = {};
    touch.struct_size = sizeof touch;
    touch.law = law;
    touch.distance = distance;
    return touch;
  }
  void set(ToolSession& tools, uint32_t tool, const pal_touch& touch) {
    require(pal_tool_set_touch(tools.get(), tool, &touch), "touch");
  }
  // A little beside the site, so that it is the nearest corner and the point lies in a triangle.
  pal_pose above(double height) const {
    return at(site_position(pack_, site_) + Eigen::Vector3d(0.011, 0.017, height));
  }
  const uint32_t site_ = small_pack().site_at(55);
};

TEST_F(Touch, HoldsWhatItMeetsAndLetsGoOutside) {
  set(tools_, 1, touch(PAL_LAW_TOUCH));
  const auto frame = [&](double height) { return tools_.frame({at({0, 0, 9}), above(height)})[1]; };
  for (const double height : {0.1, 0.01, 1e-9}) EXPECT_EQ(frame(height).num_contacts, 0U) << height;
  const pal_tool_result met = frame(-0.001);
  EXPECT_EQ(met.num_contacts, 1U);
  EXPECT_EQ(met.site, site_);
  EXPECT_LE(force_of(met).norm(), kRounding) << "unstrained where it was met";
  pal_surface_point place;
  require(pal_pack_find_surface_point(pack_.get(), above(0).position, &place), "surface point");
  const Eigen::Vector3d d(0, 0, -0.03);
  const pal_contact_result expected = contacts_.touch({pal_contact_at(&place, d.data())})[0];
  expect_near(force_of(frame(-0.031)), Eigen::Vector3d(expected.force), 1e-9, "pressed");
  EXPECT_EQ(frame(-0.0011).num_contacts, 1U);
  EXPECT_EQ(frame(0.0002).num_contacts, 1U) << "within the tremor of a hand";
  EXPECT_EQ(frame(0.002).num_contacts, 0U);
  EXPECT_EQ(force_of(tools_.last()[1]).norm(), 0);
}

// Deep at once, as fast tools are: held there until it has come out beyond that, and not again before it was
// outside.
TEST_F(Touch, AFastToolLetsGoOnce) {
  set(tools_, 0, touch(PAL_LAW_TOUCH));
  tools_.frame({above(0.1)});
  int changes = 0;
  uint32_t before = 0;
  for (int frame = 0; frame < 60; ++frame) {
    const uint32_t now = tools_.frame({above(-0.04 + 0.001 * frame)})[0].num_contacts;
    changes += now != before;
    before = now;
  }
  EXPECT_EQ(changes, 2);
  EXPECT_EQ(before, 0U);
  EXPECT_EQ(tools_.frame({above(-0.01)})[0].num_contacts, 1U) << "it was outside";
  require(pal_tool_release(tools_.get(), 0), "release");
  EXPECT_EQ(tools_.frame({above(-0.01)})[0].num_contacts, 0U) << "released means released";
}

TEST_F(Touch, LetsGoWhereverItComesOut) {
  set(tools_, 0, touch(PAL_LAW_TOUCH));
  tools_.frame({above(0.01)});
  ASSERT_EQ(tools_.frame({above(-0.001)})[0].num_contacts, 1U);
  // Through the block and out of its side, far below where it came in.
  const Eigen::Vector3d inside(above(-0.1).position);
  ASSERT_EQ(tools_.frame({at(inside)})[0].num_contacts, 1U);
  EXPECT_EQ(tools_.frame({at(inside + Eigen::Vector3d(5, 0, 0))})[0].num_contacts, 0U);
  EXPECT_EQ(tools_.frame({above(-0.2)})[0].num_contacts, 0U) << "too deep to have just come in";
}

TEST_F(Touch, BondedItStays) {
  set(tools_, 0, touch(PAL_LAW_BONDED));
  tools_.frame({above(-0.001)});
  const pal_tool_result pulled = tools_.frame({above(0.02)})[0];
  EXPECT_EQ(pulled.num_contacts, 1U);
  EXPECT_GT(pulled.force[2], 0) << "pulling takes an outward force";
  require(pal_tool_release(tools_.get(), 0), "release");
  EXPECT_EQ(tools_.frame({above(0.02)})[0].num_contacts, 0U);
}

TEST_F(Touch, CountsFromTheTipAndItsRadius) {
  pal_touch with_tip = touch(PAL_LAW_TOUCH, 0.02);
  with_tip.tip[0] = 0.3;  // the tool stands on its side
  set(tools_, 0, with_tip);
  const Eigen::Vector3d down(0, M_PI / 2, 0);  // turns x to -z
  const auto frame = [&](double tip_height) {
    const Eigen::Vector3d tip = Eigen::Vector3d(above(tip_height).position);
    return tools_.frame({pose(tip + Eigen::Vector3d(0, 0, 0.3), down)})[0];
  };
  EXPECT_EQ(frame(0.021).num_contacts, 0U);
  EXPECT_EQ(frame(0.019).num_contacts, 1U);
}

TEST_F(Touch, SaysWhenThereIsNoRoom) {
  ToolSession tools(pack_.get(), session_config(pack_.get(), PAL_MODEL_AUTO, 1, 0));
  set(tools, 0, touch(PAL_LAW_TOUCH));
  set(tools, 1, touch(PAL_LAW_TOUCH));
  const auto results = tools.frame({above(-0.001), above(-0.002)});
  EXPECT_EQ(results[0].num_contacts, 1U);
  EXPECT_EQ(results[1].num_contacts, 0U);
  EXPECT_TRUE(results[1].flags & PAL_FLAG_NO_ROOM);
  EXPECT_FALSE(results[0].flags & PAL_FLAG_NO_ROOM);
}

TEST_F(Touch, WhatMakesNoSenseIsRefused) {
  pal_touch bad = touch(PAL_LAW_TOUCH);
  bad.tip[1] = std::nan("");
  EXPECT_EQ(pal_tool_set_touch(tools_.get(), 0, &bad), PAL_STATUS_NOT_FINITE);
  bad = touch(PAL_LAW_TOUCH, HUGE_VAL);
  EXPECT_EQ(pal_tool_set_touch(tools_.get(), 0, &bad), PAL_STATUS_NOT_FINITE);
  bad = touch(PAL_LAW_TOUCH);
  bad.struct_size = 4;
  EXPECT_EQ(pal_tool_set_touch(tools_.get(), 0, &bad), PAL_STATUS_BAD_STRUCT_SIZE);
  EXPECT_EQ(pal_tool_set_touch(nullptr, 0, nullptr), PAL_STATUS_NULL_ARGUMENT);
  EXPECT_EQ(tools_.frame({above(-0.01)})[0].num_contacts, 0U);
}

TEST_F(Touch, FindsSurfacePointsInTheOrgansFrame) {
  const Eigen::Vector3d x(above(0.04).position);
  pal_surface_point point;
  ASSERT_EQ(pal_pack_find_surface_point(pack_.get(), x.data(), &point), PAL_STATUS_OK);
  EXPECT_NEAR(point.distance, 0.04, kRounding);
  EXPECT_NEAR(point.normal[2], 1, 1e-6);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int i = 0; i < 3; ++i) sum += point.weights[i] * site_position(pack_, point.sites[i]);
  expect_near(sum, Eigen::Vector3d(point.position), kRounding, "the weighted corners");
  const Eigen::Vector3d nowhere(0, std::nan(""), 0);
  EXPECT_EQ(pal_pack_find_surface_point(pack_.get(), nowhere.data(), &point), PAL_STATUS_NOT_FINITE);
  const Eigen::Vector3d far(0, 1e90, 0);
  EXPECT_EQ(pal_pack_find_surface_point(pack_.get(), far.data(), &point), PAL_STATUS_BAD_ARGUMENT);
}

// ---- between model and device

class ToolForce : public Tools {
 protected:
  static constexpr double kBlend = 0.01;
  pal_session_config config_ = raw_config(pack_);
};

TEST_F(ToolForce, NeverJumpsWhenWhatAnswersChanges) {
  config_.blend_seconds = kBlend;
  ToolSession tools(pack_.get(), config_);
  ToolSession raw(pack_.get(), raw_config(pack_));
  std::vector<Eigen::Vector3d> blended;
  std::vector<Eigen::Vector3d> model;
  int blending = 0;
  double largest = 0;
  const auto both = [&](auto&& call) {
    call(tools);
    call(raw);
  };
  for (int frame = 0; frame < 200; ++frame) {
    if (frame == 5) both([](ToolSession& t) { t.hold(0, pal_default_hold(4)); });   // strained at once
    if (frame == 40) both([](ToolSession& t) { t.hold(1, pal_default_hold(5)); });  // polynomial -> linear
    if (frame == 80) both([](ToolSession& t) { require(pal_tool_release(t.get(), 1), "release"); });
    if (frame == 120) both([](ToolSession& t) { t.fix({1, 2}); });
    if (frame == 124) both([](ToolSession& t) { t.fix({}); });  // in the middle of a blend
    if (frame == 160) both([](ToolSession& t) { require(pal_tool_release(t.get(), 0), "release"); });
    const std::vector<pal_pose> poses = {at({0.01, 0, -0.04}), at({0, 0, -0.03})};
    const pal_tool_result result = tools.frame(poses)[0];
    blended.push_back(force_of(result));
    model.push_back(force_of(raw.frame(poses)[0]));
    blending += (result.flags & PAL_FLAG_BLENDING) != 0;
    largest = std::max(largest, model.back().norm());
  }
  double model_jump = 0;
  double jump = 0;
  for (size_t frame = 1; frame < blended.size(); ++frame) {
    model_jump = std::max(model_jump, (model[frame] - model[frame - 1]).norm());
    jump = std::max(jump, (blended[frame] - blended[frame - 1]).norm());
  }
  EXPECT_GE(model_jump, 0.5 * largest) << "else there is nothing to blend";
  // The cubic's steepest slope is 3/2.
  EXPECT_LE(jump, 1.5 * kFrame / kBlend * model_jump * 1.001);
  EXPECT_GE(blending, 40);
  EXPECT_LE(blending, 60) << "six changes of ten frames";
  for (const size_t frame : {39u, 79u, 119u, 159u, 199u})
    EXPECT_EQ(blended[frame], model[frame]) << "the model's own, once blended";
}

// Frames of contacts of their own between those of tools: the tool's answer is made anew, and is what it was.
TEST_F(ToolForce, IsNotBlendedWhereOthersAskInBetween) {
  for (const pal_model model : {PAL_MODEL_LINEAR, PAL_MODEL_ZONE}) {
    const OpenPack with_zones(zone_pack_bytes());
    pal_session_config config = pal_default_session_config(with_zones.get());
    config.model = model;
    config.max_contacts = 2;
    ToolSession session(with_zones.get(), config);
    session.hold(0, pal_default_hold(0));
    session.hold(1, pal_default_hold(1));
    const std::vector<pal_pose> poses = {at({0, 0, -0.01}), at({0, 0, -0.005})};
    for (int frame = 0; frame < 40; ++frame) session.frame(poses);
    EXPECT_EQ(session.last()[0].flags & PAL_FLAG_BLENDING, 0U);
    for (int frame = 0; frame < 20; ++frame) {
      session.touch({{6, {0, 0, -0.01}, 0, {}, {}, {}}, {7, {}, 0, {}, {}, {}}});
      EXPECT_EQ(session.frame(poses)[0].flags & PAL_FLAG_BLENDING, 0U) << model;
    }
  }
}

// One that is deeper than a zone follows in a frame: what it has to catch up with after contacts of others is faded.
TEST_F(ToolForce, DoesNotJumpWhereOthersAskInBetween) {
  const OpenPack with_zones(zone_pack_bytes());
  pal_session_config config = pal_default_session_config(with_zones.get());
  config.model = PAL_MODEL_ZONE;
  ToolSession session(with_zones.get(), config);
  session.hold(0, pal_default_hold(0));
  const double depth = 1.2 * with_zones.info().mean_surface_edge;
  for (int frame = 0; frame <= 200; ++frame)
    session.frame({at({0, 0, -depth * std::min(1.0, frame / 100.0)})});
  const Eigen::Vector3d before = force_of(session.last()[0]);
  session.touch({{6, {0, 0, -0.01}, 0, {}, {}, {}}});
  Eigen::Vector3d last = before;
  for (int frame = 0; frame < 40; ++frame) {
    session.frame({at({0, 0, -depth})});
    EXPECT_LE((force_of(session.last()[0]) - last).norm(), 0.2 * before.norm()) << frame;
    last = force_of(session.last()[0]);
  }
  EXPECT_LE((last - before).norm(), 0.01 * before.norm());
}

TEST_F(ToolForce, RampsToZeroWhenInputIsStale) {
  config_.stale_seconds = 0.0505;  // between two frames
  config_.ramp_seconds = 0.02;
  ToolSession tools(pack_.get(), config_);
  tools.hold(0, pal_default_hold(4));
  const double full = force_of(tools.frame({at({0, 0, -0.03})})[0]).norm();
  // Poses stop coming: 50 frames as before, then 20 frames down.
  for (int frame = 1; frame <= 100; ++frame) {
    const pal_tool_result result = tools.frame({})[0];
    const double expected = full * std::clamp(1.0 - (frame - 50) / 20.0, 0.0, 1.0);
    EXPECT_NEAR(force_of(result).norm(), expected, 0.051 * full) << frame;
    EXPECT_EQ((result.flags & PAL_FLAG_STALE) != 0, frame > 50 && expected < 1.001 * full) << frame;
  }
  EXPECT_EQ(force_of(tools.last()[0]).norm(), 0);
  for (int frame = 1; frame <= 20; ++frame) {
    const double force = force_of(tools.frame({at({0, 0, -0.03})})[0]).norm();
    EXPECT_NEAR(force, full * frame / 20.0, 1e-9 * full);
  }
  EXPECT_EQ(tools.last()[0].flags, 0U);
  // The caller says how old it is.
  EXPECT_TRUE(tools.frame_with({at({0, 0, -0.03})}, kFrame, {0.06})[0].flags & PAL_FLAG_STALE);
}

TEST_F(ToolForce, StaysWithinItsLimits) {
  config_.max_force_rate = 2.0;
  ToolSession tools(pack_.get(), config_);
  const double full = force_of(tools_.frame({at({0, 0, 0})})[0]).norm();
  EXPECT_EQ(full, 0);
  tools_.hold(0, pal_default_hold(4));
  const Eigen::Vector3d model = force_of(tools_.frame({at({0, 0, -0.04})})[0]);
  tools.hold(0, pal_default_hold(4));
  Eigen::Vector3d last = Eigen::Vector3d::Zero();
  for (int frame = 0; frame < 1000 && last != model; ++frame) {
    const pal_tool_result result = tools.frame({at({0, 0, -0.04})})[0];
    const double step = (force_of(result) - last).norm();
    EXPECT_LE(step, 2.0 * kFrame * (1 + kRounding));
    if (result.flags & PAL_FLAG_LIMITED) {
      EXPECT_NEAR(step, 2.0 * kFrame, kRounding);
    }
    last = force_of(result);
  }
  EXPECT_EQ(last, model);

  config_.max_force_rate = HUGE_VAL;
  config_.max_force = 0.5 * model.norm();
  ToolSession weak(pack_.get(), config_);
  weak.hold(0, pal_default_hold(4));
  const pal_tool_result cut = weak.frame({at({0, 0, -0.04})})[0];
  EXPECT_TRUE(cut.flags & PAL_FLAG_LIMITED);
  expect_near(force_of(cut), 0.5 * model, kRounding, "cut to half");
  EXPECT_EQ(weak.frame({at({0, 0, -0.001})})[0].flags, 0U);
}

TEST_F(ToolForce, ATwistIsLimitedToo) {
  const auto twist = [](ToolSession& tools) {
    tools.hold(0, pal_default_hold(2));
    tools.hold(0, pal_default_hold(9));
    pal_tool_result result = {};
    for (int frame = 0; frame < 50; ++frame) result = tools.frame({pose({0.2, 0.2, 0}, {0, 0, 0.1})})[0];
    return result;
  };
  const pal_tool_result free = twist(tools_);
  ASSERT_GT(torque_of(free).norm(), 0);
  config_.max_torque = 0.5 * torque_of(free).norm();
  config_.max_torque_rate = 20 * torque_of(free).norm();
  ToolSession tools(pack_.get(), config_);
  const pal_tool_result cut = twist(tools);
  EXPECT_NEAR(torque_of(cut).norm(), config_.max_torque, kRounding);
  EXPECT_TRUE(cut.flags & PAL_FLAG_LIMITED);
  require(pal_tool_release(tools.get(), 0), "release");
  EXPECT_NEAR(torque_of(tools.frame({at_rest()})[0]).norm(),
              config_.max_torque - kFrame * config_.max_torque_rate, 1e-9);
}

// What answers changes in every frame, and the force still follows the tool.
TEST_F(ToolForce, FollowsThroughSwitchesWithoutEnd) {
  config_.blend_seconds = kBlend;
  ToolSession tools(pack_.get(), config_);
  ToolSession raw(pack_.get(), raw_config(pack_));
  for (ToolSession* one : {&tools, &raw}) one->hold(0, pal_default_hold(4));
  double worst = 0;
  for (uint32_t frame = 0; frame < 400; ++frame) {
    for (ToolSession* one : {&tools, &raw}) one->fix({frame % 2 == 0 ? 1u : 2u});
    const pal_pose pushed = at({0, 0, -0.04 * std::min(1.0, frame / 200.0)});
    const double now = force_of(tools.frame({pushed})[0]).norm();
    const double model = force_of(raw.frame({pushed})[0]).norm();
    if (frame > 300) worst = std::max(worst, std::abs(now - model) / model);
  }
  EXPECT_LT(worst, 0.2) << "a frozen force would be off by all of it";
}

TEST_F(ToolForce, StaleInputCountsWhetherItHoldsOrNot) {
  config_.stale_seconds = 0.05;
  config_.ramp_seconds = 0.05;
  ToolSession tools(pack_.get(), config_);
  tools.frame({at({0, 0, -0.02})});
  for (int frame = 0; frame < 200; ++frame) tools.frame({});
  tools.hold(0, pal_default_hold(4));
  EXPECT_EQ(force_of(tools.frame({})[0]).norm(), 0) << "its pose is 0.2 s old";
  EXPECT_EQ(tools.last()[1].flags, 0U) << "a tool that was never seen is not stale";
  // Frames that took too long age input by a second.
  ToolSession stalled(pack_.get(), config_);
  stalled.hold(0, pal_default_hold(4));
  stalled.frame({at({0, 0, -0.02})});
  stalled.frame_with({}, 1.5, {});
  stalled.frame_with({}, 1.5, {});
  EXPECT_EQ(force_of(stalled.last()[0]).norm(), 0);
  // The rate of the force does not hold the fading back.
  config_.max_force_rate = 1e-3;
  ToolSession slow(pack_.get(), config_);
  slow.hold(0, pal_default_hold(4));
  for (int frame = 0; frame < 100; ++frame) slow.frame({at({0, 0, -0.02})});
  EXPECT_GT(force_of(slow.last()[0]).norm(), 0);
  for (int frame = 0; frame < 101; ++frame) slow.frame({});
  EXPECT_EQ(force_of(slow.last()[0]).norm(), 0);
}

TEST_F(ToolForce, LimitsThatAreNoneAreRefused) {
  const auto refuse = [&](double pal_session_config::*limit, double bad) {
    pal_session_config config = config_;
    config.*limit = bad;
    size_t bytes = 0;
    EXPECT_EQ(pal_session_required_bytes(pack_.get(), &config, &bytes), PAL_STATUS_BAD_ARGUMENT) << bad;
  };
  for (double pal_session_config::*time :
       {&pal_session_config::blend_seconds, &pal_session_config::stale_seconds,
        &pal_session_config::ramp_seconds}) {
    for (const double bad : {-1.0, std::nan(""), HUGE_VAL}) refuse(time, bad);
  }
  for (double pal_session_config::*limit :
       {&pal_session_config::max_force, &pal_session_config::max_force_rate, &pal_session_config::max_torque,
        &pal_session_config::max_torque_rate}) {
    for (const double bad : {-1.0, std::nan("")}) refuse(limit, bad);
  }
  pal_session_config config = config_;
  config.max_tools = 17;
  size_t bytes = 0;
  EXPECT_EQ(pal_session_required_bytes(pack_.get(), &config, &bytes), PAL_STATUS_BAD_ARGUMENT);
  config = config_;
  config.organ.orientation[0] = 0.5;
  EXPECT_EQ(pal_session_required_bytes(pack_.get(), &config, &bytes), PAL_STATUS_BAD_ARGUMENT);
}

}  // namespace
}  // namespace palpate::test
