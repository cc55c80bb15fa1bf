// Zones with a refining lane, compared with full solves of the whole organ.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "tests/support/column.hpp"
#include "tests/support/inclusion_block.hpp"
#include "tests/support/passivity_fixture.hpp"
#include "tests/support/tool_session.hpp"
#include "tests/support/zone_block.hpp"

namespace palpate::test {
namespace zone_refined_test {

using Eigen::Vector3d;

const std::vector<pal_contact> kOne = {{4, {0.03, -0.02, -0.1}, 0, {}, {}, {}}};
const std::vector<pal_contact> kApart = {{0, {0.03, 0, -0.08}, 0, {}, {}, {}},
                                         {8, {0, 0.04, 0.03}, 0, {}, {}, {}}};
const std::vector<pal_contact> kNear = {{4, {0.02, 0, -0.06}, 0, {}, {}, {}},
                                        {5, {0, 0.03, -0.08}, 0, {}, {}, {}}};

pal_session_config refining(const ZoneBlock& organ, uint32_t max_contacts = 3, uint32_t max_fixed = 0) {
  pal_session_config config = organ.config(max_contacts);
  config.max_fixed = max_fixed;
  return config;
}

// As settle(), and iterations must have come to change nothing.
std::vector<pal_contact_result> settle_refined(OwnedSession& session,
                                               const std::vector<pal_contact>& contacts, uint64_t slice = 0) {
  auto results = settle(session, contacts, slice);
  constexpr double kChange = 1e-8;  // the noise of frames that are done
  session.touch(contacts);
  const pal_refinement last = refine(session, slice);
  EXPECT_EQ(last.failed, 0U);
  EXPECT_LE(last.change, kChange);
  return results;
}

void expect_full_solve(const ZoneBlock& organ, const std::vector<pal_contact>& contacts) {
  OwnedSession session(organ.pack->get(), refining(organ));
  const auto results = settle_refined(session, contacts);
  const ZoneErrors errors = errors_where_it_is(organ, session, contacts, results);
  EXPECT_LE(errors.force, 1e-6);
  EXPECT_LE(errors.field, field_tolerance(2e-6));
  for (const pal_contact_result& result : results) {
    EXPECT_EQ(result.flags & PAL_FLAG_UNREFINED, 0U);
    EXPECT_LE(errors.field, result.displacement_error);
    EXPECT_LE(result.displacement_error, 1e-5);
    EXPECT_LE(result.force_error, 1e-5);
  }
}

// A straight column that is shortened far beyond Euler's load is in equilibrium, too.
TEST(ZoneRefined, AnUnstableEquilibriumIsUnconverged) {
  const ZoneBlock organ = column(kTissue, false, 1.6);
  OwnedSession session(organ.pack->get(), refining(organ, 1));
  const auto is_unconverged = [&](double shortened) {
    const auto results = settle(session, {{0, {0, 0, -shortened}, 0, {}, {}, {}}});
    return (results.front().flags & PAL_FLAG_UNCONVERGED) != 0;
  };
  EXPECT_FALSE(is_unconverged(0.1));
  EXPECT_TRUE(is_unconverged(1.5));
  EXPECT_FALSE(is_unconverged(0.1));
}

TEST(ZoneRefined, IsTheFullSolveWithOneRing) {
  for (const auto* contacts : {&kOne, &kApart, &kNear}) expect_full_solve(tissue_block(1), *contacts);
}

TEST(ZoneRefined, IsTheFullSolveUnderGravityWithTenNodes) {
  expect_full_solve(tissue_block(1, true, Vector3d(0, 0.1, -0.3), 2, 0.6),
                    {{0, {0.03, -0.02, -0.1}, 0, {}, {}, {}}});
}

TEST(ZoneRefined, IsTheFullSolveWithSharedVolumes) {
  expect_full_solve(tissue_block(1, false, Vector3d::Zero(), 3, 0.4, true),
                    {{0, {0.03, -0.02, -0.1}, 0, {}, {}, {}}});
}

TEST(ZoneRefined, FeelsNodesFixedWhileRunning) {
  const ZoneBlock& organ = tissue_block(1);
  for (const uint32_t site : {0u, 5u}) {
    const std::vector<int> fixed = {organ.block.sites.sites[site].node};
    OwnedSession session(organ.pack->get(), refining(organ, 1, 4));
    session.fix(contact_nodes_at(organ, fixed));
    const auto results = settle_refined(session, kOne);
    const ZoneErrors errors = errors_where_it_is(organ, session, kOne, results, fixed);
    EXPECT_LE(errors.force, 1e-6);
    EXPECT_LE(errors.field, field_tolerance(2e-6));
    // On from there by a twentieth of the push, before the next iteration.
    std::vector<pal_contact> farther = kOne;
    for (double& component : farther[0].displacement) component *= 1.05;
    std::vector<pal_contact_result> moved;
    for (int frame = 0; frame < 8; ++frame) moved = session.touch(farther);
    const ZoneErrors behind = errors_where_it_is(organ, session, farther, moved, fixed);
    EXPECT_LE(behind.force, 5e-4);
    EXPECT_LE(behind.field, 1.5e-2) << "as without fixed nodes";
  }
}

// The zone of one ring about the contact holds a part of the inclusion, or nothing of it.
TEST(ZoneRefined, FeelsInclusionsOutsideOfTheZone) {
  const ZoneBlock& organ = tissue_block(1);
  OwnedSession session(organ.pack->get(), refining(organ, 1));
  for (const Vector3d& centre : {Vector3d(0.5, 0.5, 0.8), Vector3d(0.5, 0.4, 0.2)}) {
    const pal_inclusion inclusion = ball(centre, 0.2, 6);
    require(pal_session_set_inclusion(session.get(), &inclusion), "inclusion");
    const auto results = settle_refined(session, kOne);
    const ContactAnswer truth = solve_with(organ, inclusion, kOne);
    EXPECT_LE((Vector3d(results[0].force) - truth.forces[0]).norm(), 1e-6 * truth.forces[0].norm());
    EXPECT_LE((as_vector(session.field()) - truth.field).lpNorm<Eigen::Infinity>(),
              field_tolerance(2e-6) * 0.1);
    EXPECT_GE((organ.solve(kOne).forces[0] - truth.forces[0]).norm(), 2e-3 * truth.forces[0].norm());
  }
}

// Contacts that come and go, and a way back to rest.
TEST(ZoneRefined, FollowsChangingContacts) {
  const ZoneBlock& organ = tissue_block(1);
  OwnedSession session(organ.pack->get(), refining(organ));
  for (const auto* contacts : {&kApart, &kOne, &kNear, &kOne}) {
    EXPECT_NE(session.touch(*contacts)[0].flags & PAL_FLAG_UNREFINED, 0U);
    const auto results = settle_refined(session, *contacts);
    const ZoneErrors errors = errors_where_it_is(organ, session, *contacts, results);
    EXPECT_LE(errors.force, 1e-6);
    EXPECT_LE(errors.field, field_tolerance(2e-6));
  }
  session.touch({});
  std::vector<pal_contact> back = kOne;
  for (double& d : back[0].displacement) d = 0;
  EXPECT_LE(Vector3d(settle_refined(session, back)[0].force).norm(), 1e-9);
}

// The organ bends outside of the zone, by a tenth and by a fifth of its length.
TEST(ZoneRefined, IsTheFullSolveWhereTheOrganBends) {
  const ZoneBlock organ = column(kTissue, false, 1.6);
  for (const double bend : {0.4, 0.8, 1.2, 1.6}) {
    SCOPED_TRACE(bend);
    expect_full_solve(organ, {{0, {bend, 0, 0}, 0, {}, {}, {}}});
  }
}

TEST(ZoneRefined, IsTheFullSolveWherePatchesTurn) {
  const ZoneBlock& organ = tissue_block(1);
  pal_session_config config = refining(organ, 1);
  config.patches_turn = 1;
  OwnedSession session(organ.pack->get(), config);
  const Eigen::Vector3d turn(0.1, -0.2, 0.15);
  const pal_pose turned = pose({0, 0, 0}, turn);
  require(pal_session_set_orientations(session.get(), turned.orientation, 1), "orientations");
  const auto results = settle_refined(session, kOne);
  const ContactAnswer truth = organ.solve(kOne, {}, {rotation_vector(turn)});
  EXPECT_LE((Vector3d(results[0].force) - truth.forces[0]).norm(), 1e-6 * truth.forces[0].norm());
  EXPECT_LE((as_vector(session.field()) - truth.field).lpNorm<Eigen::Infinity>(),
            field_tolerance(2e-6) * 0.1);
}

// A hundredth of a mean edge between two iterations.
TEST(ZoneRefined, StaysNearTheFullSolveInMotion) {
  const ZoneBlock& organ = tissue_block(1);
  OwnedSession session(organ.pack->get(), refining(organ, 2));
  constexpr int kFrames = 40;
  for (int frame = 1; frame <= kFrames; ++frame) {
    std::vector<pal_contact> contacts = kNear;
    for (pal_contact& contact : contacts) {
      for (double& d : contact.displacement) d *= frame * (1.0 / kFrames);
    }
    const auto results = session.touch(contacts);
    refine(session);
    if (frame % 10 != 0) continue;
    const ContactAnswer truth = organ.solve(contacts);
    for (size_t c = 0; c < contacts.size(); ++c)
      EXPECT_LE((Vector3d(results[c].force) - truth.forces[c]).norm(), 2e-3 * truth.forces[c].norm())
          << frame;
  }
}

// The lane's last tangent is that of the whole organ about where it has come to rest.
TEST(ZoneRefined, StiffnessIsTheDerivativeOfTheConvergedForce) {
  constexpr double kStep = 1e-3;
  const ZoneBlock& organ = tissue_block(1);
  for (const auto* contacts : {&kOne, &kNear}) {
    OwnedSession session(organ.pack->get(), refining(organ));
    const auto force_at = [&](int axis, double step) {
      std::vector<pal_contact> moved = *contacts;
      moved[0].displacement[axis] += step;
      return Vector3d(settle(session, moved)[0].force);
    };
    Eigen::Matrix3d difference;
    for (int axis = 0; axis < 3; ++axis)
      difference.col(axis) = (force_at(axis, kStep) - force_at(axis, -kStep)) / (2 * kStep);
    const pal_contact_result found = settle(session, *contacts)[0];
    const Eigen::Matrix3d stiffness = Eigen::Map<const Eigen::Matrix3d>(found.stiffness[0]);
    EXPECT_LE((stiffness - difference).norm(), 1e-3 * difference.norm());
    EXPECT_LE((difference - difference.transpose()).norm(), 1e-4 * difference.norm());
  }
}

// From the second iteration on, at rest: both errors are within the estimates. These follow the error before the iteration, by
// as much as the iteration changes displacements.
TEST(ZoneRefined, EstimatesItsErrorsByItsIterations) {
  const ZoneBlock& organ = tissue_block(1);
  for (const auto* contacts : {&kOne, &kApart, &kNear}) {
    const ContactAnswer truth = organ.solve(*contacts);
    OwnedSession session(organ.pack->get(), refining(organ));
    settle_unrefined(session, *contacts);
    refine(session);
    double before = errors_where_it_is(organ, session, *contacts, session.touch(*contacts)).field;
    for (int iteration = 1; iteration <= 8; ++iteration) {
      for (int frame = 0; frame < 4; ++frame) session.touch(*contacts);
      refine(session);
      const auto results = session.touch(*contacts);
      const ZoneErrors errors = errors_where_it_is(organ, session, *contacts, results);
      EXPECT_LE(errors.field, results[0].displacement_error) << iteration;
      double estimate = 0;
      for (const pal_contact_result& result : results) estimate = std::max(estimate, result.force_error);
      EXPECT_LE(errors.force, estimate) << iteration;
      EXPECT_LE(results[0].displacement_error, 1e-5 + 100 * before) << iteration;
      before = errors.field;
    }
  }
}

TEST(ZoneRefined, DependsOnNoSlices) {
  const ZoneBlock& organ = tissue_block(1);
  OwnedSession whole(organ.pack->get(), refining(organ));
  OwnedSession sliced(organ.pack->get(), refining(organ));
  const auto of_whole = settle_refined(whole, kApart);
  const auto of_sliced = settle_refined(sliced, kApart, 1);
  for (size_t c = 0; c < kApart.size(); ++c) {
    for (int i = 0; i < 3; ++i) EXPECT_EQ(of_whole[c].force[i], of_sliced[c].force[i]);
  }
  EXPECT_EQ(whole.field(), sliced.field());
}

// The factor of a new contact set is that at rest, also of volumes that were deformed before.
TEST(ZoneRefined, FollowsChangingContactsWithSharedVolumes) {
  const ZoneBlock& organ = tissue_block(1, false, Vector3d::Zero(), 3, 0.4, true);
  OwnedSession session(organ.pack->get(), refining(organ));
  for (const uint32_t site : {0u, 3u, 0u}) {
    const std::vector<pal_contact> contacts = {{site, {0.03, -0.02, -0.12}, 0, {}, {}, {}}};
    const auto results = settle_refined(session, contacts);
    EXPECT_LE(errors_where_it_is(organ, session, contacts, results).force, 1e-6);
  }
}

// Flagged until an iteration knows of the inclusion.
TEST(ZoneRefined, SaysThatAnInclusionIsNew) {
  const ZoneBlock& organ = tissue_block(1);
  OwnedSession session(organ.pack->get(), refining(organ, 1));
  settle_refined(session, kOne);
  refine(session);  // of a request that may be left
  EXPECT_EQ(session.touch(kOne)[0].flags & PAL_FLAG_UNREFINED, 0U);
  const pal_inclusion inclusion = ball({0.5, 0.4, 0.5}, 0.2, 6);
  require(pal_session_set_inclusion(session.get(), &inclusion), "inclusion");
  session.touch(kOne);
  const auto results = session.touch(kOne);
  EXPECT_NE(results[0].flags & PAL_FLAG_UNREFINED, 0U);
  EXPECT_EQ(results[0].displacement_error, 1.0);
  for (int iteration = 0; iteration < 2; ++iteration) {
    refine(session);
    session.touch(kOne);
  }
  EXPECT_EQ(session.touch(kOne)[0].flags & PAL_FLAG_UNREFINED, 0U);
}

// Without further iterations: a tool that comes back to rest feels no force of a correction from elsewhere.
TEST(ZoneRefined, ForgetsACorrectionFromFarAway) {
  const ZoneBlock organ = column(kTissue, false, 1.6);
  OwnedSession session(organ.pack->get(), refining(organ, 1));
  settle_refined(session, {{0, {0.8, 0, 0}, 0, {}, {}, {}}});
  std::vector<pal_contact_result> results;
  for (int step = 9; step >= 0; --step) results = session.touch({{0, {0.08 * step, 0, 0}, 0, {}, {}, {}}});
  for (int frame = 0; frame < 4; ++frame) results = session.touch({{0, {0, 0, 0}, 0, {}, {}, {}}});
  EXPECT_NE(results[0].flags & PAL_FLAG_UNREFINED, 0U);
  EXPECT_LE(Vector3d(results[0].force).norm(), 1e-9);
}

// A push that inverts tissue outside of the zone if the exterior followed in one step.
TEST(ZoneRefined, GoesHalfAsFarWhereTissueWouldBeInverted) {
  const ZoneBlock organ = column(kTissue, false, 1.6);
  OwnedSession session(organ.pack->get(), refining(organ, 1));
  std::vector<pal_contact> contacts = {{0, {1.6, 0, 0}, 0, {}, {}, {}}};
  settle_unrefined(session, contacts);
  bool has_failed = false;
  double change = 1;
  for (int frame = 0; frame < 100 && change > 1e-9; ++frame) {
    session.touch(contacts);
    const pal_refinement refinement = refine(session);
    has_failed = has_failed || refinement.failed != 0;
    change = refinement.failed != 0 ? 1 : refinement.change;
  }
  const auto results = session.touch(contacts);
  EXPECT_LE(errors_where_it_is(organ, session, contacts, results).force, 1e-6) << has_failed;
}

// Work of slices between frames, and the frames that took its deliveries, come again to the bit.
TEST(ZoneRefined, ReplaysDeliveriesToTheSameBits) {
  const ZoneBlock& organ = tissue_block(1);
  const pal_session_config config = refining(organ);
  std::vector<uint64_t> buffer(1 << 18);
  OwnedSession session(organ.pack->get(), config);
  require(pal_session_record(session.get(), buffer.data(), buffer.size() * 8), "record");
  std::mt19937 random(1);
  for (int frame = 0; frame < 200; ++frame) {
    std::vector<pal_contact> contacts = frame / 50 % 2 == 0 ? kOne : kNear;
    for (pal_contact& contact : contacts) {
      for (double& d : contact.displacement) d *= std::sin(0.02 * frame);
    }
    session.touch_once(contacts);
    require(pal_session_refine(session.get(), random() % 100000 + 1, nullptr), "refine");
  }
  size_t bytes = 0;
  require(pal_session_stop_recording(session.get(), &bytes, nullptr), "stop");
  OwnedSession again(organ.pack->get(), config);
  pal_replay replay = {};
  replay.struct_size = sizeof replay;
  while (replay.ended == 0) {
    ASSERT_EQ(pal_session_replay(again.get(), buffer.data(), bytes, &replay), PAL_STATUS_OK);
    ASSERT_EQ(replay.diverged, 0U) << "frame " << replay.frames;
  }
  EXPECT_EQ(replay.frames, 200U);
  EXPECT_EQ(session.field(), again.field());
}

// Two bonded neighbours on loops of many turns, with an iteration after each frame or after ten.
TEST(ZoneRefined, LoopsGainNoEnergy) {
  const ZoneBlock& organ = tissue_block(1);
  pal_session_config config = refining(organ, 2);
  config.max_tools = 2;
  constexpr int kFrames = 4000;
  constexpr double kTurn = 2 * 3.14159265358979 / 200;  // an angle a frame
  for (const int frames_to_an_iteration : {1, 10}) {
    for (const double direction : {1.0, -1.0}) {
      ToolSession session(organ.pack->get(), config);
      for (uint32_t tool = 0; tool < 2; ++tool) session.hold(tool, pal_default_hold(kNear[tool].site));
      passivity_fixture::Work work(session);
      for (int frame = 0; frame <= kFrames; ++frame) {
        const double ramp = std::min({1.0, frame / 200.0, (kFrames - frame) / 200.0});
        const double angle = direction * kTurn * frame;
        const auto pose_of_tool = [&](int tool) {
          return at(ramp * Vector3d(0.05 * std::cos(angle), 0.05 * std::sin(angle + tool), -0.05));
        };
        work.frame({pose_of_tool(0), pose_of_tool(1)});
        if (frame % frames_to_an_iteration == 0) refine(session);
      }
      EXPECT_GE(work.done(), -0.003 * work.peak()) << frames_to_an_iteration << " " << direction;
    }
  }
}

// A tool that has not moved, under gravity, and one that has come back: nothing is left to do.
TEST(ZoneRefined, FindsRestBalanced) {
  const ZoneBlock& organ = tissue_block(1, false, {0.02, 0.01, -0.06});
  OwnedSession session(organ.pack->get(), refining(organ, 1));
  const std::vector<pal_contact> still = {{4, {0, 0, 0}, 0, {}, {}, {}}};
  for (int frame = 0; frame < 4; ++frame) {
    session.touch(still);
    EXPECT_EQ(refine(session).failed, 0U);
  }
  EXPECT_EQ(session.touch(still)[0].flags, 0U);
  settle_refined(session, {{4, {0.03, -0.02, -0.1}, 0, {}, {}, {}}});
  EXPECT_LE(Vector3d(settle_refined(session, still)[0].force).norm(), 1e-9);
}

TEST(ZoneRefined, NeedsASessionWithZones) {
  const ZoneBlock& organ = tissue_block(1);
  pal_session_config config = refining(organ);
  config.model = PAL_MODEL_LINEAR;
  const OwnedSession session(organ.pack->get(), config);
  EXPECT_EQ(pal_session_refine(session.get(), 0, nullptr), PAL_STATUS_NO_SUCH_MODEL);
}

}  // namespace zone_refined_test
}  // namespace palpate::test
