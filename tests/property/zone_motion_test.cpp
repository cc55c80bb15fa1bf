// Zones under tools that move, tremble or hold still: the number of iterations and tangents.
#include "runtime/src/zone/zone_motion.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include "runtime/src/session/session_state.hpp"
#include "runtime/src/zone/zone_tangent.hpp"
#include "tests/support/tool_session.hpp"
#include "tests/support/zone_block.hpp"

namespace palpate::test {
namespace zone_motion_test {

constexpr double kReach = 0.1;
constexpr double kTurn = 0.01;  // radians a frame

// Contacts on a circle, each behind the one before.
std::vector<pal_contact> on_circle(const std::vector<uint32_t>& sites, int frame) {
  std::vector<pal_contact> contacts;
  for (const uint32_t site : sites) {
    const double t = kTurn * frame + static_cast<double>(contacts.size());
    contacts.push_back({site, {kReach * std::cos(t), kReach * std::sin(t), -0.05}, 0, {}, {}, {}});
  }
  return contacts;
}

const std::vector<std::vector<uint32_t>> kSets = {{4}, {3, 4}, {0, 8}, {0, 8, 4}};

void orient(OwnedSession& session, size_t count, double angle) {
  const Eigen::Quaterniond turned(Eigen::AngleAxisd(angle, Eigen::Vector3d(0.6, 0, 0.8)));
  std::vector<double> orientations;
  for (size_t c = 0; c < count; ++c)
    orientations.insert(orientations.end(), {turned.w(), turned.x(), turned.y(), turned.z()});
  require(pal_session_set_orientations(session.get(), orientations.data(), static_cast<uint32_t>(count)),
          "orientations");
}

// Extrapolation of node velocities makes an iteration a frame enough.
TEST(ZoneMotion, AnIterationAFrameFollowsATool) {
  for (const bool turns : {false, true}) {
    for (const bool quadratic : {false, true}) {
      const ZoneBlock& organ =
          tissue_block(quadratic ? 1 : 2, quadratic, Eigen::Vector3d::Zero(), quadratic ? 3 : 4);
      for (const std::vector<uint32_t>& sites : kSets) {
        if (quadratic && sites.size() > 2) continue;  // whose patches cover most of the top
        SCOPED_TRACE(testing::Message() << sites.size() << " contacts, " << turns << quadratic);
        pal_session_config config = organ.config(4);
        config.patches_turn = turns ? 1 : 0;
        pal_session_config one = config;
        one.zone_iterations = 1;
        OwnedSession moving(organ.pack->get(), one);
        OwnedSession held(organ.pack->get(), config);
        const auto touch = [&](OwnedSession& session, int frame) {
          if (turns) orient(session, sites.size(), 0.1 * std::sin(kTurn * frame));
          return session.touch(on_circle(sites, frame));
        };
        for (int frame = 0; frame < PAL_ZONE_STIFFNESS_FRAMES; ++frame) touch(moving, 0);
        int left = 0;
        constexpr int kFrames = 150;
        for (int frame = 0; frame < kFrames; ++frame) {
          const auto found = touch(moving, frame);
          left += has_ended(found) ? 0 : 1;
          if (frame % 50 != 49) continue;
          std::vector<pal_contact_result> expected;
          for (int step = 0; step < 2 * PAL_ZONE_STIFFNESS_FRAMES; ++step) expected = touch(held, frame);
          EXPECT_LE(worst_force_error(found, expected), 1e-3);
        }
        EXPECT_LE(left, 3);  // unconverged frames, at the start of the motion
      }
    }
  }
}

// Nodes that move for another reason than their contacts do not enter the extrapolation.
TEST(ZoneMotion, ATremblingToolDoesNotRepeatWhatOthersDo) {
  const ZoneBlock& organ = tissue_block(2);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> tremble(-1e-5, 1e-5);
  pal_session_config config = organ.config(2);
  config.zone_iterations = 1;
  OwnedSession session(organ.pack->get(), config);
  const auto touch = [&](int frame) {
    std::vector<pal_contact> contacts = on_circle({0, 8}, 0);
    for (double& d : contacts[0].displacement) d += tremble(random);
    const double t = kTurn * frame;
    contacts[1].displacement[0] = kReach * std::cos(t);
    contacts[1].displacement[1] = kReach * std::sin(t);
    refine(session);
    return session.touch(contacts);
  };
  for (int frame = 0; frame < PAL_ZONE_STIFFNESS_FRAMES; ++frame) touch(0);
  int left = 0;
  for (int frame = 0; frame < 200; ++frame) {
    // The tissue under the trembling tool alternately softens and stiffens.
    if (frame % 40 == 20) {
      const Eigen::Vector3d centre =
          organ.block.model.positions[static_cast<size_t>(organ.block.sites.sites[0].node)];
      const pal_inclusion inclusion = {
          sizeof(pal_inclusion), 0, {centre[0], centre[1], centre[2]}, 0.2, frame % 80 == 20 ? 2.0 : 0.5};
      require(pal_session_set_inclusion(session.get(), &inclusion), "inclusion");
    }
    left += has_ended(touch(frame)) ? 0 : 1;
  }
  EXPECT_LE(left, 20);  // unconverged frames, after each change of the tissue
}

struct Tangents {
  uint32_t oldest = 0;  // frames
  int taken = 0;        // number of tangents, over all groups
  int made = 0;         // by frames
};

Tangents tangents_of(OwnedSession& session, int frames, const std::function<void(int)>& touch) {
  const ZoneState& zone = session.get()->tissue.zone;
  std::vector<uint32_t> ages(pack::kMostZoneContacts);
  Tangents tangents;
  for (int frame = 0; frame < frames; ++frame) {
    touch(frame);
    for (uint32_t g = 0; g < zone.active.num_groups; ++g) {
      const uint32_t age = zone.active.groups[g].tangent.age;
      tangents.taken += age <= ages[g] && ages[g] > 0 ? 1 : 0;
      tangents.made += age == 0 && ages[g] > 0 ? 1 : 0;
      tangents.oldest = std::max(tangents.oldest, age);
      ages[g] = age;
    }
  }
  return tangents;
}

// A contact's stiffness comes from a tangent at most PAL_ZONE_STIFFNESS_FRAMES old.
TEST(ZoneMotion, TangentsAreMadeInTime) {
  for (const int cells : {4, 5, 6}) {
    for (const uint32_t rings : {1u, 2u, 3u}) {
      const ZoneBlock& organ = tissue_block(3, false, Eigen::Vector3d::Zero(), cells, 1.05 / cells);
      for (const std::vector<uint32_t>& sites : kSets) {
        SCOPED_TRACE(testing::Message() << cells << " cells, " << rings << " rings, " << sites.size());
        for (const int every : {0, 4}) {  // frames from an iteration of the lane to the next; 0: none
          OwnedSession session(organ.pack->get(), organ.config(4, rings));
          session.touch(on_circle(sites, 0));
          const Tangents tangents = tangents_of(session, 150, [&](int frame) {
            session.touch(on_circle(sites, frame));
            if (every > 0 && frame % every == 0) refine(session);
          });
          EXPECT_GE(tangents.taken, every > 0 ? 150 / every - 2 : 150 / PAL_ZONE_STIFFNESS_FRAMES);
          if (every > 0) {
            EXPECT_EQ(tangents.made, 0);
          }
          EXPECT_LT(tangents.oldest, every > 0 ? 2 * every : PAL_ZONE_STIFFNESS_FRAMES);
        }
      }
    }
  }
}

// A frame that ends with a step which it does not evaluate tells the energy at the end of that step.
TEST(ZoneMotion, EnergyIsThatOfWhereTheZoneIs) {
  const ZoneBlock& organ = tissue_block(2, false, {0.02, 0.01, -0.06});
  const std::vector<uint32_t>& sites = kSets.front();
  OwnedSession session(organ.pack->get(), organ.config(4));
  settle(session, on_circle(sites, 0));
  const TissueState& tissue = session.get()->tissue;
  double largest = 0;
  double most = 0;
  for (int frame = 1; frame < 40; ++frame) {
    session.touch(on_circle(sites, frame));
    const double moving = tissue.stored_energy;
    session.touch(on_circle(sites, frame));
    largest = std::max(largest, std::abs(tissue.stored_energy));
    most = std::max(most, std::abs(moving - tissue.stored_energy));
  }
  EXPECT_GT(largest, 0);
  EXPECT_LE(most, 1e-8 * largest);
}

// A residual of pure rounding does not shrink, and that says nothing about the tangent.
TEST(ZoneMotion, AToolHeldStillMakesNoTangents) {
  const ZoneBlock& organ = tissue_block(2);
  for (const std::vector<uint32_t>& sites : kSets) {
    SCOPED_TRACE(sites.size());
    OwnedSession session(organ.pack->get(), organ.config(4));
    settle(session, on_circle(sites, 0));
    const Tangents tangents = tangents_of(session, 100, [&](int) { session.touch(on_circle(sites, 0)); });
    EXPECT_LE(tangents.taken, 1);
  }
}

// Slices of the refining lane until the set for which a frame has asked is prepared.
int prepare_in_slices(OwnedSession& session, uint64_t operations) {
  pal_refinement refinement = {};
  refinement.struct_size = sizeof refinement;
  int slices = 0;
  for (; refinement.delivered == 0; ++slices)
    require(pal_session_refine(session.get(), operations, &refinement), "refine");
  return slices;
}

// The lane makes the first tangents, so the first frame of a new set assembles none.
TEST(ZoneMotion, PreparedSetsHaveTheirTangents) {
  const ZoneBlock& organ = tissue_block(2);
  OwnedSession session(organ.pack->get(), organ.config(4));
  settle(session, on_circle({4}, 0));
  for (const std::vector<uint32_t>& sites : kSets) {
    if (sites.size() == 1) continue;  // the set that answers
    SCOPED_TRACE(sites.size());
    const std::vector<pal_contact> contacts = on_circle(sites, 0);
    refine(session);  // the iteration under way
    session.touch_once(contacts);
    EXPECT_GT(prepare_in_slices(session, 20000), 10);
    const ZoneSet& prepared = session.get()->tissue.refinement.preparation.set;
    ASSERT_TRUE(prepared.sound);
    for (uint32_t g = 0; g < prepared.num_groups; ++g) EXPECT_TRUE(prepared.groups[g].has_tangent);
    EXPECT_EQ(session.touch_once(contacts).front().model, PAL_MODEL_ZONE);
    const ZoneSet& active = session.get()->tissue.zone.active;
    for (uint32_t g = 0; g < active.num_groups; ++g) {
      EXPECT_TRUE(active.groups[g].has_tangent);
    }
    EXPECT_TRUE(has_ended(settle(session, contacts)));
  }
}

// However small the slices, each does a step, no step is most of the work, and the set is the same to the bit.
TEST(ZoneMotion, SetsArePreparedStepByStep) {
  const ZoneBlock& organ = tissue_block(2);
  for (const std::vector<uint32_t>& sites : kSets) {
    SCOPED_TRACE(sites.size());
    const auto prepared = [&](uint64_t operations, int& slices) {
      OwnedSession session(organ.pack->get(), organ.config(4));
      settle(session, on_circle({1}, 0));
      refine(session);  // the iteration under way
      session.touch_once(on_circle(sites, 0));
      slices = prepare_in_slices(session, operations);
      const std::vector<pal_contact_result> results = session.touch_once(on_circle(sites, 0));
      EXPECT_EQ(results.front().model, PAL_MODEL_ZONE);
      return as_vector(session.field());
    };
    int slices = 0;
    const Eigen::VectorXd whole = prepared(UINT64_MAX, slices);
    EXPECT_EQ(slices, 1);
    EXPECT_EQ(prepared(1, slices), whole);
    EXPECT_GT(slices, 200);
  }
}

// All contacts change at once in strongly strained tissue, where first tangents may need stiffening. The next set converges
// to a new session's state.
TEST(ZoneMotion, OtherContactsGoOnFromThere) {
  for (const int rings : {1, 2}) {
    SCOPED_TRACE(rings);
    const ZoneBlock& organ = tissue_block(rings, false, Eigen::Vector3d::Zero(), 4, 0.1);
    const double edge = organ.block.sites.mean_surface_edge;
    std::mt19937 random(3);
    std::uniform_real_distribution<double> component(-1, 1);
    const auto draw = [&] {
      std::vector<uint32_t> sites(9);
      for (uint32_t site = 0; site < 9; ++site) sites[site] = site;
      std::shuffle(sites.begin(), sites.end(), random);
      std::vector<pal_contact> contacts;
      for (size_t c = 0; c < 1 + random() % 3; ++c) {
        const Eigen::Vector3d d =
            edge * Eigen::Vector3d(component(random), component(random), component(random)).normalized();
        contacts.push_back({sites[c], {d[0], d[1], d[2]}, 0, {}, {}, {}});
      }
      return contacts;
    };
    const auto with_part = [](std::vector<pal_contact> contacts, double part) {
      for (pal_contact& contact : contacts) {
        for (double& d : contact.displacement) d *= part;
      }
      return contacts;
    };
    for (int i = 0; i < 150; ++i) {
      const std::vector<pal_contact> before = draw();
      const std::vector<pal_contact> now = with_part(draw(), 0.3);
      OwnedSession session(organ.pack->get(), organ.config(3));
      for (int step = 1; step <= 10; ++step) session.touch(with_part(before, 0.1 * step));
      for (const pal_contact_result& result : session.touch(now)) {
        ASSERT_EQ(result.model, PAL_MODEL_ZONE) << i;
        ASSERT_EQ(result.flags & PAL_FLAG_NEAREST_SITE, 0U) << i;
      }
      std::vector<pal_contact_result> found;
      for (int frame = 0; frame < 40; ++frame) {
        found = session.touch(now);
        refine(session);
      }
      OwnedSession another(organ.pack->get(), organ.config(3));
      EXPECT_TRUE(!has_ended(found) || worst_force_error(found, settle(another, now)) <= 1e-3) << i;
    }
  }
}

// A third tool grasps beside two that crush tissue. The device feels no force of the new zone before
// convergence.
TEST(ZoneMotion, ANewZoneIsFeltOnceConverged) {
  const ZoneBlock organ(2, CompressibleNeoHookean{1.0, 9.0}, false, Eigen::Vector3d::Zero(), 4, 0.1);
  pal_session_config config = organ.config(3);
  config.max_tools = 3;
  config.blend_seconds = 0.01;
  config.budget_operations = 1000000;
  ToolSession session(organ.pack->get(), config);
  const Eigen::Vector3d ways[] = {{0.204, 0.048, -0.095}, {-0.121, -0.005, -0.196}, {-0.051, -0.012, -0.224}};
  session.hold(0, pal_default_hold(3));
  session.hold(1, pal_default_hold(8));
  std::vector<Eigen::Vector3d> before(3, Eigen::Vector3d::Zero());
  double jump = 0;
  double peak = 0;
  for (int frame = 0; frame < 400; ++frame) {
    if (frame == 200) session.hold(2, pal_default_hold(4));
    std::vector<pal_pose> poses;
    for (int tool = 0; tool < 3; ++tool) {
      const int since = tool < 2 ? frame : std::max(0, frame - 230);
      poses.push_back(at(ways[tool] * std::min(1.0, since / 150.0)));
    }
    const std::vector<pal_tool_result>& results = session.frame(poses);
    for (size_t tool = 0; tool < 3; ++tool) {
      const Eigen::Vector3d force = force_of(results[tool]);
      jump = std::max(jump, (force - before[tool]).norm());
      peak = std::max(peak, force.norm());
      before[tool] = force;
    }
  }
  EXPECT_LE(jump, 0.25 * peak);
}

}  // namespace zone_motion_test
}  // namespace palpate::test
