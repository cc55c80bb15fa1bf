// A device's default safety: forces within a bound from the pack. A frame whose force may be anything plays
// the last good force, fading.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "runtime/src/tools/force_output.hpp"
#include "tests/support/small_pack.hpp"
#include "tests/support/tool_session.hpp"
#include "tests/support/zone_block.hpp"

namespace palpate::test {
namespace safe_force_test {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kFrame = 0.001;

// What a tool plays for a force of the model.
uint32_t play(const pal_session_config& config, Wrench wrench, bool reliable, bool stale,
              ForceOutput& output) {
  const uint32_t flags = blend_force(config, reliable, false, stale, kFrame, wrench, output);
  return flags | limit_force(config, flags == 0, stale, kFrame, wrench, output);
}
constexpr double kRounding = 1e-12;

pal_session_config completed(const pal_pack* pack, const pal_session_config& config) {
  const OwnedSession session(pack, config);
  pal_session_config complete = {};
  complete.struct_size = sizeof complete;
  require(pal_session_get_config(session.get(), &complete), "config");
  return complete;
}

// The bound: the largest force at max_displacement, from small displacements along each axis.
TEST(SafeForce, DefaultBoundFollowsFromThePack) {
  const OpenPack pack(small_pack_bytes());
  const pal_session_config config = pal_default_session_config(pack.get());
  EXPECT_TRUE(config.max_force > 0 && std::isfinite(config.max_force));
  EXPECT_DOUBLE_EQ(config.max_force_rate, config.max_force / 0.01);
  EXPECT_EQ(config.max_torque, kInfinity);
  OwnedSession session(pack.get(), PAL_MODEL_LINEAR);
  double largest = 0;
  for (uint32_t site = 0; site < pack.info().num_sites; ++site) {
    const pal_contact_result at_rest = session.touch({{site, {0, 0, 0}, 0, {}, {}, {}}})[0];
    largest = std::max(largest, Eigen::Map<const Eigen::Matrix3d>(at_rest.stiffness[0]).norm());
  }
  EXPECT_NEAR(config.max_force, 5 * pack.info().max_displacement * largest, 1e-6 * config.max_force);
}

TEST(SafeForce, ZeroIsTheDefaultAndInfinityIsNoLimit) {
  const OpenPack pack(small_pack_bytes());
  const pal_session_config usual = pal_default_session_config(pack.get());
  EXPECT_EQ(pal_default_session_config(nullptr).max_force, 0);
  pal_session_config config = usual;
  config.max_force = config.max_force_rate = config.max_torque = config.max_torque_rate = 0;
  const pal_session_config of_zero = completed(pack.get(), config);
  config.max_force = 0.5 * usual.max_force;
  const pal_session_config stated = completed(pack.get(), config);
  config.max_force = kInfinity;
  const pal_session_config none = completed(pack.get(), config);
  EXPECT_EQ(of_zero.max_force, usual.max_force);
  EXPECT_EQ(stated.max_force, 0.5 * usual.max_force);
  EXPECT_EQ(none.max_force, kInfinity);
  EXPECT_EQ(of_zero.max_force_rate, usual.max_force_rate);
  EXPECT_EQ(none.max_force_rate, usual.max_force_rate);
  EXPECT_DOUBLE_EQ(stated.max_force_rate, 0.5 * usual.max_force_rate);
  for (const pal_session_config& one : {of_zero, stated, none}) {
    EXPECT_EQ(one.max_torque, kInfinity);
    EXPECT_EQ(one.max_torque_rate, kInfinity);
  }
}

struct Felt {
  double largest = 0;       // force of any tool in any frame
  double largest_step = 0;  // between two frames
  int held = 0;             // frames
  bool silent_at_the_end = false;
};

// Pushes tools on two neighbours through each other, and holds them there.
Felt crush(const ZoneBlock& organ, pal_session_config config) {
  config.model = PAL_MODEL_ZONE;
  config.max_contacts = 2;
  const uint32_t sites[] = {4, 5};
  const auto place_of = [&](uint32_t site) -> Eigen::Vector3d {
    return organ.block.model.positions[static_cast<size_t>(organ.block.sites.sites[site].node)];
  };
  const Eigen::Vector3d way =
      3 * organ.block.sites.mean_surface_edge * (place_of(sites[1]) - place_of(sites[0])).normalized();
  ToolSession session(organ.pack->get(), config);
  for (uint32_t tool = 0; tool < 2; ++tool) session.hold(tool, pal_default_hold(sites[tool]));
  Felt felt;
  Eigen::Vector3d last[2] = {Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  for (int frame = 1; frame <= 500; ++frame) {
    const double part = std::min(1.0, frame / 300.0);
    const auto& results = session.frame({at(part * way), at(-part * way)});
    felt.silent_at_the_end = true;
    for (size_t tool = 0; tool < 2; ++tool) {
      const Eigen::Vector3d force = force_of(results[tool]);
      const bool is_held = (results[tool].flags & PAL_FLAG_HELD) != 0;
      felt.largest = std::max(felt.largest, force.norm());
      felt.largest_step = std::max(felt.largest_step, (force - last[tool]).norm());
      felt.held += is_held ? 1 : 0;
      felt.silent_at_the_end = felt.silent_at_the_end && is_held && force.norm() == 0;
      EXPECT_TRUE(!is_held || stiffness_of(results[tool]).isZero(0));
      last[tool] = force;
    }
  }
  return felt;
}

TEST(SafeForce, JammedContactsStayWithinTheDefaultBound) {
  const ZoneBlock organ(2, CompressibleNeoHookean{1.0, 9.0}, false, Eigen::Vector3d::Zero(), 4, 0.26);
  const pal_session_config usual = pal_default_session_config(organ.pack->get());
  const Felt felt = crush(organ, usual);
  EXPECT_LE(felt.largest, usual.max_force * (1 + kRounding));
  EXPECT_LE(felt.largest_step, usual.max_force_rate * kFrame * (1 + kRounding));
  EXPECT_GT(felt.held, 0);
  EXPECT_TRUE(felt.silent_at_the_end);

  pal_session_config none = usual;
  none.max_force = none.max_force_rate = kInfinity;
  const Felt unlimited = crush(organ, none);
  EXPECT_GT(unlimited.largest, usual.max_force) << "else this test shows nothing";
}

// A dt without sense must not stretch a frame: the force would jump.
TEST(SafeForce, BadDtDoesNotLiftTheRateLimit) {
  const OpenPack pack(small_pack_bytes());
  pal_session_config config = pal_default_session_config(pack.get());
  config.max_force_rate = 1e-6 * config.max_force;
  ToolSession session(pack.get(), config);
  session.hold(0, pal_default_hold(0));
  Eigen::Vector3d last = force_of(session.frame({at(Eigen::Vector3d::Zero())})[0]);
  const double reach = pack.info().max_displacement;
  const auto expect_limited = [&](double dt, double depth) {
    const pal_tool_result result = session.frame_with({at({0, 0, -depth})}, dt, {})[0];
    EXPECT_LE((force_of(result) - last).norm(), config.max_force_rate * kFrame * (1 + kRounding)) << dt;
    EXPECT_TRUE(result.flags & PAL_FLAG_LIMITED) << dt;
    last = force_of(result);
  };
  for (const double dt : {kInfinity, std::nan(""), -1.0}) expect_limited(dt, reach);
  last = force_of(session.frame_with({at({0, 0, -reach})}, 1.5, {})[0]);
  expect_limited(std::nan(""), 0);
}

// The model's force: 1, then unreliable for a while, then 3.
TEST(SafeForce, HeldForceFadesAndBlendsBack) {
  pal_session_config config = {};
  config.blend_seconds = 0.01;
  config.ramp_seconds = 0.05;
  config.max_force = config.max_force_rate = config.max_torque = config.max_torque_rate = kInfinity;
  for (const double garbage : {1e9, std::nan("")}) {
    ForceOutput output;
    reset_output(output);
    const auto frame = [&](double force, bool reliable) {
      const uint32_t flags = play(config, Wrench{{force, 0, 0, 0, 0, 0}}, reliable, false, output);
      return std::pair(output.out.v[0], flags);
    };
    EXPECT_EQ(frame(1, true), std::pair(1.0, 0U));
    for (int i = 1; i <= 60; ++i) {
      const auto [force, flags] = frame(garbage, false);
      EXPECT_NEAR(force, std::max(0.0, 1 - i / 50.0), kRounding) << i;
      EXPECT_TRUE(flags & PAL_FLAG_HELD);
      EXPECT_FALSE(flags & PAL_FLAG_STALE);
      EXPECT_EQ((flags & PAL_FLAG_NOT_FINITE) != 0, std::isnan(garbage));
    }
    double last = 0;
    for (int i = 1; i <= 10; ++i) {
      const auto [force, flags] = frame(3, true);
      EXPECT_EQ(flags, i < 10 ? uint32_t{PAL_FLAG_BLENDING} : 0U) << i;
      EXPECT_GE(force, last);
      EXPECT_LE(force - last, 3 * 0.2);  // the blend's largest slope is 1.5 / 10 a frame
      last = force;
    }
    EXPECT_EQ(last, 3);
  }
}

// A force that has faded to zero stays there when the model is good again, but the input is stale.
TEST(SafeForce, StaleInputBringsNoForceBack) {
  pal_session_config config = {};
  config.blend_seconds = 0.01;
  config.ramp_seconds = 0.05;
  config.max_force = config.max_force_rate = config.max_torque = config.max_torque_rate = kInfinity;
  for (const int held_frames : {20, 60}) {
    ForceOutput output;
    reset_output(output);
    const auto frame = [&](bool reliable, bool stale) {
      play(config, Wrench{{1, 0, 0, 0, 0, 0}}, reliable, stale, output);
      return output.out.v[0];
    };
    double last = frame(true, false);
    for (int i = 0; i < held_frames; ++i) last = frame(false, false);
    for (int i = 0; i < 60; ++i) {
      const double force = frame(true, true);
      EXPECT_LE(force, last + kRounding) << i;
      last = force;
    }
    EXPECT_EQ(last, 0);
    for (int i = 0; i < 60; ++i) last = frame(true, false);
    EXPECT_EQ(last, 1) << "input is back";
  }
}

// The blend back starts at the faded force, not at the full force.
TEST(SafeForce, BlendBackBeginsWhereTheForceHasFadedTo) {
  pal_session_config config = {};
  config.blend_seconds = 0.01;
  config.ramp_seconds = 0.05;
  config.max_force = config.max_torque = config.max_torque_rate = kInfinity;
  config.max_force_rate = 200;
  ForceOutput output;
  reset_output(output);
  const auto frame = [&](double force, bool reliable) {
    play(config, Wrench{{force, 0, 0, 0, 0, 0}}, reliable, false, output);
    return output.out.v[0];
  };
  for (int i = 0; i < 10; ++i) frame(1, true);
  for (int i = 0; i < 25; ++i) frame(1e9, false);
  EXPECT_NEAR(output.out.v[0], 0.5, kRounding);
  const double next = frame(0, true);
  EXPECT_LE(next, 0.5);
  EXPECT_GE(next, 0.4);
}

}  // namespace safe_force_test
}  // namespace palpate::test
