// The force that a tool plays: blended, ramped, limited.
#include <gtest/gtest.h>

#include "tests/support/tools_fixture.hpp"

namespace palpate::test::tools_fixture {
namespace tool_force_test {

constexpr double kFrame = 0.001;

// ---- Between model and device

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

// Contact frames of another caller come between tool frames: the tool's linear response is recomputed and unchanged.
TEST_F(ToolForce, IsNotBlendedWhereOthersAskInBetween) {
  const OpenPack with_zones(zone_pack_bytes());
  pal_session_config config = pal_default_session_config(with_zones.get());
  config.model = PAL_MODEL_LINEAR;
  config.max_contacts = 2;
  ToolSession session(with_zones.get(), config);
  session.hold(0, pal_default_hold(0));
  session.hold(1, pal_default_hold(1));
  const std::vector<pal_pose> poses = {at({0, 0, -0.01}), at({0, 0, -0.005})};
  for (int frame = 0; frame < 40; ++frame) session.frame(poses);
  EXPECT_EQ(session.last()[0].flags & PAL_FLAG_BLENDING, 0U);
  for (int frame = 0; frame < 20; ++frame) {
    session.touch({{6, {0, 0, -0.01}, 0, {}, {}, {}}, {7, {}, 0, {}, {}, {}}});
    EXPECT_EQ(session.frame(poses)[0].flags & PAL_FLAG_BLENDING, 0U);
  }
}

// A deep contact in a zone takes frames to recover after contacts of another caller. The force fades
// meanwhile.
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
  // Poses stop: 50 frames as before, then 20 frames down.
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
  // The caller states the age of the input.
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

// The responding model changes in every frame, and the force still follows the tool.
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
  // A frame that took too long ages the input by a second.
  ToolSession stalled(pack_.get(), config_);
  stalled.hold(0, pal_default_hold(4));
  stalled.frame({at({0, 0, -0.02})});
  stalled.frame_with({}, 1.5, {});
  stalled.frame_with({}, 1.5, {});
  EXPECT_EQ(force_of(stalled.last()[0]).norm(), 0);
  // The limit on the force's rate does not slow the fade of stale input.
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

}  // namespace tool_force_test
}  // namespace palpate::test::tools_fixture
