// Contacts between sites blend the responses at the corners of their triangle, and the blend is continuous.
#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <ostream>
#include <random>

#include "runtime/src/pack/contact_place.hpp"
#include "tests/support/compressed_pack.hpp"
#include "tests/support/small_pack.hpp"
#include "tests/support/tool_session.hpp"

namespace palpate::test {
namespace contact_place_test {

using Point = pal_surface_point;

Point point_near(const pal_pack* pack, const Eigen::Vector3d& position) {
  Point point;
  require(pal_pack_find_surface_point(pack, position.data(), &point), "surface point");
  return point;
}

pal_contact contact_at(const Point& point, const Eigen::Vector3d& d) {
  return pal_contact_at(&point, d.data());
}

pal_contact contact_at_site(uint32_t site, const Eigen::Vector3d& d) {
  return {site, {d[0], d[1], d[2]}, 0, {}, {}, {}};
}

Eigen::Vector3d force_of(const pal_contact_result& result) {
  return Eigen::Vector3d(result.force);
}

Eigen::Matrix3d stiffness_of(const pal_contact_result& result) {
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(&result.stiffness[0][0]);
}

// A pack and the response model that answers.
struct Case {
  const char* name;
  const AlignedBytes& (*bytes)();
  pal_model model;
  Eigen::Vector3d push;
};

const AlignedBytes& linear_pack_bytes() {
  static const AlignedBytes bytes = small_pack().write_linear_only();
  return bytes;
}

void PrintTo(const Case& at_hand, std::ostream* out) {
  *out << at_hand.name;
}

class ContactPlaces : public testing::TestWithParam<Case> {
 protected:
  const Case& at_hand() const { return GetParam(); }
  OpenPack pack_{at_hand().bytes()};
  OwnedSession session_{pack_.get(), at_hand().model};

  // A random point inside a triangle of the touchable surface.
  Point inside() const {
    const pal_geometry geometry = pack_.face().geometry();
    Eigen::Vector3d top = Eigen::Vector3d::Zero();
    Eigen::Vector3d bottom = Eigen::Vector3d::Zero();
    for (uint32_t node = 0; node < geometry.num_nodes; ++node) {
      top = top.cwiseMax(Eigen::Vector3d(geometry.positions + size_t{3} * node));
      bottom = bottom.cwiseMin(Eigen::Vector3d(geometry.positions + size_t{3} * node));
    }
    const Eigen::Vector3d size = top - bottom;
    return point_near(pack_.get(), {bottom[0] + 0.47 * size[0], bottom[1] + 0.58 * size[1], top[2]});
  }
};

INSTANTIATE_TEST_SUITE_P(
    OfEachModel, ContactPlaces,
    testing::Values(Case{"Polynomial", small_pack_bytes, PAL_MODEL_AUTO, {0.01, -0.012, -0.03}},
                    Case{"Rounded", rounded_pack_bytes, PAL_MODEL_POLYNOMIAL, {0.01, -0.012, -0.03}},
                    Case{"Linear", linear_pack_bytes, PAL_MODEL_AUTO, {0.01, -0.012, -0.03}},
                    Case{"LinearBesidePolynomial", small_pack_bytes, PAL_MODEL_LINEAR, {0.01, -0.012, -0.03}},
                    Case{"Compressed", compressed_surface_pack, PAL_MODEL_AUTO, {0.02, -0.03, -0.06}}),
    [](const auto& at_hand) { return std::string(at_hand.param.name); });

TEST_P(ContactPlaces, BlendTheAnswersOfTheirCorners) {
  const Point point = inside();
  const Eigen::Vector3d d = at_hand().push;
  Eigen::Vector3d force = Eigen::Vector3d::Zero();
  Eigen::Matrix3d stiffness = Eigen::Matrix3d::Zero();
  Eigen::VectorXd field;
  for (int corner = 0; corner < 3; ++corner) {
    ASSERT_GT(point.weights[corner], 0.05);
    const auto result = session_.touch({contact_at_site(point.sites[corner], d)}).front();
    force += point.weights[corner] * force_of(result);
    stiffness += point.weights[corner] * stiffness_of(result);
    const Eigen::VectorXd own = point.weights[corner] * as_vector(session_.field());
    field = corner == 0 ? own : field + own;
  }
  const auto result = session_.touch({contact_at(point, d)}).front();
  EXPECT_LE((force_of(result) - force).norm(), 1e-10 * force.norm());
  EXPECT_LE((stiffness_of(result) - stiffness).norm(), 1e-10 * stiffness.norm());
  EXPECT_LE((as_vector(session_.field()) - field).lpNorm<Eigen::Infinity>(),
            field_tolerance(1e-6) * d.norm());
  EXPECT_EQ(result.flags, 0U);
  EXPECT_EQ(result.displacement_error,
            session_.touch({contact_at_site(point.sites[0], d)})[0].displacement_error);
}

TEST_P(ContactPlaces, PushBackWithTheGradientOfAnEnergy) {
  constexpr double kStep = 1e-6;
  const Point point = inside();
  const auto force = [&](const Eigen::Vector3d& d) {
    return force_of(session_.touch({contact_at(point, d)})[0]);
  };
  Eigen::Matrix3d difference;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d step = kStep * Eigen::Vector3d::Unit(axis);
    difference.col(axis) = (force(at_hand().push + step) - force(at_hand().push - step)) / (2 * kStep);
  }
  const Eigen::Matrix3d stiffness = stiffness_of(session_.touch({contact_at(point, at_hand().push)})[0]);
  EXPECT_LE((difference - stiffness).norm(), 1e-5 * stiffness.norm());
  EXPECT_EQ((stiffness - stiffness.transpose()).norm(), 0);
}

// A long path over many triangles in steps of a hundredth of an edge: across sites, edges and corners.
TEST_P(ContactPlaces, SlideWithoutAJump) {
  const pal_geometry geometry = pack_.face().geometry();
  Eigen::Vector3d most = Eigen::Vector3d::Zero();
  for (uint32_t node = 0; node < geometry.num_nodes; ++node)
    most = most.cwiseMax(Eigen::Vector3d(geometry.positions + size_t{3} * node));
  const double step = 0.01 * pack_.info().mean_surface_edge;
  const Eigen::Vector3d d = at_hand().push;
  double peak = 0;
  double force_jump = 0;
  double field_jump = 0;
  double nearest_jump = 0;  // jump of a response that uses only the nearest site
  int crossed = 0;
  Eigen::Vector3d force = Eigen::Vector3d::Zero();
  Eigen::Vector3d nearest = Eigen::Vector3d::Zero();
  Eigen::VectorXd field;
  Point before = {};
  const Eigen::Vector3d from(0.1 * most[0], 0.35 * most[1], most[2]);
  const Eigen::Vector3d to(0.9 * most[0], 0.8 * most[1], most[2]);
  const int steps = static_cast<int>((to - from).norm() / step);
  for (int i = 0; i <= steps; ++i) {
    const Point point = point_near(pack_.get(), from + (to - from) * i / steps);
    const auto at_site = session_.touch({contact_at_site(nearest_site(contact_at(point, d)), d)}).front();
    const auto result = session_.touch({contact_at(point, d)}).front();
    const Eigen::VectorXd shown = as_vector(session_.field());
    if (i > 0) {
      force_jump = std::max(force_jump, (force_of(result) - force).norm());
      nearest_jump = std::max(nearest_jump, (force_of(at_site) - nearest).norm());
      field_jump = std::max(field_jump, (shown - field).lpNorm<Eigen::Infinity>());
      crossed += !std::equal(point.sites, point.sites + 3, before.sites);
    }
    before = point;
    force = force_of(result);
    nearest = force_of(at_site);
    field = shown;
    peak = std::max(peak, force.norm());
  }
  EXPECT_GE(crossed, 4);
  EXPECT_LE(force_jump, 0.01 * peak);
  EXPECT_GE(nearest_jump, 3 * force_jump);
  EXPECT_LE(field_jump, 0.02 * d.norm());
}

TEST_P(ContactPlaces, TakeAWeightOfOneForTheSiteItself) {
  const Eigen::Vector3d d = at_hand().push;
  const auto expected = session_.touch({contact_at_site(2, d)}).front();
  pal_contact contact = contact_at_site(std::numeric_limits<uint32_t>::max(), d);
  contact.neighbours[0] = std::numeric_limits<uint32_t>::max();
  contact.neighbours[1] = 2;
  contact.neighbour_weights[1] = 1;
  const auto result = session_.touch({contact}).front();
  EXPECT_LE((force_of(result) - force_of(expected)).norm(), 1e-10 * force_of(expected).norm());
  EXPECT_EQ(result.flags, 0U);
}

TEST(ContactPlace, RefusesSenselessWeights) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const OpenPack pack(small_pack_bytes());
  OwnedSession session(pack.get(), PAL_MODEL_AUTO);
  const auto status_of = [&](uint32_t neighbour, double first, double second) {
    pal_contact contact = contact_at_site(0, {0, 0, -0.01});
    contact.neighbours[0] = neighbour;
    contact.neighbours[1] = 3;
    contact.neighbour_weights[0] = first;
    contact.neighbour_weights[1] = second;
    pal_contact_result result;
    return pal_contact_frame(session.get(), &contact, 1, &result);
  };
  EXPECT_EQ(status_of(1, 0.3, 0.3), PAL_STATUS_OK);
  EXPECT_EQ(status_of(1, 0.5, 0.5), PAL_STATUS_OK);
  EXPECT_EQ(status_of(99, 0, 0.3), PAL_STATUS_OK);
  EXPECT_EQ(status_of(99, 0.3, 0), PAL_STATUS_NO_SUCH_SITE);
  EXPECT_EQ(status_of(1, -0.1, 0.3), PAL_STATUS_BAD_ARGUMENT);
  EXPECT_EQ(status_of(1, 0.7, 0.4), PAL_STATUS_BAD_ARGUMENT);
  EXPECT_EQ(status_of(1, kNan, 0.4), PAL_STATUS_NOT_FINITE);
  EXPECT_EQ(status_of(1, 1e308, 1e308), PAL_STATUS_BAD_ARGUMENT);
}

// A corner of weight zero may name any site, also where rounding makes the other weights sum to less than 1.
TEST(ContactPlace, LooksAtNoSiteWithoutWeight) {
  constexpr uint32_t kNone = std::numeric_limits<uint32_t>::max();
  const OpenPack pack(small_pack_bytes());
  for (int i = 1; i < 1000; ++i) {
    const double weight = 0.001 * i;
    pal_contact contact = contact_at_site(kNone, {0, 0, -0.01});
    contact.neighbours[0] = 1;
    contact.neighbours[1] = 2;
    contact.neighbour_weights[0] = weight;
    contact.neighbour_weights[1] = 1 - weight;
    OwnedSession session(pack.get(), PAL_MODEL_AUTO);
    pal_contact_result result;
    const pal_status status = pal_contact_frame(session.get(), &contact, 1, &result);
    EXPECT_TRUE(status == PAL_STATUS_OK || status == PAL_STATUS_NO_SUCH_SITE);
    for (const double sum : {1.0, 1 - 9e-7, 1 + 9e-7}) {
      ToolSession tools(pack.get(), session_config(pack.get(), PAL_MODEL_AUTO, 1, 0));
      pal_hold hold = pal_default_hold(kNone);
      hold.sites[1] = 1;
      hold.sites[2] = 2;
      hold.weights[0] = 0;
      hold.weights[1] = weight;
      hold.weights[2] = sum - weight;
      if (hold.weights[2] < 0) continue;
      tools.hold(0, hold);
      EXPECT_GT(test::force_of(tools.frame({at({0, 0, -0.01})})[0]).norm(), 0) << weight;
    }
  }
}

// A tool that holds a point feels the contact's response there, and rotates about the point.
TEST(ContactPlace, HeldByATool) {
  const OpenPack pack(small_pack_bytes());
  pal_session_config config = session_config(pack.get(), PAL_MODEL_AUTO, 3, 0);
  ToolSession tools(pack.get(), config);
  OwnedSession contacts(pack.get(), PAL_MODEL_AUTO);
  const Point point = point_near(pack.get(), {0.17, 0.23, 0.375});
  pal_hold hold = pal_default_hold(0);
  for (int i = 0; i < 3; ++i) {
    hold.sites[i] = point.sites[i];
    hold.weights[i] = point.weights[i];
  }
  const Eigen::Vector3d grip = Eigen::Vector3d(point.position) + Eigen::Vector3d(0, 0, 0.2);
  hold.unstrained = at(grip);
  tools.hold(0, hold);
  const Eigen::Vector3d turn(0.1, 0, 0);
  const pal_tool_result result = tools.frame({pose(grip + Eigen::Vector3d(0, 0, -0.02), turn)})[0];
  const Eigen::Vector3d arm = rotation_vector(turn) * Eigen::Vector3d(0, 0, -0.2);
  const Eigen::Vector3d d = Eigen::Vector3d(0, 0, -0.02) + arm - Eigen::Vector3d(0, 0, -0.2);
  const auto expected = contacts.touch({contact_at(point, d)}).front();
  EXPECT_LE((test::force_of(result) - force_of(expected)).norm(), 1e-10 * force_of(expected).norm());
  EXPECT_LE((torque_of(result) - arm.cross(force_of(expected))).norm(), 1e-10 * force_of(expected).norm());
  EXPECT_EQ(result.flags, 0U);
  EXPECT_EQ(result.model, PAL_MODEL_POLYNOMIAL);
  // A second hold; both holds keep their points.
  tools.hold(1, pal_default_hold(0));
  EXPECT_FALSE(tools.frame({at(grip), at_rest()})[0].flags & PAL_FLAG_NEAREST_SITE);
}

}  // namespace contact_place_test
}  // namespace palpate::test
