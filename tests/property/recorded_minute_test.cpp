// Three tools at 1 kHz slide, tap, jump and arrive late, mostly on nonlinear zones. A replay of the recording
// gives every result to the bit.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <random>
#include <string>

#include "tests/support/nightly.hpp"
#include "tests/support/small_pack.hpp"
#include "tests/support/tool_session.hpp"

namespace palpate::test {
namespace recorded_minute_test {

int num_frames() {
  return 1000 * static_cast<int>(rounds_by("PALPATE_RECORDED_SECONDS", 4, 60));
}

pal_session_config minute_config(const OpenPack& pack) {
  pal_session_config config = pal_default_session_config(pack.get());
  config.max_tools = 3;
  config.max_contacts = 3;
  config.max_force = 200;
  config.budget_operations = 200000;  // changed contact sets are prepared over several frames
  return config;
}

struct Played {
  int frames_of_zones = 0;
  int held = 0;                          // number of grasps
  uint32_t flags = 0;                    // union of all flags
  std::vector<pal_tool_result> results;  // of all frames, for three tools
};

// - Tool 0 slides from site to site at a varying depth.
// - Tool 1 taps: down through the surface and off again, each time elsewhere.
// - Tool 2 jumps: grasps any site, moves by any displacement, releases, is away or late.
//
// At times some tissue is stiffer.
Played play_minute(ToolSession& session, const SmallPack& small, int frames) {
  std::mt19937_64 random(11);
  const auto number = [&](double most) {
    return std::uniform_real_distribution<double>(-most, most)(random);
  };
  const auto any_site = [&] { return static_cast<uint32_t>(random() % small.sites.sites.size()); };
  const auto place = [&](uint32_t site) {
    return small.model.positions[static_cast<size_t>(small.sites.sites[site].node)];
  };
  const double depth = small.scene.max_displacement;
  pal_touch touch = {};
  touch.struct_size = sizeof touch;
  touch.distance = 0.002;
  require(pal_tool_set_touch(session.get(), 1, &touch), "touch");
  Eigen::Vector3d slid(0, 0, 0);
  Eigen::Vector3d tapped = place(0);
  Eigen::Vector3d thrown(0, 0, 0);
  Played played;
  for (int frame = 0; frame < frames; ++frame) {
    const double seconds = 0.001 * frame;
    if (frame % 40 == 0) {
      require(pal_tool_release(session.get(), 0), "release");
      pal_hold hold = pal_default_hold(static_cast<uint32_t>(frame / 40 % 12));
      hold.unstrained = at({slid[0], slid[1], 0});  // starts at its current depth
      played.held += pal_tool_hold(session.get(), 0, &hold) == PAL_STATUS_OK ? 1 : 0;
    }
    slid += Eigen::Vector3d(2e-4, 1e-4 * std::sin(seconds), 0);
    slid[2] = -0.5 * depth * (1 + std::sin(9 * seconds));
    const int beat = frame % 130;
    if (beat == 0) tapped = place(any_site()) + Eigen::Vector3d(number(0.02), number(0.02), 0);
    const double down = 0.8 * depth * std::sin(6.2831853 * beat / 130) - 0.005;
    if (frame % 90 == 0) require(pal_tool_release(session.get(), 2), "release");
    if (frame % 90 == 25) {
      thrown = Eigen::Vector3d(number(0.7), number(0.7), number(0.7)) * depth;
      const pal_hold hold = pal_default_hold(any_site());
      played.held += pal_tool_hold(session.get(), 2, &hold) == PAL_STATUS_OK ? 1 : 0;
    }
    if (frame % 300 == 100) {
      const Eigen::Vector3d centre = place(any_site()) - Eigen::Vector3d(0, 0, depth);
      const pal_inclusion inclusion = {sizeof inclusion, 0, {centre[0], centre[1], centre[2]}, 2 * depth, 5};
      require(pal_session_set_inclusion(session.get(), &inclusion), "inclusion");
    }
    if (frame % 300 == 250) require(pal_session_set_inclusion(session.get(), nullptr), "inclusion");
    if (random() % 50 == 0) thrown = Eigen::Vector3d(number(0.7), number(0.7), number(0.7)) * depth;
    std::vector<pal_pose> poses = {at(slid), at(tapped - Eigen::Vector3d(0, 0, down)), at(thrown)};
    if (random() % 40 == 0) poses.resize(2);
    const std::vector<double> ages(poses.size(), random() % 60 == 0 ? 0.2 : 0.0);
    const std::vector<pal_tool_result>& results = session.frame_with(poses, 0.001, ages);
    const bool by_zone = std::any_of(results.begin(), results.end(),
                                     [](const pal_tool_result& one) { return one.model == PAL_MODEL_ZONE; });
    played.frames_of_zones += by_zone ? 1 : 0;
    for (const pal_tool_result& one : results) played.flags |= one.flags;
    played.results.insert(played.results.end(), results.begin(), results.end());
  }
  return played;
}

pal_counters counters_of(const ToolSession& session) {
  pal_counters counters = {};
  counters.struct_size = sizeof counters;
  require(pal_session_get_counters(session.get(), &counters), "counters");
  return counters;
}

TEST(RecordedMinute, ReplaysToTheSameBits) {
  const AlignedBytes bytes = small_pack().write_with_zone();
  const OpenPack pack(bytes);
  const pal_session_config config = minute_config(pack);
  const int frames = num_frames();
  const size_t room = 512 * static_cast<size_t>(frames) + 65536;
  std::vector<uint64_t> recording(room / sizeof(uint64_t));
  ToolSession first(pack.get(), config);
  require(pal_session_record(first.get(), recording.data(), room), "record");
  const Played played = play_minute(first, small_pack(), frames);
  size_t recorded = 0;
  uint32_t complete = 0;
  require(pal_session_stop_recording(first.get(), &recorded, &complete), "stop");
  ASSERT_EQ(complete, 1U);
  // The session did use zones, grasps and flags.
  EXPECT_GT(played.frames_of_zones, frames / 2);
  EXPECT_GT(played.held, frames / 50);
  for (const uint32_t flag :
       {PAL_FLAG_PREPARING, PAL_FLAG_UNCONVERGED, PAL_FLAG_BLENDING, PAL_FLAG_STALE, PAL_FLAG_OVERLAPPING})
    EXPECT_TRUE((played.flags & flag) != 0) << flag;

  // The digest of each frame's results, and each tool's force.
  ToolSession again(pack.get(), config);
  pal_replay replay = {};
  replay.struct_size = sizeof replay;
  while (replay.ended == 0) {
    require(pal_session_replay(again.get(), recording.data(), recorded, &replay), "replay");
    ASSERT_EQ(replay.diverged, 0U) << "frame " << replay.frames << ", tool " << replay.index << ", force "
                                   << replay.force[2] << " was " << replay.recorded_force[2];
  }
  EXPECT_EQ(replay.frames, static_cast<uint64_t>(frames));
  EXPECT_NEAR(replay.seconds, 1e-3 * frames, 1e-6);
  const pal_counters counted = counters_of(first);
  const pal_counters counted_again = counters_of(again);
  EXPECT_EQ(std::memcmp(&counted, &counted_again, sizeof counted), 0);
  EXPECT_EQ(first.field(), again.field());
  RecordProperty("frames", frames);
  RecordProperty("frames_of_zones", played.frames_of_zones);
  RecordProperty("recording_bytes", std::to_string(recorded));
}

// The same calls on another session give every result in full; a replay compares only digests.
TEST(RecordedMinute, IsTheSameInAnotherSession) {
  const AlignedBytes bytes = small_pack().write_with_zone();
  const OpenPack pack(bytes);
  const pal_session_config config = minute_config(pack);
  constexpr int kFrames = 1000;
  ToolSession one(pack.get(), config);
  ToolSession other(pack.get(), config);
  const Played first = play_minute(one, small_pack(), kFrames);
  const Played second = play_minute(other, small_pack(), kFrames);
  ASSERT_EQ(first.results.size(), second.results.size());
  for (size_t i = 0; i < first.results.size(); ++i) {
    ASSERT_EQ(std::memcmp(&first.results[i], &second.results[i], sizeof first.results[i]), 0)
        << "frame " << i / 3 << ", tool " << i % 3;
  }
  EXPECT_EQ(one.field(), other.field());
}

}  // namespace recorded_minute_test
}  // namespace palpate::test
