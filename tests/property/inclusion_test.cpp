// Inclusions that stiffen the tissue while running, compared with full solves of organs that contain them.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "tests/support/inclusion_block.hpp"
#include "tests/support/small_pack.hpp"
#include "tests/support/tool_session.hpp"
#include "tests/support/zone_block.hpp"

namespace palpate::test {
namespace inclusion_test {

using Eigen::Vector3d;

const std::vector<pal_contact> kPress = {{4, {0.03, -0.02, -0.1}, 0, {}, {}, {}}};

void include(OwnedSession& session, const pal_inclusion& inclusion) {
  require(pal_session_set_inclusion(session.get(), &inclusion), "inclusion");
}

// |error of the force| / |force| for a contact.
double force_error(const pal_contact_result& found, const ContactAnswer& truth) {
  return (Vector3d(found.force) - truth.forces[0]).norm() / truth.forces[0].norm();
}

TEST(Inclusion, IsTheFullSolveWhereTheZoneIsTheWholeOrgan) {
  for (const bool quadratic : {false, true}) {
    const ZoneBlock& organ = tissue_block(8, quadratic, Vector3d::Zero(), quadratic ? 2 : 4, 0.3);
    const std::vector<pal_contact> contacts = {{0, {0.02, -0.01, -0.05}, 0, {}, {}, {}}};
    OwnedSession session(organ.pack->get(), organ.config(1));
    for (const double stiffness : {0.1, 10.0}) {
      const pal_inclusion inclusion = ball({0.5, 0.4, 0.6}, 0.3, stiffness);
      include(session, inclusion);
      const auto results = settle(session, contacts);
      const ContactAnswer truth = solve_with(organ, inclusion, contacts);
      EXPECT_LE(force_error(results[0], truth), 1e-6) << stiffness;
      EXPECT_LE((as_vector(session.field()) - truth.field).lpNorm<Eigen::Infinity>(),
                field_tolerance(2e-6) * 0.05);
      EXPECT_GE(force_error(results[0], organ.solve(contacts)), 0.1) << "it has to matter";
    }
  }
}

// While inclusion and tool move, the response is near the full solve; once both hold still, it is exact.
TEST(Inclusion, IsTheFullSolveWhereverBothHaveMoved) {
  for (const bool quadratic : {false, true}) {
    const ZoneBlock& organ = tissue_block(8, quadratic, Vector3d::Zero(), quadratic ? 2 : 4, 0.3);
    OwnedSession session(organ.pack->get(), organ.config(1));
    for (int frame = 0; frame <= 120; ++frame) {
      const double t = 0.05 * frame;
      const pal_inclusion inclusion =
          ball({0.5 + 0.3 * std::cos(t), 0.5, 0.75 + 0.1 * std::sin(t)}, 0.25, 1 + t);
      const Vector3d d(0.05 * std::sin(2 * t), 0.02, -0.05 * (1 - std::cos(t)));
      const std::vector<pal_contact> contacts = {{4, {d[0], d[1], d[2]}, 0, {}, {}, {}}};
      include(session, inclusion);
      const pal_contact_result moving = session.touch(contacts)[0];
      EXPECT_EQ(flags_of(moving), 0U) << frame;
      if (frame % 20 != 10) continue;
      const ContactAnswer truth = solve_with(organ, inclusion, contacts);
      EXPECT_LE(force_error(moving, truth), 1e-5) << frame;
      pal_contact_result held = {};
      for (int still = 0; still < PAL_ZONE_STIFFNESS_FRAMES; ++still) held = session.touch(contacts)[0];
      EXPECT_LE(force_error(held, truth), 2e-12) << frame;
      EXPECT_LE((as_vector(session.field()) - truth.field).lpNorm<Eigen::Infinity>(),
                field_tolerance(2e-7) * d.norm());
      EXPECT_GE(force_error(held, organ.solve(contacts)), 0.01) << "it has to matter";
    }
  }
}

// The response does not depend on the inclusion's path, and a removed inclusion leaves no change.
TEST(Inclusion, LeavesNothingBehind) {
  const ZoneBlock& organ = tissue_block(2, false, Vector3d::Zero(), 4, 0.26, true);
  OwnedSession moved(organ.pack->get(), organ.config(1));
  const Vector3d before(settle(moved, kPress)[0].force);
  for (int frame = 0; frame <= 200; ++frame) {
    include(moved, ball({0.1 + 0.002 * frame, 0.5, 0.8}, 0.25, 6));
    moved.touch(kPress);
  }
  std::vector<pal_contact_result> there = settle(moved, kPress);
  OwnedSession fresh(organ.pack->get(), organ.config(1));
  include(fresh, ball({0.5, 0.5, 0.8}, 0.25, 6));
  const Vector3d of_fresh(settle(fresh, kPress)[0].force);
  EXPECT_LE((Vector3d(there[0].force) - of_fresh).norm(), 1e-6 * of_fresh.norm());
  EXPECT_GE((of_fresh - before).norm(), 0.2 * before.norm());
  require(pal_session_set_inclusion(moved.get(), nullptr), "inclusion");
  there = settle(moved, kPress);
  EXPECT_LE((Vector3d(there[0].force) - before).norm(), 1e-6 * before.norm());
}

// Moves by a quarter of a millimetre a frame in an organ of ten centimetres.
TEST(Inclusion, MovesSmoothly) {
  const ZoneBlock& organ = tissue_block(2);
  OwnedSession session(organ.pack->get(), organ.config(1));
  settle(session, kPress);
  Vector3d last = Vector3d::Zero();
  double largest = 0;
  double peak = 0;
  for (int frame = 0; frame <= 400; ++frame) {
    include(session, ball({0.0025 * frame, 0.5, 0.85}, 0.2, 5));
    const pal_contact_result result = session.touch(kPress)[0];
    EXPECT_EQ(flags_of(result), 0U) << frame;
    const Vector3d force(result.force);
    if (frame > 0) largest = std::max(largest, (force - last).norm());
    peak = std::max(peak, force.norm());
    last = force;
  }
  EXPECT_LE(largest, 0.02 * peak);
}

// Tissue hardened under its own weight stays in its sagged equilibrium.
TEST(Inclusion, RestsWhereTheTissueDoes) {
  const ZoneBlock& organ = tissue_block(2, false, {0.02, 0.01, -0.06});
  OwnedSession session(organ.pack->get(), organ.config(1));
  include(session, ball({0.5, 0.5, 0.9}, 0.3, 20));
  const auto result = settle(session, {{4, {0, 0, 0}, 0, {}, {}, {}}});
  EXPECT_LE(Vector3d(result[0].force).norm(), 1e-9);
}

// Tissue that hardens under a resting tool pushes back. The tool gets this energy back in full on its way
// out, with or without a limit meanwhile.
TEST(Inclusion, BringsEnergyOfItsOwn) {
  const ZoneBlock& organ = tissue_block(2);
  pal_session_config config = pal_default_session_config(organ.pack->get());
  config.model = PAL_MODEL_ZONE;
  constexpr int kDeep = 100;
  const auto press = [&](ToolSession& session) {
    session.hold(0, pal_default_hold(4));
    for (int frame = 0; frame <= kDeep; ++frame) session.frame({at({0, 0, -0.001 * frame})});
    return force_of(session.last()[0]).norm();
  };
  ToolSession free_session(organ.pack->get(), config);
  const double before = press(free_session);
  // The tissue hardens within a frame, and the contact must converge first.
  using Case = std::pair<double, double>;  // force limit, stiffness added in a frame
  for (const auto& [limit, rise] : {Case{HUGE_VAL, 0.02}, Case{1.1 * before, 0.02}, Case{HUGE_VAL, 30.0}}) {
    config.max_force = limit;
    ToolSession session(organ.pack->get(), config);
    press(session);
    for (int frame = 0; frame < 300; ++frame) {
      include(session, ball({0.5, 0.5, 0.9}, 0.3, 1 + std::min(rise * frame, std::max(rise, 4.0))));
      session.frame({at({0, 0, -0.001 * kDeep})});
      EXPECT_EQ(session.last()[0].flags & PAL_FLAG_REDUCED, 0U) << frame;
    }
    EXPECT_GE(session.last()[0].stiffness[2][2] * 0.001 * kDeep, 1.5 * before);
    for (int frame = kDeep; frame >= 0; --frame) {
      session.frame({at({0, 0, -0.001 * frame})});
      EXPECT_EQ(session.last()[0].flags & PAL_FLAG_REDUCED, 0U) << frame;
    }
  }
}

TEST(Inclusion, MakesZonesAnswerWherePolynomialsDo) {
  const OpenPack pack(zone_pack_bytes());
  OwnedSession session(pack.get(), PAL_MODEL_AUTO);
  const pal_contact contact = {small_pack().site_at(54), {0, 0, -0.02}, 0, {}, {}, {}};
  EXPECT_EQ(session.touch({contact})[0].model, PAL_MODEL_POLYNOMIAL);
  include(session, ball({0.1, 0.1, 0.3}, 0.1, 3));
  EXPECT_EQ(session.touch({contact})[0].model, PAL_MODEL_ZONE);
  require(pal_session_set_inclusion(session.get(), nullptr), "inclusion");
  EXPECT_EQ(session.touch({contact})[0].model, PAL_MODEL_POLYNOMIAL);
}

TEST(Inclusion, AnswersArgumentsWithAStatus) {
  const OpenPack pack(zone_pack_bytes());
  OwnedSession session(pack.get(), PAL_MODEL_AUTO);
  const auto status_of = [&](const pal_inclusion& inclusion) {
    return pal_session_set_inclusion(session.get(), &inclusion);
  };
  const Vector3d here(0.1, 0.1, 0.3);
  EXPECT_EQ(pal_session_set_inclusion(nullptr, nullptr), PAL_STATUS_NULL_ARGUMENT);
  EXPECT_EQ(status_of({}), PAL_STATUS_BAD_STRUCT_SIZE);
  for (const double stiffness : {0.0, -1.0, 1e-3, 101.0})
    EXPECT_EQ(status_of(ball(here, 0.1, stiffness)), PAL_STATUS_BAD_ARGUMENT);
  for (const double radius : {0.0, -1.0, 1e200})
    EXPECT_EQ(status_of(ball(here, radius, 2)), PAL_STATUS_BAD_ARGUMENT);
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(status_of(ball({0, kNaN, 0}, 0.1, 2)), PAL_STATUS_NOT_FINITE);
  EXPECT_EQ(status_of(ball(here, kNaN, 2)), PAL_STATUS_NOT_FINITE);
  EXPECT_EQ(status_of(ball(here, 0.1, std::numeric_limits<double>::infinity())), PAL_STATUS_NOT_FINITE);
  EXPECT_EQ(status_of(ball({1e99, 0, 0}, 0.1, 2)), PAL_STATUS_OK);
  EXPECT_TRUE(all_finite(session.touch({{0, {0, 0, -0.02}, 0, {}, {}, {}}})[0]));
  OwnedSession linear(pack.get(), PAL_MODEL_LINEAR);
  EXPECT_EQ(pal_session_set_inclusion(linear.get(), nullptr), PAL_STATUS_NO_SUCH_MODEL);
}

}  // namespace inclusion_test
}  // namespace palpate::test
