// nonlinear_zone of contacts at points between sites: what it is beside the blend of zones at the corners, and how
// smooth it is as a contact slides.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <tuple>
#include <vector>

#include "runtime/src/session/session_state.hpp"
#include "tests/support/runtime_session.hpp"
#include "tests/support/small_pack.hpp"
#include "tests/support/tool_session.hpp"
#include "tests/support/zone_block.hpp"

namespace palpate::test {
namespace {

const Eigen::Vector3d kPush(0.01, -0.012, -0.03);

using test::force_of;

Eigen::Vector3d force_of(const pal_contact_result& result) {
  return Eigen::Vector3d(result.force);
}

pal_contact at_site(uint32_t site, const Eigen::Vector3d& d) {
  return {site, {d[0], d[1], d[2]}, 0, {}, {}, {}};
}

// Of a pack with zones, with polynomials beside them or not.
class ZonePlaces : public testing::TestWithParam<bool> {
 protected:
  static const AlignedBytes& bytes() {
    if (GetParam()) return zone_pack_bytes();
    static const AlignedBytes alone = [] {
      PackContent content = small_pack().content();
      content.polynomials = nullptr;
      content.zone = &small_pack().zone;
      return write_pack(content);
    }();
    return alone;
  }

  pal_surface_point point_at(const Eigen::Vector3d& position) const {
    pal_surface_point point;
    require(pal_pack_find_surface_point(pack_.get(), position.data(), &point), "surface point");
    return point;
  }

  pal_contact contact_at(const Eigen::Vector3d& position, const Eigen::Vector3d& d) const {
    const pal_surface_point point = point_at(position);
    return pal_contact_at(&point, d.data());
  }

  struct Answer {
    Eigen::Vector3d force;
    Eigen::VectorXd field;
  };

  // Once it has come to rest, from rest.
  Answer settled(const std::vector<pal_contact>& contacts) const {
    OwnedSession session(pack_.get(), PAL_MODEL_ZONE);
    std::vector<pal_contact_result> results;
    for (int frame = 0; frame <= PAL_ZONE_STIFFNESS_FRAMES; ++frame) results = session.touch(contacts);
    EXPECT_EQ(results.front().flags, 0U);
    EXPECT_EQ(results.front().model, PAL_MODEL_ZONE);
    return {force_of(results.front()), as_vector(session.field())};
  }

  // The blend of the zones at the corners of a place.
  Answer blended(const Eigen::Vector3d& position, const Eigen::Vector3d& d) const {
    const pal_surface_point point = point_at(position);
    Answer blend = {Eigen::Vector3d::Zero(), {}};
    for (int corner = 0; corner < 3; ++corner) {
      const Answer own = settled({at_site(point.sites[corner], d)});
      if (corner == 0) blend.field = Eigen::VectorXd::Zero(own.field.size());
      blend.force += point.weights[corner] * own.force;
      blend.field += point.weights[corner] * own.field;
    }
    return blend;
  }

  const Eigen::Vector3d kPlace{0.17, 0.22, 0.375};
  OpenPack pack_{bytes()};
};

INSTANTIATE_TEST_SUITE_P(MovedBy, ZonePlaces, testing::Bool(),
                         [](const auto& is) { return is.param ? "Polynomials" : "Linear"; });

TEST_P(ZonePlaces, AreNearlyTheBlendOfZonesAtTheirCorners) {
  const double tolerance = GetParam() ? 0.03 : 0.25;
  const Answer blend = blended(kPlace, kPush);
  const Answer answer = settled({contact_at(kPlace, kPush)});
  const pal_surface_point point = point_at(kPlace);
  const Answer nearest = settled(
      {at_site(point.sites[std::max_element(point.weights, point.weights + 3) - point.weights], kPush)});
  EXPECT_LE((answer.force - blend.force).norm(), tolerance * (nearest.force - blend.force).norm());
  EXPECT_LE((answer.field - blend.field).lpNorm<Eigen::Infinity>(),
            tolerance * (nearest.field - blend.field).lpNorm<Eigen::Infinity>());
}

// Contacts that share a zone: beside blends of the zones at all corners of both.
TEST_P(ZonePlaces, OfContactsThatShareAZoneTheyAreNearlyTheBlendToo) {
  const Eigen::Vector3d places[2] = {{0.09, 0.14, 0.375}, {0.2, 0.16, 0.375}};
  const Eigen::Vector3d pushes[2] = {kPush, {0, 0.004, -0.015}};
  const auto answer = [&](const std::vector<pal_contact>& contacts) {
    OwnedSession session(pack_.get(), PAL_MODEL_ZONE);
    std::vector<pal_contact_result> results;
    for (int frame = 0; frame <= PAL_ZONE_STIFFNESS_FRAMES; ++frame) results = session.touch(contacts);
    for (const pal_contact_result& result : results)
      EXPECT_EQ(result.flags & ~uint32_t{PAL_FLAG_OVERLAPPING}, 0U) << "patches at some corners share nodes";
    Eigen::Matrix<double, 6, 1> forces;
    forces << force_of(results[0]), force_of(results[1]);
    return std::pair(forces, as_vector(session.field()));
  };
  const pal_surface_point points[2] = {point_at(places[0]), point_at(places[1])};
  Eigen::Matrix<double, 6, 1> blend = Eigen::Matrix<double, 6, 1>::Zero();
  Eigen::VectorXd field = Eigen::VectorXd::Zero(3 * Eigen::Index{pack_.info().num_nodes});
  double largest = 0;
  Eigen::Matrix<double, 6, 1> nearest = blend;
  Eigen::VectorXd nearest_field;
  for (int one = 0; one < 3; ++one) {
    for (int other = 0; other < 3; ++other) {
      const double weight = points[0].weights[one] * points[1].weights[other];
      const auto [forces, shown] =
          answer({at_site(points[0].sites[one], pushes[0]), at_site(points[1].sites[other], pushes[1])});
      blend += weight * forces;
      field += weight * shown;
      if (weight <= largest) continue;
      largest = weight;
      nearest = forces;
      nearest_field = shown;
    }
  }
  const auto [forces, shown] = answer({contact_at(places[0], pushes[0]), contact_at(places[1], pushes[1])});
  EXPECT_LE((forces - blend).norm(), 0.3 * (nearest - blend).norm());
  EXPECT_LE((shown - field).lpNorm<Eigen::Infinity>(),
            0.3 * (nearest_field - field).lpNorm<Eigen::Infinity>());
}

// As one of two that share a zone slides: it changes triangles, and the zone its sites.
TEST_P(ZonePlaces, SlideBesideAnotherWithoutJumps) {
  const Eigen::Vector3d from(0.09, 0.12, 0.375);
  const Eigen::Vector3d way(0, 0.14, 0);
  const pal_contact other = at_site(small_pack().site_at(60), {0, 0.004, -0.015});
  constexpr int kSteps = 280;
  OwnedSession session(pack_.get(), PAL_MODEL_ZONE);
  Eigen::Vector3d before[2];
  double peak = 0;
  double jump = 0;
  for (int step = -30; step <= kSteps; ++step) {
    const double part = std::max(0, step) / static_cast<double>(kSteps);
    const auto results = session.touch({contact_at(from + part * way, kPush), other});
    for (int c = 0; c < 2; ++c) {
      EXPECT_EQ(results[c].flags & PAL_FLAG_NEAREST_SITE, 0U);
      if (step > 0) jump = std::max(jump, (force_of(results[c]) - before[c]).norm());
      before[c] = force_of(results[c]);
      peak = std::max(peak, before[c].norm());
    }
  }
  EXPECT_LE(jump, 0.03 * peak);
}

// Of contacts that share one, energy, forces and stiffness belong together at a place, too.
TEST_P(ZonePlaces, OfContactsThatShareAZoneForcesAreGradients) {
  const pal_contact other = at_site(small_pack().site_at(60), {0, 0.004, -0.015});
  OwnedSession session(pack_.get(), PAL_MODEL_ZONE);
  const auto settle_at = [&](const Eigen::Vector3d& d) {
    std::vector<pal_contact_result> results;
    for (int frame = 0; frame <= PAL_ZONE_STIFFNESS_FRAMES; ++frame)
      results = session.touch({contact_at({0.09, 0.14, 0.375}, d), other});
    return std::pair(results.front(), session.get()->tissue.stored_energy);
  };
  const pal_contact_result at_push = settle_at(kPush).first;
  constexpr double kStep = 1e-4;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d step = kStep * Eigen::Vector3d::Unit(axis);
    const auto [ahead, energy_ahead] = settle_at(kPush + step);
    const auto [behind, energy_behind] = settle_at(kPush - step);
    EXPECT_NEAR(at_push.force[axis], (energy_ahead - energy_behind) / (2 * kStep),
                2e-3 * force_of(at_push).norm());
    for (int i = 0; i < 3; ++i)
      EXPECT_NEAR(at_push.stiffness[i][axis], (ahead.force[i] - behind.force[i]) / (2 * kStep),
                  2e-3 * at_push.stiffness[2][2]);
  }
}

// Beside nodes that are fixed, one contact, too.
TEST_P(ZonePlaces, BesideFixedNodesTheyAreNearlyTheBlendToo) {
  const auto answer = [&](const pal_contact& contact) {
    OwnedSession session(pack_.get(), session_config(pack_.get(), PAL_MODEL_ZONE, 1, 1));
    session.fix({1});
    pal_contact_result result;
    for (int frame = 0; frame <= PAL_ZONE_STIFFNESS_FRAMES; ++frame)
      result = session.touch({contact}).front();
    EXPECT_EQ(result.flags & PAL_FLAG_NEAREST_SITE, 0U);
    return std::pair(force_of(result), as_vector(session.field()));
  };
  const pal_surface_point point = point_at(kPlace);
  Eigen::Vector3d blend = Eigen::Vector3d::Zero();
  Eigen::VectorXd field = Eigen::VectorXd::Zero(3 * Eigen::Index{pack_.info().num_nodes});
  for (int corner = 0; corner < 3; ++corner) {
    const auto [force, shown] = answer(at_site(point.sites[corner], kPush));
    blend += point.weights[corner] * force;
    field += point.weights[corner] * shown;
  }
  const auto [nearest, nearest_field] =
      answer(at_site(point.sites[std::max_element(point.weights, point.weights + 3) - point.weights], kPush));
  const auto [force, shown] = answer(contact_at(kPlace, kPush));
  EXPECT_LE((force - blend).norm(), 0.3 * (nearest - blend).norm());
  EXPECT_LE((shown - field).lpNorm<Eigen::Infinity>(),
            0.3 * (nearest_field - field).lpNorm<Eigen::Infinity>());
}

// Contacts whose place is all at a neighbour are at that site, whatever was answered before.
TEST_P(ZonePlaces, OfAllOfTheWeightAtANeighbourTheyAreThere) {
  const std::vector<pal_contact> there = {at_site(small_pack().site_at(54), kPush),
                                          at_site(small_pack().site_at(60), {0, 0.004, -0.015})};
  std::vector<pal_contact> said_so = there;
  for (pal_contact& contact : said_so) {
    contact.neighbours[0] = contact.site;
    contact.neighbour_weights[0] = 1;
    contact.site = 0;
  }
  OwnedSession session(pack_.get(), PAL_MODEL_ZONE);
  session.touch({contact_at({0.09, 0.14, 0.375}, kPush), contact_at({0.2, 0.16, 0.375}, kPush)});
  OwnedSession expected(pack_.get(), PAL_MODEL_ZONE);
  for (int frame = 0; frame < 40; ++frame) {
    session.touch(said_so);
    expected.touch(there);
  }
  const Eigen::VectorXd field = as_vector(expected.field());
  EXPECT_LE((as_vector(session.field()) - field).lpNorm<Eigen::Infinity>(), 1e-5 * kPush.norm());
}

// Given forces that displacements at two such places take bring both there.
TEST_P(ZonePlaces, GivenForcesActWhereBothContactsAre) {
  std::vector<pal_contact> pressed = {contact_at({0.09, 0.14, 0.375}, kPush),
                                      contact_at({0.2, 0.16, 0.375}, {0, 0.004, -0.015})};
  const std::vector<pal_contact> moved = pressed;
  OwnedSession session(pack_.get(), PAL_MODEL_ZONE);
  std::vector<pal_contact_result> there;
  for (int frame = 0; frame <= PAL_ZONE_STIFFNESS_FRAMES; ++frame) there = session.touch(moved);
  for (size_t c = 0; c < 2; ++c) {
    pressed[c].force_axes = 7;
    for (int axis = 0; axis < 3; ++axis) {
      pressed[c].displacement[axis] = 0;
      pressed[c].force[axis] = there[c].force[axis];
    }
  }
  OwnedSession again(pack_.get(), PAL_MODEL_ZONE);
  std::vector<pal_contact_result> results;
  for (int frame = 0; frame < 40; ++frame) results = again.touch(pressed);
  for (size_t c = 0; c < 2; ++c) {
    const Eigen::Vector3d wanted(moved[c].displacement);
    EXPECT_EQ(results[c].flags & PAL_FLAG_UNCONVERGED, 0U);
    EXPECT_LE((Eigen::Vector3d(results[c].displacement) - wanted).norm(), 1e-3 * kPush.norm());
    EXPECT_LE((force_of(results[c]) - force_of(there[c])).norm(), 1e-3 * force_of(there[0]).norm());
  }
}

TEST_P(ZonePlaces, StiffnessIsTheDerivativeOfTheForce) {
  OwnedSession session(pack_.get(), PAL_MODEL_ZONE);
  const auto settle = [&](const Eigen::Vector3d& d) {
    std::vector<pal_contact_result> results;
    for (int frame = 0; frame <= PAL_ZONE_STIFFNESS_FRAMES; ++frame)
      results = session.touch({contact_at(kPlace, d)});
    return results.front();
  };
  const pal_contact_result at_push = settle(kPush);
  constexpr double kStep = 1e-4;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d step = kStep * Eigen::Vector3d::Unit(axis);
    const Eigen::Vector3d ahead = force_of(settle(kPush + step));
    const Eigen::Vector3d behind = force_of(settle(kPush - step));
    for (int i = 0; i < 3; ++i)
      EXPECT_NEAR(at_push.stiffness[i][axis], (ahead[i] - behind[i]) / (2 * kStep),
                  2e-3 * at_push.stiffness[2][2]);
  }
}

// From site to site: the zone that answers changes twice, and nobody feels it.
TEST_P(ZonePlaces, SlideWithoutJumps) {
  const Eigen::Vector3d from(0.13, 0.13, 0.375);
  const Eigen::Vector3d way(0.12, 0.12, 0);
  constexpr int kSteps = 200;
  OwnedSession session(pack_.get(), PAL_MODEL_ZONE);
  Eigen::Vector3d before = Eigen::Vector3d::Zero();
  Eigen::VectorXd field_before;
  double peak = 0;
  double jump = 0;
  double field_jump = 0;
  for (int step = -30; step <= kSteps; ++step) {
    const double part = std::max(0, step) / static_cast<double>(kSteps);
    const auto result = session.touch({contact_at(from + part * way, kPush)}).front();
    const Eigen::VectorXd field = as_vector(session.field());
    EXPECT_EQ(result.flags & PAL_FLAG_NEAREST_SITE, 0U);
    if (step > 0) {
      jump = std::max(jump, (force_of(result) - before).norm());
      field_jump = std::max(field_jump, (field - field_before).lpNorm<Eigen::Infinity>());
    }
    before = force_of(result);
    field_before = field;
    peak = std::max(peak, before.norm());
  }
  EXPECT_LE(jump, (GetParam() ? 0.01 : 0.03) * peak);
  EXPECT_LE(field_jump, (GetParam() ? 0.015 : 0.05) * kPush.norm());
}

// A point that trembles about the middle between two sites is answered by one zone, and none is made ready.
TEST_P(ZonePlaces, TremblingTheyStayWithOneZone) {
  pal_session_config config = session_config(pack_.get(), PAL_MODEL_ZONE, 1, 0);
  OwnedSession session(pack_.get(), config);
  const uint32_t here = small_pack().site_at(54);
  const uint32_t there = small_pack().site_at(55);
  const auto between = [&](double weight) {
    pal_contact contact = at_site(here, kPush);
    contact.neighbours[0] = there;
    contact.neighbour_weights[0] = weight;
    return contact;
  };
  for (int frame = 0; frame <= PAL_ZONE_STIFFNESS_FRAMES; ++frame) session.touch({between(0.49)});
  const Eigen::Vector3d before = force_of(session.touch({between(0.49)}).front());
  const Eigen::Vector3d beyond = force_of(session.touch({between(0.51)}).front());
  const Eigen::Vector3d after = force_of(session.touch({between(0.49)}).front());
  EXPECT_LE((after - before).norm(), 1e-6 * before.norm());
  // A little beyond the middle it is still that zone which is moved: what it says there alone, moved.
  EXPECT_LE((beyond - before).norm(), 0.05 * before.norm());
  EXPECT_GT((beyond - before).norm(), 0);
}

// The force that a displacement at a point takes brings it there.
TEST_P(ZonePlaces, GivenForcesActWhereTheContactIs) {
  const pal_contact moved = contact_at(kPlace, kPush);
  const Answer there = settled({moved});
  pal_contact pressed = moved;
  pressed.force_axes = 7;
  for (int axis = 0; axis < 3; ++axis) {
    pressed.displacement[axis] = 0;
    pressed.force[axis] = there.force[axis];
  }
  OwnedSession session(pack_.get(), PAL_MODEL_ZONE);
  pal_contact_result result;
  for (int frame = 0; frame < 40; ++frame) result = session.touch({pressed}).front();
  EXPECT_LE((Eigen::Vector3d(result.displacement) - kPush).norm(), 1e-3 * kPush.norm());
  EXPECT_LE((force_of(result) - there.force).norm(), 1e-3 * there.force.norm());
  EXPECT_LE((as_vector(session.field()) - there.field).lpNorm<Eigen::Infinity>(), 1e-3 * kPush.norm());
}

// With one iteration a frame, which moves the contact or brings its zone to rest, they are borne after several frames.
TEST_P(ZonePlaces, GivenForcesAreBorneByOneIterationAFrame) {
  pal_session_config config = session_config(pack_.get(), PAL_MODEL_ZONE, 1, 0);
  config.zone_iterations = 1;
  OwnedSession session(pack_.get(), config);
  pal_contact pressed = contact_at(kPlace, Eigen::Vector3d::Zero());
  pressed.force_axes = 7;
  const Answer there = settled({contact_at(kPlace, kPush)});
  for (int axis = 0; axis < 3; ++axis) pressed.force[axis] = there.force[axis];
  EXPECT_FALSE(has_ended(session.touch({pressed})));
  int frames = 1;
  while (!has_ended(session.touch({pressed})) && frames < 60) ++frames;
  EXPECT_LT(frames, 60);
}

// Tools that hold two such places: what moves their zone is made ready in pieces, too.
class ZonePlacesOfTools : public ZonePlaces {
 protected:
  static constexpr double kSecondsPerOperation = 1e-9;

  pal_session_config config_with(double operations) const {
    pal_session_config config = session_config(pack_.get(), PAL_MODEL_ZONE, 3, 0);
    config.budget_seconds = operations * kSecondsPerOperation;
    config.seconds_per_operation = operations > 0 ? kSecondsPerOperation : 0;
    return config;
  }
  pal_hold hold_at(const Eigen::Vector3d& position) const {
    const pal_surface_point point = point_at(position);
    pal_hold hold = pal_default_hold(point.sites[0]);
    for (int i = 0; i < 3; ++i) {
      hold.sites[i] = point.sites[i];
      hold.weights[i] = point.weights[i];
    }
    return hold;
  }
  static bool is_preparing(const pal_tool_result& result) { return (result.flags & PAL_FLAG_PREPARING) != 0; }

  const Eigen::Vector3d places_[3] = {{0.09, 0.14, 0.375}, {0.2, 0.16, 0.375}, {0.15, 0.28, 0.375}};
  const std::vector<pal_pose> poses_ = {at({0.005, 0, -0.02}), at({0, 0.004, -0.015}), at({0, 0, -0.01})};
};

INSTANTIATE_TEST_SUITE_P(MovedBy, ZonePlacesOfTools, testing::Bool(),
                         [](const auto& is) { return is.param ? "Polynomials" : "Linear"; });

TEST_P(ZonePlacesOfTools, AreMadeReadyWithinABudget) {
  ToolSession tools(pack_.get(), config_with(20000));
  ToolSession at_once(pack_.get(), config_with(0));
  for (uint32_t tool = 0; tool < 2; ++tool) {
    for (ToolSession* session : {&tools, &at_once}) session->hold(tool, hold_at(places_[tool]));
  }
  int frames = 0;
  while (is_preparing(tools.frame(poses_)[0])) {
    EXPECT_EQ(force_of(tools.last()[0]).norm(), 0) << "not before all of it is ready";
    ASSERT_LT(++frames, 10000);
  }
  EXPECT_GT(frames, 10);
  for (int frame = 0; frame < 60; ++frame) {
    tools.frame(poses_);
    at_once.frame(poses_);
  }
  for (size_t tool = 0; tool < 2; ++tool) {
    EXPECT_EQ(tools.last()[tool].flags & PAL_FLAG_NEAREST_SITE, 0U);
    EXPECT_LE((force_of(tools.last()[tool]) - force_of(at_once.last()[tool])).norm(),
              1e-5 * force_of(at_once.last()[tool]).norm());
  }
}

// A third tool grasps and lets go all the time: what was begun is finished.
TEST_P(ZonePlacesOfTools, ThatChangeAllTheTimeAreAnsweredToo) {
  ToolSession tools(pack_.get(), config_with(20000));
  for (uint32_t tool = 0; tool < 2; ++tool) tools.hold(tool, hold_at(places_[tool]));
  int answered = 0;
  for (int frame = 0; frame < 3000; ++frame) {
    if (frame % 6 == 3) tools.hold(2, hold_at(places_[2]));
    if (frame % 6 == 0) require(pal_tool_release(tools.get(), 2), "release");
    answered += force_of(tools.frame(poses_)[1]).norm() > 0;
    for (const pal_tool_result& result : tools.last()) EXPECT_TRUE(force_of(result).allFinite());
  }
  EXPECT_GT(answered, 1000);
}

// What a tool feels of two places that it holds, their action on each other included.
TEST_P(ZonePlacesOfTools, OfOneToolHaveItsStiffness) {
  ToolSession tools(pack_.get(), config_with(0));
  for (int i = 0; i < 2; ++i) tools.hold(0, hold_at(places_[i]));
  const auto settled_at = [&](const Eigen::Vector3d& p) {
    for (int frame = 0; frame < 2 * PAL_ZONE_STIFFNESS_FRAMES; ++frame) tools.frame({at(p)});
    return tools.last()[0];
  };
  const Eigen::Vector3d place(0.004, -0.006, -0.02);
  const Eigen::Matrix3d stiffness = stiffness_of(settled_at(place));
  constexpr double kStep = 1e-4;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d step = kStep * Eigen::Vector3d::Unit(axis);
    const Eigen::Vector3d ahead = force_of(settled_at(place + step));
    const Eigen::Vector3d behind = force_of(settled_at(place - step));
    EXPECT_LE(((ahead - behind) / (2 * kStep) - stiffness.col(axis)).norm(), 3e-3 * stiffness.norm());
  }
}

// Two contacts whose zones share no node, beside blends of the pair's zones at the corners of the first one's: the
// other feels that it moved.
TEST(ZonePlacesApart, AreEachBetweenTheirSites) {
  const ZoneBlock organ(1, CompressibleNeoHookean{1.0, 4.0}, false, Eigen::Vector3d::Zero(), 8, 0.1);
  const uint32_t corners[3] = {8, 9, 16};
  const double weights[3] = {0.4, 0.35, 0.25};
  const pal_contact other = at_site(40, {0.01, 0, -0.02});
  const auto settled = [&](const pal_contact& contact) {
    OwnedSession session(organ.pack->get(), organ.config(2));
    const auto results = settle(session, {contact, other});
    return std::tuple(results, force_of(results[0]), as_vector(session.field()));
  };
  pal_contact between = at_site(corners[0], kPush);
  Eigen::Vector3d blend = Eigen::Vector3d::Zero();
  Eigen::Vector3d others = Eigen::Vector3d::Zero();
  Eigen::VectorXd field = Eigen::VectorXd::Zero(3 * Eigen::Index{organ.pack->info().num_nodes});
  for (int corner = 0; corner < 3; ++corner) {
    const auto [results, force, own_field] = settled(at_site(corners[corner], kPush));
    blend += weights[corner] * force;
    others += weights[corner] * force_of(results[1]);
    field += weights[corner] * own_field;
    if (corner == 0) continue;
    between.neighbours[corner - 1] = corners[corner];
    between.neighbour_weights[corner - 1] = weights[corner];
  }
  const auto [at_nearest, nearest, nearest_field] = settled(at_site(corners[0], kPush));
  const auto [results, force, own_field] = settled(between);
  EXPECT_EQ(results[0].flags & PAL_FLAG_NEAREST_SITE, 0U);
  EXPECT_LE((force - blend).norm(), 0.3 * (nearest - blend).norm());
  EXPECT_LE((own_field - field).lpNorm<Eigen::Infinity>(),
            0.3 * (nearest_field - field).lpNorm<Eigen::Infinity>());
  EXPECT_LE((force_of(results[1]) - others).norm(), 0.3 * (force_of(at_nearest[1]) - others).norm());
}

}  // namespace
}  // namespace palpate::test
