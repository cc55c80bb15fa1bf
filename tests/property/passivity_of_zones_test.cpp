// Passivity on nonlinear zones: tools get no energy out of the organ.
#include <gtest/gtest.h>

#include <numbers>

#include "tests/support/passivity_fixture.hpp"

namespace palpate::test::passivity_fixture {
namespace passivity_of_zones_test {

// Neighbours pushed into and through each other jam the tissue between them. Contacts lag behind their tools,
// forces rise many times, zones restart. A tool that retreats gets out no more energy than it put in.
class PassivityOfZones : public ::testing::Test {
 protected:
  static pal_session_config config(uint32_t num_tools) {
    pal_session_config config = organ().config(num_tools);
    config.max_tools = num_tools;
    config.blend_seconds = 0.02;
    return config;
  }
  static const ZoneBlock& organ() {
    static const ZoneBlock block(2, CompressibleNeoHookean{1.0, 9.0}, false, Eigen::Vector3d::Zero(), 4,
                                 0.26);
    return block;
  }
  static Eigen::Vector3d place_of(uint32_t site) {
    return organ().block.model.positions[static_cast<size_t>(organ().block.sites.sites[site].node)];
  }
  static double edge() { return organ().block.sites.mean_surface_edge; }
};

TEST_F(PassivityOfZones, ThereAndBackThroughAJamMakesNoEnergy) {
  const Eigen::Vector3d way = edge() * (place_of(5) - place_of(4)).normalized();
  int behind = 0;
  int reduced = 0;
  for (const double deepest : {0.5, 0.7, 1.0, 2.0}) {
    for (const int frames : {20, 60, 250, 1000}) {
      ToolSession tools(organ().pack->get(), config(2));
      Work work(tools);
      tools.hold(0, pal_default_hold(4));
      tools.hold(1, pal_default_hold(5));
      const auto go_to = [&](double part) {
        work.frame({at(part * deepest * way), at(-part * deepest * way)});
        behind += (tools.last()[0].flags & PAL_FLAG_UNCONVERGED) != 0 ? 1 : 0;
      };
      for (int frame = 0; frame <= frames; ++frame) go_to(static_cast<double>(frame) / frames);
      for (int frame = 0; frame < 60; ++frame) go_to(1);
      for (int frame = frames; frame >= 0; --frame) go_to(static_cast<double>(frame) / frames);
      for (int frame = 0; frame < 60; ++frame) go_to(0);
      EXPECT_GE(work.done(), -kAllowed * work.peak()) << deepest << " edges in " << frames << " frames";
      EXPECT_LE(work.force(0).norm(), 1e-9) << "at rest again";
      reduced += work.reduced();
    }
  }
  EXPECT_GT(behind, 1000) << "else this shows little";
  EXPECT_GT(reduced, 30);
}

// Random paths at any speed, and back to rest.
TEST_F(PassivityOfZones, RandomCrushesMakeNoEnergy) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> number(-1, 1);
  double worst = 0;
  int behind = 0;
  for (int cycle = 0; cycle < 40; ++cycle) {
    ToolSession tools(organ().pack->get(), config(3));
    Work work(tools);
    const uint32_t sites[] = {4, 5, 7};
    std::array<Eigen::Vector3d, 3> from;
    from.fill(Eigen::Vector3d::Zero());
    for (uint32_t tool = 0; tool < 3; ++tool) tools.hold(tool, pal_default_hold(sites[tool]));
    constexpr int kCorners = 4;
    for (int corner = 1; corner <= kCorners; ++corner) {
      const int frames = static_cast<int>(std::pow(10, 1.75 + 0.75 * number(random)));
      std::array<Eigen::Vector3d, 3> to;
      for (Eigen::Vector3d& d : to) {
        d = edge() * Eigen::Vector3d(number(random), number(random), number(random));
        if (corner == kCorners) d.setZero();
      }
      for (int frame = 0; frame <= frames; ++frame) {
        std::vector<pal_pose> poses;
        for (size_t tool = 0; tool < 3; ++tool)
          poses.push_back(at(from[tool] + (to[tool] - from[tool]) * frame / frames));
        work.frame(poses);
        behind += (tools.last()[0].flags & PAL_FLAG_UNCONVERGED) != 0 ? 1 : 0;
      }
      from = to;
    }
    for (int frame = 0; frame < 60; ++frame) work.frame(std::vector<pal_pose>(3, at({0, 0, 0})));
    ASSERT_GT(work.peak(), 0);
    worst = std::min(worst, work.done() / work.peak());
  }
  EXPECT_GE(worst, -kAllowed);
  EXPECT_GT(behind, 1000) << "else this shows little";
}

// A contact that lags behind a fast tool, without a jam, gives back all the energy.
TEST_F(PassivityOfZones, FastTapsAreWhole) {
  int behind = 0;
  for (const int frames : {3, 5, 8, 15, 40}) {
    ToolSession tools(organ().pack->get(), config(1));
    Work work(tools);
    tools.hold(0, pal_default_hold(5));
    for (int frame = 0; frame < 2; ++frame) work.frame({at({0, 0, 0})});  // the zone is prepared
    for (int tap = 0; tap < 3; ++tap) {
      for (int frame = -frames; frame <= frames; ++frame) {
        work.frame({at(edge() *
                       Eigen::Vector3d(0, 0, -0.6 * (1.0 - std::abs(frame) / static_cast<double>(frames))))});
        behind += (tools.last()[0].flags & PAL_FLAG_UNCONVERGED) != 0 ? 1 : 0;
      }
    }
    EXPECT_EQ(work.reduced(), 0) << frames << " frames";
  }
  EXPECT_GT(behind, 0) << "else this shows little";
}

// Three tools, two of them neighbours, on loops of many turns at up to a quarter of an edge a frame, or with a jump in
// every frame. Nothing can undo the force before the first jump. Later turns pay back the energy that it gains.
TEST_F(PassivityOfZones, LoopsOfManyTurnsGainNothing) {
  constexpr double kGain = 0.003;
  constexpr int kTurns = 100;
  struct Loop {
    double neighbours;  // radius, in edges
    double other;
    int frames;  // of a turn
    bool jumps;
  };
  const ZoneBlock block(1, CompressibleNeoHookean{1.0, 4.0}, false, Eigen::Vector3d::Zero(), 6, 0.1);
  const uint32_t sites[] = {6, 7, 24};
  for (const Loop& loop : {Loop{0.1, 0.8, 200, false},
                           {0.1, 0.4, 20, false},
                           {0.1, 0.8, 20, false},
                           {0.5, 0.4, 40, false},
                           {0.5, 0.4, 20, true},
                           {0.5, 0.8, 200, true}}) {
    SCOPED_TRACE(testing::Message() << loop.neighbours << ", " << loop.other << ", " << loop.frames
                                    << ", jumps: " << loop.jumps);
    pal_session_config session = block.config(3);
    session.max_tools = 3;
    ToolSession tools(block.pack->get(), session);
    Work work(tools);
    for (uint32_t tool = 0; tool < 3; ++tool) tools.hold(tool, pal_default_hold(sites[tool]));
    int behind = 0;
    const auto go_to = [&](double angle, double part) {
      std::vector<pal_pose> poses;
      for (int tool = 0; tool < 3; ++tool) {
        const double radius = (tool < 2 ? loop.neighbours : loop.other) * block.block.sites.mean_surface_edge;
        const double t = angle + 2.1 * tool;
        poses.push_back(
            at(part * radius * Eigen::Vector3d(std::cos(t), std::sin(t), 0.5 * std::sin(2 * angle + tool))));
      }
      work.frame(poses);
      behind += (tools.last()[0].flags & PAL_FLAG_UNCONVERGED) != 0 ? 1 : 0;
    };
    for (int frame = 0; frame <= 100; ++frame) go_to(0, frame / 100.0);
    for (int frame = 1; frame <= kTurns * loop.frames; ++frame) {
      go_to(2 * std::numbers::pi * frame / loop.frames, loop.jumps && frame % 2 == 1 ? -0.7 : 1);
      if (frame % 4 == 0) refine(tools);
    }
    for (int frame = 100; frame >= 0; --frame) go_to(0, frame / 100.0);
    EXPECT_GT(work.peak(), 0);
    EXPECT_GE(work.done(), -kGain * work.peak());
    if (loop.jumps) continue;
    EXPECT_LT(behind, kTurns * loop.frames) << "contacts reach their tools now and then";
  }
}

// In a jam the tools feel nothing after a while. Tools that leave the jam and push in again feel their push.
TEST_F(PassivityOfZones, ForcesComeBackToWhoPushesIn) {
  const Eigen::Vector3d way = edge() * (place_of(5) - place_of(4)).normalized();
  ToolSession tools(organ().pack->get(), config(2));
  Work work(tools);
  tools.hold(0, pal_default_hold(4));
  tools.hold(1, pal_default_hold(5));
  const auto go_to = [&](double part) { work.frame({at(part * way), at(-part * way)}); };
  double part = 0;
  const auto go_on = [&](double by, int most, const auto& until) {
    int frames = 0;
    for (; frames < most && !until(); ++frames) go_to(part += by);
    return frames < most;
  };
  const auto is_held = [&] { return (tools.last()[0].flags & PAL_FLAG_HELD) != 0; };
  go_on(0.01, 150, [] { return false; });
  ASSERT_TRUE(is_held());
  EXPECT_EQ(work.force(0).norm() + work.force(1).norm(), 0);
  ASSERT_TRUE(go_on(-0.01, 150, [&] { return !is_held(); }));
  go_on(-0.01, 10, [] { return false; });
  const double before = work.force(0).norm();
  EXPECT_TRUE(go_on(0.01, 30, [&] { return work.force(0).norm() > before + 0.01; }));
}

}  // namespace passivity_of_zones_test
}  // namespace palpate::test::passivity_fixture
