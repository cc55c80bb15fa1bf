// A haptic frame with a budget prepares a new contact set over several frames. The old set answers meanwhile.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <numbers>

#include "tests/support/small_pack.hpp"
#include "tests/support/tool_session.hpp"
#include "tests/support/zone_block.hpp"

namespace palpate::test {
namespace budget_test {

class Budget : public ::testing::Test {
 protected:
  // A budget of `operations` multiply-adds a frame.
  pal_session_config config_with(uint64_t operations, pal_model model = PAL_MODEL_AUTO) const {
    pal_session_config config = session_config(pack_.get(), model, 4, 4);
    config.budget_operations = operations;
    return config;
  }
  static bool is_preparing(const pal_tool_result& result) { return (result.flags & PAL_FLAG_PREPARING) != 0; }
  static bool same_bits(const pal_tool_result& a, const pal_tool_result& b) {
    return std::memcmp(&a, &b, sizeof a) == 0;
  }

  OpenPack pack_{small_pack_bytes()};
  ToolSession small_{pack_.get(), config_with(1000)};
  ToolSession unbounded_{pack_.get(), session_config(pack_.get(), PAL_MODEL_AUTO, 4, 4)};
  const std::vector<pal_pose> poses_ = {at({0.01, 0, -0.02}), at({0, 0.01, -0.03}), at({0, 0, -0.01})};
};

TEST_F(Budget, ASecondContactJoinsWhenPrepared) {
  for (ToolSession* tools : {&small_, &unbounded_}) tools->hold(0, pal_default_hold(4));
  const pal_tool_result alone = unbounded_.frame(poses_)[0];
  EXPECT_TRUE(same_bits(small_.frame(poses_)[0], alone)) << "a polynomial is always ready";
  for (ToolSession* tools : {&small_, &unbounded_}) tools->hold(1, pal_default_hold(5));
  const std::vector<pal_tool_result> both = unbounded_.frame(poses_);
  EXPECT_NE(force_of(both[0]), force_of(alone)) << "else there is nothing to wait for";
  int frames = 0;
  while (is_preparing(small_.frame(poses_)[1])) {
    ++frames;
    EXPECT_EQ(force_of(small_.last()[0]), force_of(alone)) << "meanwhile the first goes on as before";
    EXPECT_TRUE(is_preparing(small_.last()[0])) << "and says that this is not the last word";
    EXPECT_GT(force_of(small_.last()[1]).norm(), 0) << "as if it were alone";
    EXPECT_EQ(small_.last()[1].model, PAL_MODEL_LINEAR);
    EXPECT_EQ(small_.last()[1].num_contacts, 1U);
    EXPECT_EQ(small_.last()[1].force_error, 1);
    ASSERT_LT(frames, 1000);
  }
  for (size_t tool = 0; tool < 4; ++tool)
    EXPECT_TRUE(same_bits(small_.last()[tool], both[tool])) << "made in pieces or at once";
  EXPECT_EQ(small_.field(), unbounded_.field());
  // Two patches of 5 to 7 nodes with common nodes: n = 24 to 36. Factor and solve take n^3/6 + 6 n^2
  // operations, gathering takes 2 n^2. The last frame does less than its budget.
  EXPECT_GE(frames, 6);
  EXPECT_LE(frames, 18);
}

TEST_F(Budget, TheWorstFrameIsBounded) {
  // A larger budget needs fewer frames: the budget counts work.
  int before = 1 << 30;
  for (const uint64_t operations : {300, 1000, 5000, 1000000}) {
    ToolSession tools(pack_.get(), config_with(operations));
    tools.hold(0, pal_default_hold(4));
    tools.hold(1, pal_default_hold(5));
    int frames = 0;
    while (is_preparing(tools.frame(poses_)[1])) ++frames;
    EXPECT_LT(frames, before) << operations;
    before = frames;
  }
  EXPECT_EQ(before, 0) << "a million is enough";
}

TEST_F(Budget, AReleasedContactStaysUntilTheRestIsPrepared) {
  for (uint32_t tool = 0; tool < 3; ++tool) small_.hold(tool, pal_default_hold(3 * tool));
  while (is_preparing(small_.frame(poses_)[2])) {
  }
  const std::vector<pal_tool_result> three = small_.last();
  require(pal_tool_release(small_.get(), 2), "release");
  int frames = 0;
  unbounded_.hold(0, pal_default_hold(0));
  unbounded_.hold(1, pal_default_hold(3));
  const std::vector<pal_tool_result> two = unbounded_.frame(poses_);
  for (; frames < 1000 && is_preparing(small_.frame(poses_)[0]); ++frames) {
    EXPECT_EQ(force_of(small_.last()[0]), force_of(three[0]));
    EXPECT_EQ(force_of(small_.last()[1]), force_of(three[1]));
    EXPECT_EQ(force_of(small_.last()[2]).norm(), 0) << "it holds nothing any more";
  }
  EXPECT_GE(frames, 3);
  EXPECT_LT(frames, 1000);
  for (size_t tool = 0; tool < 2; ++tool) EXPECT_TRUE(are_alike(small_.last()[tool], two[tool]));
}

TEST_F(Budget, FixedNodesJoinWhenPrepared) {
  small_.hold(0, pal_default_hold(4));
  unbounded_.hold(0, pal_default_hold(4));
  const pal_tool_result before = small_.frame(poses_)[0];
  small_.fix({1, 2, 9});
  unbounded_.fix({1, 2, 9});
  const pal_tool_result after = unbounded_.frame(poses_)[0];
  int frames = 0;
  for (; frames < 1000 && is_preparing(small_.frame(poses_)[0]); ++frames) {
    EXPECT_EQ(force_of(small_.last()[0]), force_of(before));
  }
  EXPECT_GE(frames, 2);
  EXPECT_LT(frames, 1000);
  EXPECT_TRUE(are_alike(small_.last()[0], after));
}

// A third tool grasps and releases all the time. The preparation still ends, and the tools get their
// response.
TEST_F(Budget, ContactsThatChangeAllTheTimeAreAnsweredToo) {
  small_.hold(0, pal_default_hold(4));
  small_.hold(1, pal_default_hold(5));
  int answered = 0;
  for (int frame = 0; frame < 600; ++frame) {
    if (frame % 6 == 3) small_.hold(2, pal_default_hold(9));
    if (frame % 6 == 0) require(pal_tool_release(small_.get(), 2), "release");
    answered += force_of(small_.frame(poses_)[1]).norm() > 0;
  }
  EXPECT_GT(answered, 550);
}

// A device must not feel a switch as a kick: here a tool releases while another set is prepared.
TEST_F(Budget, LettingGoMeanwhileFadesToo) {
  pal_session_config config = config_with(300);
  config.blend_seconds = 0.01;
  ToolSession tools(pack_.get(), config);
  tools.hold(0, pal_default_hold(4));
  tools.hold(1, pal_default_hold(5));
  for (int frame = 0; frame < 100; ++frame) tools.frame(poses_);
  const Eigen::Vector3d before = force_of(tools.last()[0]);
  tools.hold(2, pal_default_hold(9));
  tools.frame(poses_);
  require(pal_tool_release(tools.get(), 0), "release");
  const Eigen::Vector3d after = force_of(tools.frame(poses_)[0]);
  EXPECT_GT(before.norm(), 0);
  EXPECT_LE((after - before).norm(), 0.15 * before.norm());
  EXPECT_TRUE(tools.last()[0].flags & PAL_FLAG_BLENDING);
  // Two switches, each faded over 10 ms: the third contact joins, then the first leaves.
  for (int frame = 0; frame < 24; ++frame) tools.frame(poses_);
  EXPECT_EQ(force_of(tools.last()[0]).norm(), 0);
}

// A tool presses on while its zone is prepared, or comes back out. The tool has not paid for the zone's
// force, so the force must fade in or be reduced, never jump.
TEST(BudgetOfZones, LatePreparationDoesNotKick) {
  const ZoneBlock organ(2, CompressibleNeoHookean{1.0, 4.0});
  struct Felt {
    double largest = 0;
    double step = 0;
  };
  const auto press = [&](uint64_t operations) {
    pal_session_config config = session_config(organ.pack->get(), PAL_MODEL_ZONE, 1, 0);
    config.budget_operations = operations;
    config.blend_seconds = 0.01;
    ToolSession tools(organ.pack->get(), config);
    Felt felt;
    Eigen::Vector3d before = Eigen::Vector3d::Zero();
    constexpr int kPeriod = 150;
    for (int frame = 0; frame < 3 * 2 * kPeriod; ++frame) {
      const int phase = frame % (2 * kPeriod);
      if (phase == 0) {
        if (frame > 0) require(pal_tool_release(tools.get(), 0), "release");
        tools.hold(0, pal_default_hold(frame / (2 * kPeriod) % 2 == 0 ? 0 : 8));
      }
      const double depth = phase < kPeriod ? 0.1 * std::sin(std::numbers::pi * phase / kPeriod) : 0.0;
      const Eigen::Vector3d force = force_of(tools.frame({at({0, 0, -depth})})[0]);
      felt.step = std::max(felt.step, (force - before).norm());
      felt.largest = std::max(felt.largest, force.norm());
      before = force;
    }
    return felt;
  };
  const Felt ready = press(1000000000);
  for (uint64_t operations = 20000; operations < 1000000; operations += operations / 3) {
    SCOPED_TRACE(operations);
    EXPECT_LE(press(operations).step, 0.25 * ready.largest);  // the blend's cubic rises by 0.15 a frame
  }
}

// Contact frames with the same contacts, over and over, leave the tools their share of the budget.
TEST_F(Budget, ContactFramesBetweenDoNotStarveTools) {
  small_.hold(0, pal_default_hold(4));
  small_.hold(1, pal_default_hold(5));
  const std::vector<pal_contact> others = {{1, {0, 0, -0.01}, 0, {}, {}, {}},
                                           {8, {0, 0, -0.01}, 0, {}, {}, {}}};
  int answered = 0;
  for (int frame = 0; frame < 200; ++frame) {
    small_.touch(others);
    answered += force_of(small_.frame(poses_)[1]).norm() > 0;
  }
  EXPECT_GT(answered, 150);
}

// A change during preparation waits for its turn. A contact frame in between replaces the prepared set.
TEST_F(Budget, InterruptionsDelayButDoNotMislead) {
  small_.hold(0, pal_default_hold(4));
  small_.hold(1, pal_default_hold(5));
  for (int frame = 0; frame < 5; ++frame) small_.frame(poses_);
  small_.hold(2, pal_default_hold(9));
  for (int frame = 0; frame < 300; ++frame) {
    for (const pal_tool_result& result : small_.frame(poses_)) EXPECT_TRUE(force_of(result).allFinite());
    if (frame % 100 == 7) {
      const std::vector<pal_contact> others = {{1, {0, 0, -0.01}, 0, {}, {}, {}},
                                               {8, {0, 0, -0.01}, 0, {}, {}, {}}};
      OwnedSession alone(pack_.get(), PAL_MODEL_AUTO, 4, 4);
      const auto expected = alone.touch(others);
      const auto answer = small_.touch(others);
      for (size_t c = 0; c < 2; ++c) EXPECT_TRUE(are_alike(answer[c], expected[c]));
    }
  }
  for (uint32_t tool = 0; tool < 3; ++tool) unbounded_.hold(tool, pal_default_hold(tool == 2 ? 9 : 4 + tool));
  const auto expected = unbounded_.frame(poses_);
  for (size_t tool = 0; tool < 3; ++tool) EXPECT_TRUE(are_alike(small_.last()[tool], expected[tool])) << tool;
}

TEST_F(Budget, ReplaysToTheSameBits) {
  std::vector<uint64_t> buffer(1 << 16);
  require(pal_session_record(small_.get(), buffer.data(), buffer.size() * 8), "record");
  for (int frame = 0; frame < 200; ++frame) {
    if (frame % 60 == 10) small_.hold(0, pal_default_hold(4));
    if (frame % 60 == 20) small_.hold(1, pal_default_hold(static_cast<uint32_t>(frame) % 12));
    if (frame % 60 == 50) {
      require(pal_tool_release(small_.get(), 0), "release");
      require(pal_tool_release(small_.get(), 1), "release");
    }
    small_.frame(poses_);
  }
  size_t bytes = 0;
  require(pal_session_stop_recording(small_.get(), &bytes, nullptr), "stop");
  pal_session_config config = {};
  config.struct_size = sizeof config;
  require(pal_recording_get_config(buffer.data(), bytes, &config), "config");
  OwnedSession again(pack_.get(), config);
  pal_replay replay = {};
  replay.struct_size = sizeof replay;
  while (replay.ended == 0) {
    require(pal_session_replay(again.get(), buffer.data(), bytes, &replay), "replay");
    ASSERT_EQ(replay.diverged, 0U) << replay.frames;
  }
  EXPECT_EQ(replay.frames, 200U);
}

TEST_F(Budget, CountersCount) {
  pal_counters counters = {};
  counters.struct_size = sizeof counters;
  small_.hold(0, pal_default_hold(4));
  small_.frame(poses_);
  small_.hold(1, pal_default_hold(5));
  uint64_t preparing = 0;
  while (is_preparing(small_.frame(poses_)[1])) ++preparing;
  small_.frame_with({at({std::nan(""), 0, 0})}, 0.001, {});
  small_.frame({at({0, 0, -0.2}), at({0, 0, 0})});
  require(pal_session_get_counters(small_.get(), &counters), "counters");
  EXPECT_EQ(counters.frames, preparing + 4);
  EXPECT_EQ(counters.preparing, preparing);
  EXPECT_EQ(counters.switches, 3U) << "two contacts taken hold of, and the second one ready";
  EXPECT_EQ(counters.bad_input, 1U);
  EXPECT_EQ(counters.extrapolated, 1U);
  EXPECT_EQ(counters.limited, 0U);
  counters.struct_size = 4;
  EXPECT_EQ(pal_session_get_counters(small_.get(), &counters), PAL_STATUS_BAD_STRUCT_SIZE);
  EXPECT_EQ(pal_session_get_counters(nullptr, &counters), PAL_STATUS_NULL_ARGUMENT);
}

}  // namespace budget_test
}  // namespace palpate::test
