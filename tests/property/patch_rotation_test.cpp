// Patches that rotate with their tool, compared with full solves of rotated patches.
#include <gtest/gtest.h>

#include "tests/support/patch_rotation_fixture.hpp"

namespace palpate::test::patch_rotation_fixture {
namespace patch_rotation_test {

using Stiffness = Eigen::Matrix<double, 6, 6>;

// Moves and rotates to `contacts` in steps, then runs frames until convergence.
std::vector<pal_contact_result> settle_turned(OwnedSession& session, const std::vector<pal_contact>& contacts,
                                              const std::vector<Vector3d>& turns) {
  std::vector<pal_contact_result> results;
  for (int step = 1; step <= 10 + PAL_ZONE_STIFFNESS_FRAMES; ++step) {
    const double part = std::min(1.0, step / 10.0);
    std::vector<pal_contact> on_the_way = contacts;
    for (pal_contact& contact : on_the_way) {
      for (double& d : contact.displacement) d *= part;
    }
    std::vector<Matrix3d> rotations;
    for (const Vector3d& turn : turns) rotations.push_back(rotation_vector(part * turn));
    orient(session, rotations);
    results = session.touch(on_the_way);
  }
  return results;
}

struct Errors {
  double field = 0;   // over |d| plus the rotation's displacement of the patch's edge
  double force = 0;   // over the largest force
  double torque = 0;  // over the largest torque
};

Errors errors_of(const ZoneBlock& organ, const std::vector<pal_contact>& contacts,
                 const std::vector<Vector3d>& turns) {
  OwnedSession session(organ.pack->get(), turning(organ));
  const auto results = settle_turned(session, contacts, turns);
  std::vector<Matrix3d> rotations;
  for (const Vector3d& turn : turns) rotations.push_back(rotation_vector(turn));
  const ContactAnswer truth = organ.solve(contacts, {}, rotations);
  Errors errors;
  double force = 0;
  double torque = 0;
  for (size_t c = 0; c < contacts.size(); ++c) {
    EXPECT_EQ(results[c].model, PAL_MODEL_ZONE);
    EXPECT_EQ(results[c].flags & PAL_FLAG_UNCONVERGED, 0U);
    EXPECT_EQ(results[c].displacement_error, 1.0) << "not surveyed";
    const Vector3d found(torque_of(session, static_cast<uint32_t>(c)).torque);
    force = std::max(force, truth.forces[c].norm());
    torque = std::max(torque, truth.torques[c].norm());
    errors.force = std::max(errors.force, (Vector3d(results[c].force) - truth.forces[c]).norm());
    errors.torque = std::max(errors.torque, (found - truth.torques[c]).norm());
  }
  double push = 0;
  for (size_t c = 0; c < contacts.size(); ++c)
    push = std::max(
        push, Vector3d(contacts[c].displacement).norm() + organ.block.scene.tip_radius * turns[c].norm());
  errors.field = (as_vector(session.field()) - truth.field).lpNorm<Eigen::Infinity>() / push;
  errors.force /= force;
  errors.torque /= torque;
  return errors;
}

const std::vector<pal_contact> kTwoThatShareNodes = {{4, {0.02, 0, -0.05}, 0, {}, {}, {}},
                                                     {5, {0, 0.02, -0.04}, 0, {}, {}, {}}};

void expect_exact(const Errors& errors) {
  EXPECT_LE(errors.field, field_tolerance(2e-6));
  EXPECT_LE(errors.force, 1e-6);
  EXPECT_LE(errors.torque, 1e-6);
}

TEST(PatchRotation, EqualsTheFullSolveWhereTheZoneIsTheWholeOrgan) {
  const ZoneBlock& organ = tissue_block(8);
  expect_exact(errors_of(organ, kPress, {kTwist}));
  expect_exact(errors_of(organ, kTwoThatShareNodes, {kTwist, -0.5 * kTwist}));
  expect_exact(errors_of(organ, kTwoThatShareNodes, {Vector3d::Zero(), kTwist}));
  const ZoneBlock& heavy = tissue_block(8, false, {0, 0, -0.2});
  expect_exact(errors_of(heavy, kPress, {kTwist}));
  const ZoneBlock& quadratic = tissue_block(8, true, Vector3d::Zero(), 2, 0.3);
  expect_exact(errors_of(quadratic, {{0, {0.02, -0.01, -0.05}, 0, {}, {}, {}}}, {0.5 * kTwist}));
  const ZoneBlock& shares = tissue_block(8, false, Vector3d::Zero(), 4, 0.26, true);
  expect_exact(errors_of(shares, kPress, {kTwist}));
}

Wrench settled_wrench(OwnedSession& session, const Vector3d& d, const Matrix3d& rotation) {
  pal_contact_result result = {};
  orient(session, {rotation});
  for (int frame = 0; frame < 6; ++frame) result = session.touch({{4, {d[0], d[1], d[2]}, 0, {}, {}, {}}})[0];
  Wrench wrench;
  wrench << Vector3d(result.force), Vector3d(torque_of(session, 0).torque);
  return wrench;
}

// Central differences of converged forces and torques, for rotations on top of the current rotation.
TEST(PatchRotation, StiffnessIsTheDerivative) {
  for (const int rings : {8, 2}) {
    const ZoneBlock& organ = tissue_block(rings);
    OwnedSession session(organ.pack->get(), turning(organ));
    const pal_contact_result result = settle_turned(session, kPress, {kTwist})[0];
    const Vector3d d(kPress[0].displacement);
    const Matrix3d R = rotation_vector(kTwist);
    const pal_contact_torque torque = torque_of(session, 0);
    Stiffness found;
    using Block = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
    const Block by_displacement = Eigen::Map<const Block>(&torque.by_displacement[0][0]);
    found << Eigen::Map<const Block>(&result.stiffness[0][0]), by_displacement.transpose(), by_displacement,
        Eigen::Map<const Block>(&torque.by_rotation[0][0]);
    Stiffness expected;
    constexpr double kStep = 1e-4;
    for (int i = 0; i < 6; ++i) {
      const Vector3d axis = kStep * Vector3d::Unit(i % 3);
      const auto at = [&](double sign) {
        return i < 3 ? settled_wrench(session, d + sign * axis, R)
                     : settled_wrench(session, d, rotation_vector(sign * axis) * R);
      };
      const Wrench after = at(1);
      expected.col(i) = (after - at(-1)) / (2 * kStep);
    }
    const double edge = organ.block.sites.mean_surface_edge;
    Eigen::Matrix<double, 6, 1> scale;
    scale << 1, 1, 1, edge, edge, edge;
    const double size =
        (scale.cwiseInverse().asDiagonal() * expected * scale.cwiseInverse().asDiagonal()).norm();
    const Stiffness wrong =
        scale.cwiseInverse().asDiagonal() * (found - expected) * scale.cwiseInverse().asDiagonal();
    EXPECT_LE(wrong.norm(), (rings == 8 ? 1e-4 : 3e-3) * size) << found << "\n\n" << expected;
  }
}

TEST(PatchRotation, LeavesOtherContactsAlone) {
  const ZoneBlock& organ = tissue_block(2);
  OwnedSession still(organ.pack->get(), organ.config(3));
  OwnedSession turns(organ.pack->get(), turning(organ));
  const auto expected = settle_unrefined(still, kTwoThatShareNodes);
  const auto found = settle_unrefined(turns, kTwoThatShareNodes);
  for (size_t c = 0; c < expected.size(); ++c) {
    EXPECT_EQ(found[c].flags, expected[c].flags);
    EXPECT_EQ(found[c].displacement_error, expected[c].displacement_error);
    EXPECT_LE((Vector3d(found[c].force) - Vector3d(expected[c].force)).norm(),
              1e-9 * Vector3d(expected[c].force).norm());
  }
}

// Contacts join, leave and slide while others stay rotated. Each keeps its rotation, and every frame gives
// finite numbers.
TEST(PatchRotation, StaysWithItsContact) {
  const ZoneBlock& organ = tissue_block(2, false, Vector3d::Zero(), 6, 0.18);
  const std::vector<pal_contact> both = {{0, {0, 0, -0.03}, 0, {}, {}, {}},
                                         {24, {0, 0, -0.03}, 0, {}, {}, {}}};
  const std::vector<Vector3d> turns = {{0, 0, 1}, {0, 0, -1}};
  OwnedSession session(organ.pack->get(), turning(organ));
  settle_turned(session, both, turns);
  orient(session, {rotation_vector(turns[1])});
  session.touch({both[1]});
  const Vector3d at_once(torque_of(session, 0).torque);
  OwnedSession alone(organ.pack->get(), turning(organ));
  settle_turned(alone, {both[1]}, {turns[1]});
  const Vector3d expected(torque_of(alone, 0).torque);
  EXPECT_LE((at_once - expected).norm(), 0.02 * expected.norm());
  // A new contact elsewhere starts without rotation.
  orient(session, {});
  const pal_contact_result elsewhere = session.touch({{2, {0, 0, -0.01}, 0, {}, {}, {}}})[0];
  EXPECT_EQ(elsewhere.flags & PAL_FLAG_UNCONVERGED, 0U);
  EXPECT_LE(Vector3d(torque_of(session, 0).torque).norm(), 0.05 * expected.norm());
  // The point slides far within a triangle in a frame while rotated. Its centre of rotation follows at the
  // rate that the tissue bears.
  orient(session, {rotation_vector(turns[0])});
  const auto slid = [](double weight) { return pal_contact{12, {0, 0, -0.02}, 0, {}, {13, 0}, {weight, 0}}; };
  for (int frame = 0; frame < 40; ++frame) session.touch({slid(0)});
  for (int frame = 0; frame < 40; ++frame) {
    const pal_contact_result result = session.touch({slid(0.45)})[0];
    for (const double component : result.force) ASSERT_TRUE(std::isfinite(component));
    if (frame == 39) {
      EXPECT_EQ(result.flags & PAL_FLAG_UNCONVERGED, 0U);
    }
  }
}

}  // namespace patch_rotation_test
}  // namespace palpate::test::patch_rotation_fixture
