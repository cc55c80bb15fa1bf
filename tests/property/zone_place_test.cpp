// Zones of contacts between sites: near the blend of zones at the corners, and smooth while a contact slides.
#include <gtest/gtest.h>

#include "tests/support/zone_place_fixture.hpp"

namespace palpate::test::zone_place_fixture {
namespace zone_place_test {

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

// Fixed nodes beside a single contact.
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

// A contact with all weight at a neighbouring corner equals a contact at the corner's site, whatever came
// before.
TEST_P(ZonePlaces, AllWeightAtANeighbourEqualsTheNeighbour) {
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
    refine(session);
    refine(expected);
  }
  const Eigen::VectorXd field = as_vector(expected.field());
  EXPECT_LE((as_vector(session.field()) - field).lpNorm<Eigen::Infinity>(), 1e-5 * kPush.norm());
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

// From site to site the responding zone changes twice. Each new zone starts from the organ of the last one. The next iterations
// of the exterior then move force and field.
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
    refine(session);
    EXPECT_EQ(result.flags & PAL_FLAG_NEAREST_SITE, 0U);
    if (step > 0) {
      jump = std::max(jump, (force_of(result) - before).norm());
      field_jump = std::max(field_jump, (field - field_before).lpNorm<Eigen::Infinity>());
    }
    before = force_of(result);
    field_before = field;
    peak = std::max(peak, before.norm());
  }
  EXPECT_LE(jump, 0.04 * peak);
  EXPECT_LE(field_jump, 0.1 * kPush.norm());
}

// A point that trembles about the middle between two sites keeps its zone, and the session prepares no other.
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
  // A little beyond the middle the same zone still answers, with its basis transferred.
  EXPECT_LE((beyond - before).norm(), 0.05 * before.norm());
  EXPECT_GT((beyond - before).norm(), 0);
}

// A displaced contact's force, prescribed in turn, brings the contact to the same place.
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
  for (int frame = 0; frame < 40; ++frame) {
    result = session.touch({pressed}).front();
    refine(session);
  }
  EXPECT_LE((Eigen::Vector3d(result.displacement) - kPush).norm(), 1e-3 * kPush.norm());
  EXPECT_LE((force_of(result) - there.force).norm(), 1e-3 * there.force.norm());
  EXPECT_LE((as_vector(session.field()) - there.field).lpNorm<Eigen::Infinity>(), 1e-3 * kPush.norm());
}

// With an iteration a frame, which moves the contact or the zone, the force is reached after several frames.
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

}  // namespace zone_place_test
}  // namespace palpate::test::zone_place_fixture
