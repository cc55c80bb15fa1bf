// Passivity: tools get no more energy out of the tissue than they put in, whatever contacts, nodes and models
// change.
#include <gtest/gtest.h>

#include "tests/support/passivity_fixture.hpp"

namespace palpate::test::passivity_fixture {
namespace passivity_test {

class Passivity : public ::testing::Test {
 protected:
  OpenPack pack_{small_pack_bytes()};
  pal_session_config config_ = [this] {
    pal_session_config config = session_config(pack_.get(), PAL_MODEL_AUTO, 4, 4);
    config.blend_seconds = 0.02;
    return config;
  }();
};

void let_go(ToolSession& tools, uint32_t tool) {
  require(pal_tool_release(tools.get(), tool), "release");
}

void hold_where_it_is(ToolSession& tools, uint32_t tool, uint32_t site, const pal_pose& pose) {
  pal_hold hold = pal_default_hold(site);
  hold.unstrained = pose;
  tools.hold(tool, hold);
}

TEST_F(Passivity, AClosedPathMakesNoEnergy) {
  ToolSession tools(pack_.get(), config_);
  Work work(tools);
  tools.hold(0, pal_default_hold(6));
  for (int frame = 0; frame <= 4000; ++frame) {
    const double t = 2 * M_PI * frame / 4000;
    work.frame({at(0.04 * std::sin(t / 2) * Eigen::Vector3d(std::cos(3 * t), std::sin(2 * t), -1))});
  }
  EXPECT_GT(work.peak(), 0);
  EXPECT_LE(std::abs(work.done()), 1e-4 * work.peak()) << "the trapezoidal rule over 4000 steps";
  EXPECT_EQ(work.reduced(), 0);
}

// The runtime shortens displacements far outside the domain. The force of a shortened displacement is no
// gradient, so closed paths could create energy.
TEST_F(Passivity, ClampedPathsMakeNoEnergy) {
  constexpr double kRadius = 0.5;
  constexpr int kTurn = 1000;
  for (const double sense : {1.0, -1.0}) {
    ToolSession tools(pack_.get(), config_);
    Work work(tools);
    tools.hold(0, pal_default_hold(6));
    int num_clamped = 0;
    const auto move = [&](const Eigen::Vector3d& d) {
      work.frame({at(d)});
      num_clamped += (tools.last()[0].flags & PAL_FLAG_CLAMPED) != 0;
    };
    const Eigen::Vector3d centre(0, 0, -kRadius);
    const auto on_circle = [&](double t) {
      return Eigen::Vector3d(centre +
                             kRadius * Eigen::Vector3d(std::cos(t), sense * std::sin(t), 0.3 * std::sin(t)));
    };
    for (int frame = 0; frame <= kTurn; ++frame) move(on_circle(0) * frame / kTurn);
    for (int frame = 0; frame <= 10 * kTurn; ++frame) move(on_circle(2 * M_PI * frame / kTurn));
    for (int frame = kTurn; frame >= 0; --frame) move(on_circle(0) * frame / kTurn);
    EXPECT_GT(num_clamped, 10 * kTurn);
    EXPECT_GE(work.done(), -kAllowed * work.peak()) << sense;
  }
}

// Each cycle goes in along the softer model and comes out along the stiffer model.
struct Detour {
  const char* name;
  Eigen::Vector3d deepest;
  std::function<void(ToolSession&)> at_the_bottom;
  std::function<void(ToolSession&)> at_the_top;
};

class PassivityOfDetours : public Passivity, public ::testing::WithParamInterface<Detour> {};

TEST_P(PassivityOfDetours, MakesNoEnergy) {
  const Detour& detour = GetParam();
  ToolSession tools(pack_.get(), config_);
  Work work(tools);
  double worst = 0;
  double largest_step = 0;
  double largest_force = 0;
  for (int cycle = 0; cycle < 3; ++cycle) {
    work.restart();
    tools.hold(0, pal_default_hold(6));
    for (int frame = 0; frame <= 600; ++frame) {
      if (frame == 300) detour.at_the_bottom(tools);
      const double depth = 0.5 - 0.5 * std::cos(2 * M_PI * frame / 600);
      const Eigen::Vector3d before = work.force(0);
      work.frame({at(depth * detour.deepest), at({0, 0, 0})});
      largest_step = std::max(largest_step, (work.force(0) - before).norm());
      largest_force = std::max(largest_force, work.force(0).norm());
    }
    detour.at_the_top(tools);
    let_go(tools, 0);
    for (int frame = 0; frame < 100; ++frame) work.frame({at({0, 0, 0}), at({0, 0, 0})});
    worst = std::min(worst, work.done() / work.peak());
  }
  EXPECT_GE(worst, -kAllowed) << "the energy created in a cycle";
  EXPECT_GT(work.reduced(), 0) << "else this detour shows nothing";
  EXPECT_LE(largest_step, 0.1 * largest_force) << "1.5 / 20 of what a blend begins with, and the motion";
}

INSTANTIATE_TEST_SUITE_P(
    Of, PassivityOfDetours,
    ::testing::Values(Detour{"SecondTool",
                             {0.02, 0, -0.04},
                             [](ToolSession& tools) { tools.hold(1, pal_default_hold(1)); },
                             [](ToolSession& tools) { let_go(tools, 1); }},
                      Detour{"SecondToolBeside",
                             {0.03, 0.02, -0.02},
                             [](ToolSession& tools) { tools.hold(1, pal_default_hold(7)); },
                             [](ToolSession& tools) { let_go(tools, 1); }},
                      Detour{"FixedNodes",
                             {0, 0, -0.045},
                             [](ToolSession& tools) {
                               tools.fix({1, 2, 7});
                             },
                             [](ToolSession& tools) { tools.fix({}); }},
                      Detour{"PulledOut",
                             {0, 0.01, 0.04},
                             [](ToolSession& tools) {
                               tools.fix({1, 2, 7});
                             },
                             [](ToolSession& tools) { tools.fix({}); }}),
    [](const auto& detour) { return detour.param.name; });

// The rest of a blend pushes the tool outwards.
TEST_F(Passivity, AFadingForceDoesNotDriveAFastTool) {
  config_.blend_seconds = 0.2;
  ToolSession tools(pack_.get(), config_);
  Work work(tools);
  const pal_pose other = at({0, 0, 0});
  for (int cycle = 0; cycle < 3; ++cycle) {
    work.restart();
    tools.hold(0, pal_default_hold(6));
    const auto go = [&](double from, double to, int frames) {
      for (int frame = 1; frame <= frames; ++frame)
        work.frame({at({0, 0, -(from + (to - from) * frame / frames)}), other});
    };
    work.frame({at({0, 0, 0}), other});
    // The tissue is softer at the bottom than on the way in: the old force fades while the tool moves out.
    tools.fix({1, 2, 7});
    go(0, 0.04, 100);
    tools.fix({});
    go(0.04, -0.04, 20);
    let_go(tools, 0);
    go(-0.04, 0, 400);
    EXPECT_GE(work.done(), -kAllowed * work.peak()) << "cycle " << cycle;
  }
}

// No switch: a tap, however short, gets its full force on the way out.
TEST_F(Passivity, TapsAreWhole) {
  for (const int frames : {3, 10, 40}) {
    ToolSession tools(pack_.get(), config_);
    Work work(tools);
    for (int tap = 0; tap < 3; ++tap) {
      hold_where_it_is(tools, 0, 6, at({0, 0, 0}));
      for (int frame = 0; frame <= 2 * frames; ++frame)
        work.frame({at({0, 0, -0.04 * (frames - std::abs(frame - frames)) / frames})});
      let_go(tools, 0);
      work.frame({at({0, 0, 0})});
    }
    EXPECT_EQ(work.reduced(), 0) << frames << " frames";
  }
}

// An absurd pose, during a blend or not: later cycles neither lose their force nor gain energy.
TEST_F(Passivity, OneBadPoseIsForgotten) {
  for (const int bad : {5, 150}) {
    ToolSession tools(pack_.get(), config_);
    Work work(tools);
    tools.hold(0, pal_default_hold(6));
    for (int cycle = 0; cycle < 3; ++cycle) {
      const int reduced = work.reduced();
      for (int frame = 0; frame <= 400; ++frame) {
        if (frame == 3) tools.fix({1, 2, 7});
        if (frame == 203) tools.fix({});
        const double depth = 0.5 - 0.5 * std::cos(2 * M_PI * frame / 400);
        const bool is_bad = cycle == 0 && frame == bad;
        work.frame({is_bad ? at({7, -9, 10}) : at(-depth * Eigen::Vector3d(0, 0, 0.04))});
        if (cycle == 0 && frame == bad + 1) work.restart();
      }
      if (cycle > 0) {
        EXPECT_EQ(work.reduced(), reduced) << "this detour is on the harmless side";
      }
    }
  }
}

// Energy lost in a cycle is not available to the next cycle.
TEST_F(Passivity, CyclesWithoutLettingGoMakeNoEnergy) {
  ToolSession tools(pack_.get(), config_);
  Work work(tools);
  tools.hold(0, pal_default_hold(6));
  double worst = 0;
  for (int cycle = 0; cycle < 6; ++cycle) {
    work.restart();
    for (int frame = 0; frame <= 600; ++frame) {
      // Even cycles come out along the softer model, odd cycles along the stiffer model.
      if (frame == (cycle % 2 == 0 ? 0 : 300)) tools.fix({1, 2, 7});
      if (frame == (cycle % 2 == 0 ? 300 : 0)) tools.fix({});
      const double depth = 0.5 - 0.5 * std::cos(2 * M_PI * frame / 600);
      work.frame({at({0, 0, -0.045 * depth})});
    }
    worst = std::min(worst, work.done() / work.peak());
  }
  EXPECT_GE(worst, -kAllowed);
}

// Input is lost while the hand goes in. The hand felt no force, so the hand gets no energy back.
TEST_F(Passivity, ForcesThatWereNotFeltArePutInByNobody) {
  config_.stale_seconds = 0.01;
  config_.ramp_seconds = 0.01;
  ToolSession tools(pack_.get(), config_);
  Work work(tools);
  tools.hold(0, pal_default_hold(6));
  for (int frame = 0; frame < 50; ++frame) work.frame({at({0, 0, -0.01 * frame / 49})});
  const double peak = work.peak();
  for (int frame = 0; frame < 100; ++frame) {
    tools.frame({});  // and the hand goes on to 0.04
  }
  double given = 0;
  Eigen::Vector3d force_before = force_of(tools.last()[0]);
  double depth_before = 0.04;
  for (int frame = 0; frame <= 400; ++frame) {
    const double depth = 0.04 * (1 - std::max(0, frame - 100) / 300.0);
    const Eigen::Vector3d force = force_of(tools.frame({at({0, 0, -depth})})[0]);
    given += 0.5 * (force + force_before)[2] * (depth_before - depth);
    force_before = force;
    depth_before = depth;
  }
  const Eigen::Vector3d whole(
      OwnedSession(pack_.get(), PAL_MODEL_AUTO, 4, 4).touch({{6, {0, 0, -0.04}, 0, {}, {}, {}}})[0].force);
  EXPECT_LT(std::abs(given), peak + 0.1 * 0.5 * 0.04 * whole.norm());
}

// A tool that goes deeper after a switch gets the model's full force back.
TEST_F(Passivity, ForcesAreTheModelsAgainDeeperIn) {
  ToolSession tools(pack_.get(), config_);
  Work work(tools);
  tools.hold(0, pal_default_hold(6));
  const auto go = [&](double from, double to) {
    for (int frame = 1; frame <= 200; ++frame)
      work.frame({at({0, 0, -(from + (to - from) * frame / 200)}), at({0, 0, 0})});
  };
  go(0, 0.01);
  tools.hold(1, pal_default_hold(7));
  go(0.01, 0.008);
  EXPECT_NE(tools.last()[0].flags & PAL_FLAG_REDUCED, 0U);
  go(0.008, 0.04);
  EXPECT_EQ(tools.last()[0].flags & PAL_FLAG_REDUCED, 0U);
  OwnedSession contacts(pack_.get(), PAL_MODEL_AUTO, 4, 4);
  const auto expected = contacts.touch({{6, {0, 0, -0.04}, 0, {}, {}, {}}, {7, {0, 0, 0}, 0, {}, {}, {}}});
  EXPECT_LE((work.force(0) - Eigen::Vector3d(expected[0].force)).norm(), 1e-12 * work.force(0).norm());
}

// A tool that grasps strained tissue counts the stored energy as its own.
TEST_F(Passivity, AStrainedHoldIsNotReduced) {
  ToolSession tools(pack_.get(), config_);
  Work work(tools);
  tools.hold(0, pal_default_hold(6));
  tools.hold(1, pal_default_hold(1));
  for (int frame = 0; frame <= 200; ++frame) {
    const double left = 1 - frame / 200.0;
    work.frame({at({0, 0, -0.03 * left}), at({0.02 * left, 0, 0})});
  }
  EXPECT_EQ(work.reduced(), 0);
  EXPECT_LT(work.done(), 0) << "it came out again";
}

// Random cycles, each from a released state to the next.
TEST_F(Passivity, RandomCyclesMakeNoEnergy) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> number(0, 1);
  const auto below = [&](int n) { return std::uniform_int_distribution<int>(0, n - 1)(random); };
  ToolSession tools(pack_.get(), config_);
  Work work(tools);
  double worst = 0;
  int reduced_cycles = 0;
  for (int cycle = 0; cycle < 60; ++cycle) {
    work.restart();
    const int reduced = work.reduced();
    std::array<Eigen::Vector3d, 3> amplitude;
    std::array<double, 3> pace;
    std::array<bool, 3> holds = {};
    for (size_t tool = 0; tool < 3; ++tool) {
      amplitude[tool] = 0.03 * Eigen::Vector3d(number(random) - 0.5, number(random) - 0.5, -number(random));
      pace[tool] = 0.5 + 2 * number(random);
    }
    std::vector<pal_pose> poses(3, at({0, 0, 0}));
    for (int frame = 0; frame <= 800; ++frame) {
      const double ends = std::sin(M_PI * frame / 800);
      for (size_t tool = 0; tool < 3; ++tool) {
        const double turn = 0.1 * ends * std::sin(0.01 * pace[tool] * frame);
        poses[tool] = pose(ends * std::abs(std::sin(0.008 * pace[tool] * frame)) * amplitude[tool],
                           {turn, -turn, 0.5 * turn});
      }
      if (frame < 800 && below(40) == 0) {
        const size_t tool = static_cast<size_t>(below(3));
        if (holds[tool]) {
          let_go(tools, static_cast<uint32_t>(tool));
        } else {
          hold_where_it_is(tools, static_cast<uint32_t>(tool), static_cast<uint32_t>(below(12)), poses[tool]);
        }
        holds[tool] = !holds[tool];
      }
      if (frame % 300 == 299)
        tools.fix(below(2) == 0 ? std::vector<uint32_t>{} : std::vector<uint32_t>{1, 9});
      work.frame(poses);
    }
    for (uint32_t tool = 0; tool < 3; ++tool) let_go(tools, tool);
    for (int frame = 0; frame < 100; ++frame) work.frame(poses);
    if (work.peak() > 0) worst = std::min(worst, work.done() / work.peak());
    reduced_cycles += work.reduced() > reduced ? 1 : 0;
  }
  EXPECT_GE(worst, -kAllowed);
  EXPECT_GT(reduced_cycles, 10) << "else this shows little";
}

}  // namespace passivity_test
}  // namespace palpate::test::passivity_fixture
