// A replay of a recorded session gives the same bits, and finds the frame of any change.
#include <gtest/gtest.h>

#include <cstddef>
#include <cstring>
#include <random>

#include "tests/support/small_pack.hpp"
#include "tests/support/tool_session.hpp"

namespace palpate::test {
namespace recording_test {

constexpr int kFrames = 400;

// 8-byte words, the alignment of a recording.
using Words = std::vector<uint64_t>;

pal_session_config config_of(const OpenPack& pack) {
  pal_session_config config = pal_default_session_config(pack.get());
  config.max_contacts = 4;
  config.max_fixed = 4;
  config.max_force_rate = 500;
  config.organ = pose({1, 2, 3}, {0.3, 0.2, -0.5});
  return config;
}

// Every kind of call on a session, at random.
void play(ToolSession& session, const OpenPack& pack, int frames) {
  std::mt19937_64 random(7);
  const auto any = [&](uint32_t count) { return static_cast<uint32_t>(random() % count); };
  const auto number = [&] { return std::uniform_real_distribution<double>(-0.03, 0.03)(random); };
  const uint32_t sites = pack.info().num_sites;
  for (int frame = 0; frame < frames; ++frame) {
    switch (any(12)) {
      case 0: {
        pal_hold hold = pal_default_hold(any(sites));
        hold.unstrained = pose({1 + number(), 2, 3}, {number(), 0, number()});
        EXPECT_GE(pal_tool_hold(session.get(), any(4), &hold), PAL_STATUS_OK);  // there may be no room
        break;
      }
      case 1:
        require(pal_tool_release(session.get(), any(4)), "release");
        break;
      case 2:
        session.fix(any(2) == 0 ? std::vector<uint32_t>{} : std::vector<uint32_t>{any(9), any(9)});
        break;
      case 3: {
        const pal_contact contacts[2] = {{any(sites),
                                          {number(), number(), number()},
                                          any(2) == 0 ? any(8) : 0,
                                          {number(), 0, number()},
                                          {any(sites), any(sites)},
                                          {any(2) * 0.3, any(2) * 0.4}},
                                         {any(sites), {number(), number(), number()}, 0, {}, {}, {}}};
        pal_contact_result results[2];
        require(pal_contact_frame(session.get(), contacts, any(3), any(2) == 0 ? nullptr : results),
                "contact_frame");
        break;
      }
      case 4: {
        pal_touch touch = {};
        touch.struct_size = sizeof touch;
        touch.distance = 0.01;
        require(pal_tool_set_touch(session.get(), 3, any(2) == 0 ? nullptr : &touch), "touch");
        break;
      }
      default: {
        std::vector<pal_pose> poses;
        std::vector<double> ages;
        for (uint32_t tool = any(5); tool > 0; --tool) {
          poses.push_back(pose({1 + number(), 2 + number(), 3 + number()}, {number(), number(), number()}));
          ages.push_back(any(20) == 0 ? 0.1 : 0.0);
          if (any(30) == 0) poses.back().position[0] = std::nan("");
        }
        session.frame_with(poses, any(30) == 0 ? -1.0 : 0.001, ages);
      }
    }
  }
}

// A recording of such a session.
std::vector<unsigned char> recorded(const OpenPack& pack, size_t capacity, bool expect_complete) {
  ToolSession session(pack.get(), config_of(pack));
  Words buffer(capacity / 8);
  require(pal_session_record(session.get(), buffer.data(), capacity), "record");
  play(session, pack, kFrames);
  size_t bytes = 0;
  uint32_t complete = 7;
  require(pal_session_stop_recording(session.get(), &bytes, &complete), "stop");
  EXPECT_EQ(complete, expect_complete ? 1U : 0U);
  const auto* begin = reinterpret_cast<const unsigned char*>(buffer.data());
  return {begin, begin + bytes};
}

struct Outcome {
  pal_status status = PAL_STATUS_OK;
  pal_replay at = {};
};

Outcome replayed(const OpenPack& pack, const std::vector<unsigned char>& recording) {
  Outcome outcome;
  pal_session_config config = {};
  config.struct_size = sizeof config;
  outcome.status = pal_recording_get_config(recording.data(), recording.size(), &config);
  if (outcome.status != PAL_STATUS_OK) return outcome;
  size_t bytes = 0;
  outcome.status = pal_session_required_bytes(pack.get(), &config, &bytes);
  if (outcome.status != PAL_STATUS_OK) return outcome;
  const OwnedSession session(pack.get(), config);
  outcome.at.struct_size = sizeof outcome.at;
  while (outcome.status == PAL_STATUS_OK && outcome.at.ended == 0 && outcome.at.diverged == 0)
    outcome.status = pal_session_replay(session.get(), recording.data(), recording.size(), &outcome.at);
  return outcome;
}

constexpr size_t kRoom = 1 << 20;

TEST(Recording, ReplaysToTheSameBits) {
  const OpenPack pack(small_pack_bytes());
  const std::vector<unsigned char> recording = recorded(pack, kRoom, true);
  const Outcome outcome = replayed(pack, recording);
  EXPECT_EQ(outcome.status, PAL_STATUS_OK);
  EXPECT_EQ(outcome.at.diverged, 0U) << "frame " << outcome.at.frames << ", index " << outcome.at.index
                                     << ", force " << outcome.at.force[2] << " was "
                                     << outcome.at.recorded_force[2];
  EXPECT_EQ(outcome.at.ended, 1U);
  EXPECT_EQ(outcome.at.offset, recording.size());
  EXPECT_GT(outcome.at.frames, kFrames / 2U);
  EXPECT_GT(outcome.at.seconds, 0.1);
}

TEST(Recording, ChangesNothing) {
  const OpenPack pack(small_pack_bytes());
  ToolSession plain(pack.get(), config_of(pack));
  ToolSession recording(pack.get(), config_of(pack));
  Words buffer(kRoom / 8);
  require(pal_session_record(recording.get(), buffer.data(), kRoom), "record");
  play(plain, pack, kFrames);
  play(recording, pack, kFrames);
  EXPECT_EQ(std::memcmp(plain.last().data(), recording.last().data(), 4 * sizeof plain.last()[0]), 0);
  EXPECT_EQ(plain.field(), recording.field());
}

TEST(Recording, AnotherAnswerIsFoundAtItsFrame) {
  const OpenPack pack(small_pack_bytes());
  ToolSession session(pack.get(), session_config(pack.get(), PAL_MODEL_AUTO, 2, 0));
  Words buffer(kRoom / 8);
  require(pal_session_record(session.get(), buffer.data(), kRoom), "record");
  session.hold(1, pal_default_hold(4));
  size_t place = 0;  // of a force of frame 30, in the recording
  Eigen::Vector3d force;
  for (int frame = 1; frame <= 50; ++frame) {
    force = force_of(session.frame({at_rest(), at({0, 0, -1e-3 * frame})})[1]);
    if (frame != 30) continue;
    double value;
    do {
      std::memcpy(&value, &buffer[++place], sizeof value);
    } while (value != force[2]);
  }
  size_t bytes = 0;
  require(pal_session_stop_recording(session.get(), &bytes, nullptr), "stop");
  auto* begin = reinterpret_cast<unsigned char*>(buffer.data());
  const std::vector<unsigned char> good(begin, begin + bytes);
  EXPECT_EQ(replayed(pack, good).at.diverged, 0U);
  // Another build's recording: a bit of a force differs, and so does the digest.
  buffer[place] ^= 1;
  const size_t digest = place - 2 - 3 - 1;  // from force z of tool 1: tool 0's force, the digest
  buffer[digest] ^= 1;
  const std::vector<unsigned char> changed(begin, begin + bytes);
  const Outcome outcome = replayed(pack, changed);
  EXPECT_EQ(outcome.at.diverged, 1U);
  EXPECT_EQ(outcome.at.frames, 30U);
  EXPECT_EQ(outcome.at.index, 1U);
  EXPECT_NE(outcome.at.force[2], outcome.at.recorded_force[2]);
  EXPECT_NEAR(outcome.at.force[2], outcome.at.recorded_force[2], 1e-12);
}

TEST(Recording, StopsWhereTheBufferIsFull) {
  const OpenPack pack(small_pack_bytes());
  const std::vector<unsigned char> whole = recorded(pack, kRoom, true);
  for (const size_t capacity : {size_t{1000}, size_t{5000}, whole.size() - 8}) {
    const std::vector<unsigned char> cut = recorded(pack, capacity, false);
    EXPECT_LE(cut.size(), capacity);
    EXPECT_TRUE(std::equal(cut.begin(), cut.end(), whole.begin()));
    const Outcome outcome = replayed(pack, cut);
    EXPECT_EQ(outcome.status, PAL_STATUS_OK);
    EXPECT_EQ(outcome.at.ended, 1U);
    EXPECT_EQ(outcome.at.diverged, 0U);
  }
}

TEST(Recording, StartsWithANewSessionOnly) {
  const OpenPack pack(small_pack_bytes());
  ToolSession session(pack.get(), config_of(pack));
  Words buffer(kRoom / 8);
  size_t bytes = 0;
  EXPECT_EQ(pal_session_stop_recording(session.get(), &bytes, nullptr), PAL_STATUS_NOT_RECORDING);
  EXPECT_EQ(pal_session_record(session.get(), reinterpret_cast<unsigned char*>(buffer.data()) + 4, 4000),
            PAL_STATUS_ARENA_MISALIGNED);
  EXPECT_EQ(pal_session_record(session.get(), buffer.data(), 100), PAL_STATUS_CAPACITY_EXCEEDED);
  session.frame({});
  EXPECT_EQ(pal_session_record(session.get(), buffer.data(), kRoom), PAL_STATUS_ALREADY_USED);
}

TEST(Recording, DamageIsRefusedOrFoundAndNeverFollowed) {
  const OpenPack pack(small_pack_bytes());
  const std::vector<unsigned char> good = recorded(pack, kRoom, true);
  std::mt19937_64 random(3);
  int refused = 0;
  int diverged = 0;
  for (int round = 0; round < 2000; ++round) {
    std::vector<unsigned char> bad = good;
    if (round % 4 == 0) bad.resize(random() % bad.size());
    for (int change = 0; change < 3 && !bad.empty(); ++change)
      bad[random() % bad.size()] = static_cast<unsigned char>(random());
    const Outcome outcome = replayed(pack, bad);
    refused += outcome.status != PAL_STATUS_OK;
    diverged += outcome.at.diverged != 0;
  }
  EXPECT_GT(refused, 100);
  EXPECT_GT(diverged, 100);
}

// The config and the sizes of structs in a recording from a file are checked.
TEST(Recording, ChecksItsConfigAndItsSizes) {
  const OpenPack pack(small_pack_bytes());
  ToolSession session(pack.get(), config_of(pack));
  Words buffer(kRoom / 8);
  require(pal_session_record(session.get(), buffer.data(), kRoom), "record");
  pal_touch touch = {};
  touch.struct_size = sizeof touch;
  require(pal_tool_set_touch(session.get(), 0, &touch), "touch");
  size_t bytes = 0;
  require(pal_session_stop_recording(session.get(), &bytes, nullptr), "stop");
  auto* begin = reinterpret_cast<unsigned char*>(buffer.data());
  const std::vector<unsigned char> good(begin, begin + bytes);
  EXPECT_EQ(replayed(pack, good).status, PAL_STATUS_OK);
  std::vector<unsigned char> bad = good;
  constexpr size_t kConfig = 32;
  const double unknown = std::nan("");
  std::memcpy(bad.data() + kConfig + offsetof(pal_session_config, blend_seconds), &unknown, sizeof unknown);
  EXPECT_EQ(replayed(pack, bad).status, PAL_STATUS_BAD_ARGUMENT);
  bad = good;
  const uint32_t large = 4000;
  std::memcpy(bad.data() + bad.size() - sizeof touch, &large, sizeof large);
  EXPECT_EQ(replayed(pack, bad).status, PAL_STATUS_OK);
}

TEST(Recording, BelongsToItsPack) {
  const OpenPack pack(small_pack_bytes());
  const AlignedBytes other_bytes = small_pack().write_with_units();
  const OpenPack other(other_bytes);
  EXPECT_EQ(replayed(other, recorded(pack, kRoom, true)).status, PAL_STATUS_RECORDING_OF_OTHER_PACK);
}

}  // namespace recording_test
}  // namespace palpate::test
