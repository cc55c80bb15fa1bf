// Contacts that crush tissue, where Newton may find no next state. The contacts reach the state of a slow
// push from rest, feel only converged forces, and never stay stuck.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <utility>
#include <vector>

#include "runtime/src/session/session_state.hpp"
#include "tests/support/zone_block.hpp"

namespace palpate::test {
namespace zone_crush_test {

constexpr CompressibleNeoHookean kStiffInVolume = {1.0, 9.0};

using Goal = std::vector<Eigen::Vector3d>;  // displacement of each contact

std::vector<pal_contact> contacts_at(const std::vector<uint32_t>& sites, const Goal& goal) {
  std::vector<pal_contact> contacts;
  for (size_t c = 0; c < sites.size(); ++c)
    contacts.push_back({sites[c], {goal[c][0], goal[c][1], goal[c][2]}, 0, {}, {}, {}});
  return contacts;
}

double largest_stiffness(const std::vector<pal_contact_result>& results) {
  double largest = 0;
  for (const pal_contact_result& result : results)
    largest = std::max(largest, Eigen::Map<const Eigen::Matrix3d>(result.stiffness[0]).norm());
  return largest;
}

// Moves a session's contacts from goal to goal at a steady speed.
struct Walk {
  Walk(const ZoneBlock& organ, std::vector<uint32_t> of_sites)
      : session(organ.pack->get(), organ.config(static_cast<uint32_t>(of_sites.size()))),
        sites(std::move(of_sites)),
        place(sites.size(), Eigen::Vector3d::Zero()),
        stiffness_at_rest(largest_stiffness(session.touch(contacts_at(sites, place)))) {}

  // Calls see(results) after each frame.
  template <typename See>
  void go(const Goal& goal, int frames, const See& see) {
    const Goal start = place;
    for (int frame = 1; frame <= frames; ++frame) {
      for (size_t c = 0; c < place.size(); ++c)
        place[c] = start[c] + (goal[c] - start[c]) * (static_cast<double>(frame) / frames);
      see(touch());
    }
  }
  void go(const Goal& goal, int frames) {
    go(goal, frames, [](const auto&) {});
  }
  // Runs at most `frames` frames, until convergence.
  std::vector<pal_contact_result> hold(int frames) {
    std::vector<pal_contact_result> results;
    for (int frame = 0; frame < frames; ++frame) {
      results = touch();
      if (has_ended(results)) break;
    }
    return results;
  }
  std::vector<pal_contact_result> touch() {
    std::vector<pal_contact_result> results = session.touch(contacts_at(sites, place));
    const bool is_back = !has_ended(results) && largest_force(results) == 0;
    if (is_back && !was_back) {
      ++returns;
      constexpr double kRounding = 1e-5;  // of float32, summed in another order
      EXPECT_LE(largest_stiffness(results), (1 + kRounding) * stiffness_at_rest)
          << "not that of where they were";
    }
    was_back = is_back;
    return results;
  }

  OwnedSession session;
  std::vector<uint32_t> sites;
  Goal place;
  int returns = 0;  // number of restarts from rest
  bool was_back = false;
  double stiffness_at_rest;
};

// Three neighbours crushed by an edge and more: other equilibria are near. Long steps must reject a state whose contacts
// have not done the stored work. Beyond 1.3 edges some paths do end in another equilibrium.
TEST(ZoneCrush, LongStepsLeadWhereShortOnesDo) {
  const ZoneBlock organ(2, kStiffInVolume, false, Eigen::Vector3d::Zero(), 4, 0.1);
  const double edge = organ.block.sites.mean_surface_edge;
  const auto pushed = [&](double part) {
    const double length = 0.85 * part * edge;
    return std::vector<pal_contact>{{0, {-0.66 * length, 0.97 * length, -0.57 * length}, 0, {}, {}, {}},
                                    {4, {-0.84 * length, 0.92 * length, -0.35 * length}, 0, {}, {}, {}},
                                    {3, {0.72 * length, 0.66 * length, -0.51 * length}, 0, {}, {}, {}}};
  };
  const auto led_there = [&](int steps) {
    OwnedSession session(organ.pack->get(), organ.config(3));
    for (int step = 1; step <= steps; ++step) {
      for (int frame = 0; frame < 16; ++frame) {
        const bool has_followed = has_ended(session.touch(pushed(static_cast<double>(step) / steps)));
        refine(session);
        if (has_followed) break;
      }
    }
    std::vector<pal_contact_result> held;
    for (int frame = 0; frame < 100; ++frame) {
      held = session.touch(pushed(1));
      refine(session);
    }
    EXPECT_TRUE(has_ended(held));
    return held;
  };
  const ContactAnswer truth = organ.solve(pushed(1));
  for (const int steps : {1, 2, 4, 8, 32, 64}) {
    const std::vector<pal_contact_result> found = led_there(steps);
    for (size_t c = 0; c < 3; ++c)
      EXPECT_LE((Eigen::Vector3d(found[c].force) - truth.forces[c]).norm(), 1e-6 * truth.forces[c].norm())
          << steps;
  }
}

// Two neighbours go from crush to crush and flatten the tissue between them, where no step keeps det F > 0. A
// push from rest reaches the same place, so the zone restarts from rest and then follows.
TEST(ZoneCrush, JammedNeighboursRestartFromRest) {
  const ZoneBlock organ(2, kStiffInVolume, false, Eigen::Vector3d::Zero(), 4, 0.26);
  struct Case {
    std::vector<uint32_t> sites;
    std::vector<Goal> goals;
  };
  const Case cases[] = {
      {{7, 8},
       {{{0.115, 0.213, 0.038}, {0.273, 0.027, 0.167}},
        {{0.275, -0.151, 0.085}, {-0.042, 0.176, -0.129}},
        {{-0.014, -0.175, -0.284}, {-0.144, 0.12, -0.038}}}},
      {{2, 3},
       {{{-0.338, 0.1, 0.099}, {-0.121, 0.314, 0.079}},
        {{-0.175, -0.162, -0.005}, {0.055, -0.236, 0.065}},
        {{-0.256, 0.026, -0.049}, {0.14, 0.168, -0.125}}}},
  };
  for (const Case& one : cases) {
    Walk walk(organ, one.sites);
    for (const Goal& goal : one.goals) {
      walk.go(goal, 60);
      walk.hold(400);
    }
    EXPECT_GE(walk.returns, 1);
    for (const double part : {1.0, 0.8, 0.6}) {
      Goal goal = one.goals.back();
      for (Eigen::Vector3d& d : goal) d *= part;
      walk.go(goal, 20);
      const std::vector<pal_contact_result> held = walk.hold(400);
      Walk from_rest(organ, one.sites);
      from_rest.go(goal, 60);
      const std::vector<pal_contact_result> expected = from_rest.hold(400);
      EXPECT_TRUE(has_ended(held) && has_ended(expected)) << part;
      EXPECT_LE(worst_force_error(held, expected), 1e-3) << part;
    }
  }
}

// Two neighbours pushed through each other jam from rest, too. The zone tries once, then waits until the
// contacts' goals change.
TEST(ZoneCrush, AJamFromRestWaitsForAnotherGoal) {
  const ZoneBlock organ(2, kStiffInVolume, false, Eigen::Vector3d::Zero(), 4, 0.26);
  const std::vector<uint32_t> sites = {4, 5};
  const double edge = organ.block.sites.mean_surface_edge;
  const auto place_of = [&](uint32_t site) -> Eigen::Vector3d {
    return organ.block.model.positions[static_cast<size_t>(organ.block.sites.sites[site].node)];
  };
  const Eigen::Vector3d way = edge * (place_of(5) - place_of(4)).normalized();
  const auto towards_each_other = [&](double part) { return Goal{part * way, -part * way}; };
  Walk fresh(organ, sites);
  fresh.go(towards_each_other(0.2), 60);
  const std::vector<pal_contact_result> expected = fresh.hold(400);
  Walk walk(organ, sites);
  for (int time = 1; time <= 2; ++time) {
    walk.go(towards_each_other(3), 300);
    EXPECT_FALSE(has_ended(walk.hold(100)));
    walk.go(towards_each_other(0.2), 100);
    EXPECT_LE(worst_force_error(walk.hold(100), expected), 1e-3) << time;
    EXPECT_EQ(walk.returns, time);
  }
}

// While Newton searches, it passes nearly inverted elements with huge forces. The results never show these
// forces.
TEST(ZoneCrush, IntermediateStatesAreNotFelt) {
  const ZoneBlock& organ = tissue_block(2, false, Eigen::Vector3d::Zero(), 4, 0.1);
  Walk walk(organ, {5, 7, 8});
  const Goal goal = {{-0.196, 0.228, 0.004}, {-0.19, 0.02, 0.025}, {0.289, -0.097, 0.025}};
  double in_balance = 0;
  double on_the_way = 0;
  const auto see = [&](const std::vector<pal_contact_result>& results) {
    double& largest = has_ended(results) ? in_balance : on_the_way;
    largest = std::max(largest, largest_force(results));
  };
  walk.go(goal, 30, see);
  walk.go(goal, 60, see);  // held there
  EXPECT_GT(on_the_way, 0);
  EXPECT_LE(on_the_way, 2 * in_balance);
}

// Small strain has no inversion: neighbours pushed through each other get the exact response.
TEST(ZoneCrush, SmallStrainsKnowNoInversion) {
  const ZoneBlock organ(1, LinearElastic{1.0, 4.0}, false, Eigen::Vector3d::Zero(), 4, 0.1);
  Walk walk(organ, {4, 5});
  const Goal goal = {{0.6, 0.1, -0.3}, {-0.6, 0, 0.2}};
  walk.go(goal, 10);
  const std::vector<pal_contact_result> held = walk.hold(10);
  EXPECT_TRUE(has_ended(held));
  const ContactAnswer truth = organ.solve(contacts_at(walk.sites, goal));
  for (size_t c = 0; c < held.size(); ++c)
    EXPECT_LE((Eigen::Vector3d(held[c].force) - truth.forces[c]).norm(), 1e-5 * largest_force(held)) << c;
}

// Two and three neighbours jump anywhere within some edges; the zone is the whole organ. Every displayed
// state has det F > 0, converged or not.
TEST(ZoneCrush, DisplayedElementsAreNotInverted) {
  constexpr StVenantKirchhoff kKnowsNoInversion = {1.0, 2.0};  // its energy stays finite at inversion
  constexpr double kSinglePrecision = 0.9;
  constexpr bool kSharesVolumes = true;
  const Eigen::Vector3d no_gravity = Eigen::Vector3d::Zero();
  TestRandom random(7);
  for (const ZoneBlock& organ :
       {ZoneBlock(8, kTissue), ZoneBlock(8, kKnowsNoInversion, false, no_gravity, 4, 0.1),
        ZoneBlock(8, kStiffInVolume, false, no_gravity, 4, 0.1, kSharesVolumes),
        ZoneBlock(8, kTissue, true, no_gravity, 2, 0.3)}) {
    int on_the_way = 0;
    for (const auto& sites : {std::vector<uint32_t>{4, 5}, {0, 4}, {0, 3, 4}, {5, 7, 8}}) {
      OwnedSession session(organ.pack->get(), organ.config(3));
      for (int jump = 0; jump < 12; ++jump) {
        Goal goal(sites.size());
        for (Eigen::Vector3d& d : goal) d = 1.5 * organ.block.sites.mean_surface_edge * random.vector();
        for (int frame = 0; frame < 8; ++frame) {
          on_the_way += has_ended(session.touch(contacts_at(sites, goal))) ? 0 : 1;
          Eigen::VectorXd forces;
          const ElementState state = organ.assembly.internal_force(as_vector(session.field()), forces);
          EXPECT_GE(state.min_jacobian, kSinglePrecision * kLeastJacobian) << frame << " after jump " << jump;
        }
      }
    }
    EXPECT_GT(on_the_way, 100) << "else this test shows nothing";
  }
}

// Where no path leads to the goal, the zone waits. If rest is nearer to the goal, the zone restarts from rest
// after a while.
TEST(ZoneCrush, RestartsFromRestWithoutAPath) {
  const ZoneBlock& organ = tissue_block(1);
  OwnedSession session(organ.pack->get(), organ.config(1));
  const auto pressed_by = [](double depth) {
    return std::vector<pal_contact>{{4, {0, 0, -depth}, 0, {}, {}, {}}};
  };
  settle(session, pressed_by(0.1));
  // Steps of negligible size count as no progress.
  const auto depth_after = [&](int frames, double depth) {
    pal_contact_result result = {};
    for (int frame = 0; frame < frames; ++frame) {
      session.get()->tissue.zone.active.groups[0].setbacks.longest_step = 1e-9;
      result = session.touch(pressed_by(depth))[0];
      EXPECT_NE(result.flags & PAL_FLAG_UNCONVERGED, 0U);
    }
    return -result.displacement[2];
  };
  EXPECT_NEAR(depth_after(200, 0.3), 0.1, 1e-6);
  EXPECT_NEAR(depth_after(20, 0.01), 0.1, 1e-6);
  EXPECT_NEAR(depth_after(60, 0.01), 0, 1e-6);
  const auto found = settle(session, pressed_by(0.01));
  EXPECT_TRUE(has_ended(found));
  OwnedSession another(organ.pack->get(), organ.config(1));
  EXPECT_LE(worst_force_error(found, settle(another, pressed_by(0.01))), 1e-6);
}

}  // namespace zone_crush_test
}  // namespace palpate::test
