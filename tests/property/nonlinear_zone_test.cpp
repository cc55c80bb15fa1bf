// nonlinear_zone beside the full finite element solve, and what it must be exact for.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <utility>

#include "tests/support/nightly.hpp"
#include "tests/support/tool_session.hpp"
#include "tests/support/zone_block.hpp"

namespace palpate::test {
namespace {

constexpr double kFieldTolerance = field_tolerance(2e-6);

void expect_truth(const ZoneBlock& organ, const std::vector<pal_contact>& contacts, double field_tolerance,
                  double force_tolerance, uint32_t rings = 0) {
  OwnedSession session(organ.pack->get(), organ.config(4, rings));
  const auto results = settle(session, contacts);
  const ContactAnswer truth = organ.solve(contacts);
  double push = 0;
  for (const pal_contact& contact : contacts)
    push = std::max(push, Eigen::Vector3d(contact.displacement).norm());
  EXPECT_LE((as_vector(session.field()) - truth.field).lpNorm<Eigen::Infinity>(), field_tolerance * push);
  for (size_t c = 0; c < contacts.size(); ++c) {
    EXPECT_EQ(results[c].model, PAL_MODEL_ZONE);
    EXPECT_EQ(results[c].flags & PAL_FLAG_UNCONVERGED, 0U);
    EXPECT_LE((Eigen::Vector3d(results[c].force) - truth.forces[c]).norm(),
              force_tolerance * truth.forces[c].norm())
        << Eigen::Vector3d(results[c].force).transpose() << " for " << truth.forces[c].transpose();
  }
}

const std::vector<pal_contact> kOne = {{4, {0.03, -0.02, -0.1}, 0, {}, {}, {}}};
// Patches that share nodes, and that do not.
const std::vector<pal_contact> kAdjacent = {{3, {0.02, 0, -0.08}, 0, {}, {}, {}},
                                            {4, {0, 0.02, -0.05}, 0, {}, {}, {}}};
const std::vector<pal_contact> kApart = {{0, {0.03, 0, -0.08}, 0, {}, {}, {}},
                                         {8, {0, 0.04, 0.03}, 0, {}, {}, {}}};
const InvariantLaw kYeoh = {0.5, 0, 0.1, 0.05, {{0.6, 0.2, 0}}};
const InvariantLaw kStiffYeoh = {2, 0, 0.4, 0.2, {{2.4, 0.8, 0}}};

const InvariantLaw kMooneyRivlin = {0.3, 0.2, 0, 0, {{0.7, 0, 0}}};
const Ogden kOgden = {{{0.5, 1.3}, {0.1, 5.0}, {0.3, -2.0}}, {{0.6, 0, 0.1}}};
const Law kLaws[] = {
    kTissue, kYeoh, kMooneyRivlin, kOgden, StVenantKirchhoff{1.0, 2.0}, LinearElastic{1.0, 2.0}};

// A zone that is the whole organ, of elements of four or ten nodes about the same sites.
ZoneBlock whole_block(const Law& law, bool quadratic, bool shares_volumes = false,
                      const Eigen::Vector3d& gravity = Eigen::Vector3d::Zero()) {
  return {8, law, quadratic, gravity, quadratic ? 2 : 4, quadratic ? 0.3 : 0.26, false, shares_volumes};
}

// Of a field, in single precision; forces are as exact as the full solve.
void expect_truth_of_each(const ZoneBlock& organ) {
  constexpr double kRounding = field_tolerance(2e-7);
  ASSERT_EQ(organ.zone.most_boundary_nodes, 0);
  for (const auto* contacts : {&kOne, &kAdjacent, &kApart}) {
    SCOPED_TRACE(testing::Message() << contacts->size() << " from " << contacts->front().site);
    expect_truth(organ, *contacts, kRounding, 2e-10);
  }
}

TEST(NonlinearZone, IsTheFullSolveWhereItIsTheWholeOrgan) {
  for (const bool quadratic : {false, true}) {
    for (const Law& law : kLaws) {
      if (quadratic && &law != kLaws && !is_nightly()) continue;  // elements know nothing of laws
      SCOPED_TRACE(testing::Message() << law.index() << (quadratic ? ", ten nodes" : ""));
      expect_truth_of_each(whole_block(law, quadratic));
    }
  }
}

TEST(NonlinearZone, IsTheFullSolveUnderGravity) {
  for (const bool quadratic : {false, true}) {
    for (const bool shares_volumes : {false, true}) {
      SCOPED_TRACE(testing::Message() << quadratic << shares_volumes);
      const ZoneBlock organ = whole_block(kTissue, quadratic, shares_volumes, {0.02, 0.01, -0.06});
      ASSERT_GT(organ.rest.displacement.lpNorm<Eigen::Infinity>(), 5e-3);
      expect_truth_of_each(organ);
    }
  }
}

// Half of the organ of another tissue, three times as dense, under gravity.
TEST(NonlinearZone, IsTheFullSolveOfTwoMaterials) {
  for (const bool quadratic : {false, true}) {
    for (const bool shares_volumes : {false, true}) {
      SCOPED_TRACE(testing::Message() << quadratic << shares_volumes);
      TouchedBlock block = touched_block(quadratic ? 2 : 4, quadratic ? 0.3 : 0.26, quadratic);
      block.model.materials = {{"soft", kTissue, 1.0}, {"stiff", kStiffYeoh, 3.0}};
      std::vector<int> regions;
      for (Tetrahedron& element : block.model.elements) {
        double x = 0;
        for (size_t k = 0; k < 4; ++k)
          x += 0.25 * block.model.positions[static_cast<size_t>(element.nodes()[k])].x();
        regions.push_back(element.material = x > 0.5 ? 1 : 0);
      }
      if (shares_volumes) form_volume_patches(block.model, regions);
      block.scene.gravity = Eigen::Vector3d(0.02, 0.01, -0.06);
      show_every_node(block);
      expect_truth_of_each(ZoneBlock(8, std::move(block)));
    }
  }
}

// Of a site that has one more, whatever others have; alone and beside a contact that has none.
TEST(NonlinearZone, ARingMoreIsARingMore) {
  std::vector<std::uint8_t> more_rings(16);
  more_rings[4] = 1;
  const auto organ_with = [](int rings, std::vector<std::uint8_t> more) {
    return ZoneBlock(rings, kTissue, false, Eigen::Vector3d::Zero(), 4, 0.26, true, false, std::move(more));
  };
  const ZoneBlock mixed = organ_with(1, more_rings);
  const ZoneBlock narrow = organ_with(1, {});
  const ZoneBlock wide = organ_with(2, {});
  const auto force = [](const ZoneBlock& organ, const std::vector<pal_contact>& contacts) {
    OwnedSession session(organ.pack->get(), organ.config(2));
    return Eigen::Vector3d(settle(session, contacts).front().force);
  };
  const std::vector<pal_contact> at_site = {{4, {0.06, -0.04, -0.2}, 0, {}, {}, {}}};
  const std::vector<pal_contact> at_another = {{8, {0.06, -0.04, -0.2}, 0, {}, {}, {}}};
  EXPECT_LE((force(mixed, at_site) - force(wide, at_site)).norm(), 1e-6 * force(wide, at_site).norm());
  EXPECT_LE((force(mixed, at_another) - force(narrow, at_another)).norm(),
            1e-6 * force(narrow, at_another).norm());
  EXPECT_GT((force(wide, at_site) - force(narrow, at_site)).norm(), 1e-4 * force(wide, at_site).norm());
  for (const auto* contacts : {&kAdjacent, &kApart}) {
    const Eigen::Vector3d truth = mixed.solve(*contacts).forces.front();
    EXPECT_LE((force(mixed, *contacts) - truth).norm(), 5e-3 * truth.norm());
  }
}

// Nearly incompressible, with the volumes of elements shared; at a patch that contacts hold in part, too.
const Law kNearlyIncompressible[] = {
    CompressibleNeoHookean{1.0, 50.0}, InvariantLaw{0.5, 0, 0.1, 0.05, {{25, 3, 0}}},
    Ogden{{{0.5, 1.3}, {0.1, 5.0}, {0.3, -2.0}}, {{25, 0, 0.1}}}, StVenantKirchhoff{1.0, 20.0}};

ZoneBlock sharing_block(int rings, const Law& law, bool quadratic = false,
                        const Eigen::Vector3d& gravity = Eigen::Vector3d::Zero(), int cells = 4,
                        double tip_radius = 0.26) {
  return {rings, law, quadratic, gravity, cells, tip_radius, false, true};
}

TEST(NonlinearZone, IsTheFullSolveWhereVolumesAreShared) {
  for (const bool quadratic : {false, true}) {
    for (const Law& law : kNearlyIncompressible) {
      if (quadratic && &law != kNearlyIncompressible && !is_nightly()) continue;  // elements know nothing of laws
      SCOPED_TRACE(testing::Message() << law.index() << (quadratic ? ", ten nodes" : ""));
      expect_truth_of_each(whole_block(law, quadratic, true));
    }
  }
}

// Pushed in one frame, where the first of Newton's steps lead astray: it goes back and comes in shorter ones.
TEST(NonlinearZone, FindsTheWayOfNearlyIncompressibleTissue) {
  for (const bool quadratic : {false, true}) {
    SCOPED_TRACE(quadratic);
    const ZoneBlock organ = sharing_block(8, CompressibleNeoHookean{1.0, 1e4}, quadratic,
                                          Eigen::Vector3d::Zero(), quadratic ? 2 : 4, 0.3);
    const std::vector<pal_contact> contacts = {{0, {0.03, -0.02, -0.12}, 0, {}, {}, {}}};
    const ContactAnswer truth = organ.solve(contacts);
    OwnedSession session(organ.pack->get(), organ.config(1));
    auto found = session.touch(contacts);
    for (int frame = 0; frame < 100 && found[0].flags != 0; ++frame) found = session.touch(contacts);
    EXPECT_EQ(found[0].flags, 0U);
    // The tangent may be one of the way there in the first of them.
    for (int frame = 0; frame < 2; ++frame) found = session.touch(contacts);
    EXPECT_LE((Eigen::Vector3d(found[0].force) - truth.forces[0]).norm(), 1e-4 * truth.forces[0].norm());
    EXPECT_LE((as_vector(session.field()) - truth.field).lpNorm<Eigen::Infinity>(), 1e-4 * 0.12);
  }
}

// Neighbours that crush what is between them to a hundredth of its volume and less.
TEST(NonlinearZone, FollowsWhatNeighboursCrush) {
  const ZoneBlock& organ = tissue_block(8);
  const std::vector<pal_contact> contacts = {{0, {0.124, 0.124, 0}, 0, {}, {}, {}},
                                             {8, {-0.124, -0.124, 0}, 0, {}, {}, {}}};
  ASSERT_LT(organ.solve(contacts).min_jacobian, 0.01);
  expect_truth(organ, contacts, kFieldTolerance, 1e-6);
}

// As part of the second one's.
double stiffness_difference(const pal_contact_result& found, const pal_contact_result& expected) {
  const auto of = [](const pal_contact_result& result) {
    return Eigen::Map<const Eigen::Matrix3d>(&result.stiffness[0][0]);
  };
  return (of(found) - of(expected)).norm() / of(expected).norm();
}

// Pushes the first contact far in one frame and counts the frames that are back where one before was, for want of a
// way on. The contact then bears what it bore there in balance, not what led astray, and the field is that one but
// for as much as the others have moved meanwhile; its stiffness may be one that was made there since.
int count_goings_back(const ZoneBlock& organ, std::vector<pal_contact> contacts, double field_tolerance) {
  constexpr double kFarther = 1000;
  struct Frame {
    pal_contact_result first;
    Eigen::VectorXd field;
  };
  OwnedSession session(organ.pack->get(), organ.config(4));
  settle(session, contacts);
  std::vector<Frame> frames = {{session.touch(contacts)[0], as_vector(session.field())}};
  for (double& component : contacts[0].displacement) component *= kFarther;
  int goings_back = 0;
  for (int frame = 0; frame < 100; ++frame) {
    Frame now;
    now.first = session.touch(contacts)[0];
    now.field = as_vector(session.field());
    const auto is_there = [&](const Frame& then) {
      return std::equal(now.first.displacement, now.first.displacement + 3, then.first.displacement);
    };
    const auto is_same = [&](const Frame& then) {
      return is_there(then) && std::equal(now.first.force, now.first.force + 3, then.first.force) &&
             stiffness_difference(now.first, then.first) <= 3e-3 &&
             (now.field - then.field).lpNorm<Eigen::Infinity>() <=
                 field_tolerance * then.field.lpNorm<Eigen::Infinity>();
    };
    const auto reach = [](const Frame& there) { return Eigen::Vector3d(there.first.displacement).norm(); };
    if (reach(now) < reach(frames.back()) && std::any_of(frames.begin(), frames.end(), is_there)) {
      ++goings_back;
      EXPECT_TRUE(std::any_of(frames.begin(), frames.end(), is_same)) << frame;
    }
    frames.push_back(std::move(now));
  }
  return goings_back;
}

TEST(NonlinearZone, GoesBackWhole) {
  const std::vector<pal_contact> one = {{0, {0.0003, -0.0002, -0.0012}, 0, {}, {}, {}}};
  const std::vector<pal_contact> two = {one[0], {8, {0, 0.0004, 0.0003}, 0, {}, {}, {}}};
  constexpr CompressibleNeoHookean kAlmostIncompressible = {1.0, 1e4};
  const ZoneBlock whole = sharing_block(8, kAlmostIncompressible, false, Eigen::Vector3d::Zero(), 4, 0.3);
  EXPECT_GT(count_goings_back(whole, one, kFieldTolerance), 0) << "else this test shows nothing";
  EXPECT_GT(count_goings_back(whole, two, kFieldTolerance), 0);
  // Zones of their own, with some of the organ outside.
  const ZoneBlock part = sharing_block(1, kAlmostIncompressible, false, Eigen::Vector3d::Zero(), 4, 0.1);
  EXPECT_GT(count_goings_back(part, two, 0.01), 0);
}

// To first order any zone is linear_dd, whatever is in it: the exterior is exact.
TEST(NonlinearZone, IsLinearForSmallDisplacements) {
  const ZoneBlock& organ = tissue_block(1, false, {0.02, 0.01, -0.06});
  ASSERT_GT(organ.zone.most_boundary_nodes, 0);
  for (const auto* contacts : {&kOne, &kAdjacent, &kApart}) {
    std::vector<pal_contact> small = *contacts;
    for (pal_contact& contact : small) {
      for (double& d : contact.displacement) d *= 1e-6;
    }
    OwnedSession zone(organ.pack->get(), organ.config(2));
    OwnedSession linear(organ.pack->get(), PAL_MODEL_LINEAR, 2, 0);
    std::vector<pal_contact_result> found;
    for (int frame = 0; frame < 6; ++frame) found = zone.touch(small);  // groups settle on each other
    const auto expected = linear.touch(small);
    for (size_t c = 0; c < small.size(); ++c) {
      const Eigen::Vector3d force(expected[c].force);
      EXPECT_LE((Eigen::Vector3d(found[c].force) - force).norm(), 1e-4 * force.norm());
      EXPECT_EQ(found[c].flags, expected[c].flags);
    }
  }
}

// So is the field.
TEST(NonlinearZone, FieldIsLinearForSmallDisplacements) {
  const ZoneBlock& organ = tissue_block(1);
  ASSERT_GT(organ.zone.most_boundary_nodes, 0);
  for (const auto* contacts : {&kOne, &kAdjacent, &kApart}) {
    std::vector<pal_contact> small = *contacts;
    double push = 0;
    for (pal_contact& contact : small) {
      for (double& d : contact.displacement) d *= 1e-6;
      push = std::max(push, Eigen::Vector3d(contact.displacement).norm());
    }
    OwnedSession zone(organ.pack->get(), organ.config(2));
    OwnedSession linear(organ.pack->get(), PAL_MODEL_LINEAR, 2, 0);
    for (int frame = 0; frame < 6; ++frame) zone.touch(small);  // groups settle on each other
    linear.touch(small);
    EXPECT_LE((as_vector(zone.field()) - as_vector(linear.field())).lpNorm<Eigen::Infinity>(), 5e-6 * push);
  }
}

// Columns of int16 leave the forces and, but for their rounding, the field as they are, of neighbours with a rim, too.
TEST(NonlinearZone, RoundedColumnsAnswerTheSame) {
  const ZoneBlock& organ = tissue_block(1, false, Eigen::Vector3d::Zero(), 6, 0.1, true);
  ZoneTables rounded = organ.zone;
  ASSERT_FALSE(rounded.rounded);
  rounded.rounded = true;
  const AlignedBytes bytes = pack_of(organ, rounded);
  EXPECT_LT(bytes.bytes().size(), organ.bytes->bytes().size());
  const OpenPack pack(bytes);
  const double size = 0.4 * organ.block.sites.mean_surface_edge;
  for (const auto& [first, second] : {std::pair{0u, 24u}, {6u, 7u}}) {
    SCOPED_TRACE(second);
    const std::vector<pal_contact> contacts = {{first, {0.3 * size, 0, -size}, 0, {}, {}, {}},
                                               {second, {0, 0.3 * size, -size}, 0, {}, {}, {}}};
    OwnedSession exact(organ.pack->get(), organ.config(2));
    OwnedSession session(pack.get(), organ.config(2));
    const auto expected = settle(exact, contacts);
    const auto found = settle(session, contacts);
    for (size_t c = 0; c < contacts.size(); ++c) {
      const Eigen::Vector3d force(expected[c].force);
      EXPECT_LE((Eigen::Vector3d(found[c].force) - force).norm(), 1e-5 * force.norm());
    }
    const double error = (as_vector(session.field()) - as_vector(exact.field())).lpNorm<Eigen::Infinity>();
    EXPECT_LE(error, 1e-4 * size);
    EXPECT_GT(error, 1e-7 * size);
  }
}

// `skew`: of the derivative, what is not symmetric.
void expect_stiffness(const pal_pack* pack, double tolerance, double skew,
                      const std::vector<pal_contact>& neighbours = {}) {
  const auto force_at = [&](const Eigen::Vector3d& d, double* stiffness) {
    OwnedSession session(pack, session_config(pack, PAL_MODEL_ZONE, 2, 0));
    std::vector<pal_contact> contacts = {{4, {d[0], d[1], d[2]}, 0, {}, {}, {}}};
    contacts.insert(contacts.end(), neighbours.begin(), neighbours.end());
    const auto result = settle(session, contacts).front();
    if (stiffness != nullptr) std::memcpy(stiffness, result.stiffness, sizeof result.stiffness);
    return Eigen::Vector3d(result.force);
  };
  const Eigen::Vector3d d(0.03, -0.02, -0.1);
  Eigen::Matrix<double, 3, 3, Eigen::RowMajor> stiffness;
  force_at(d, stiffness.data());
  EXPECT_LE((stiffness - stiffness.transpose()).norm(), 1e-12 * stiffness.norm());
  constexpr double kStep = 1e-5;
  Eigen::Matrix3d difference;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d step = kStep * Eigen::Vector3d::Unit(axis);
    difference.col(axis) = (force_at(d + step, nullptr) - force_at(d - step, nullptr)) / (2 * kStep);
  }
  EXPECT_LE((stiffness - 0.5 * (difference + difference.transpose())).norm(), tolerance * stiffness.norm());
  EXPECT_LE((difference - difference.transpose()).norm(), skew * stiffness.norm());
}

// The stiffness is the derivative of the force and symmetric; but for the orders that the series of the exterior
// leaves out, of which a zone that is the whole organ has none.
TEST(NonlinearZone, StiffnessIsTheDerivativeOfTheForce) {
  for (const auto& [rings, tolerance] : {std::pair{2, 1e-4}, {8, 1e-8}}) {
    SCOPED_TRACE(rings);
    expect_stiffness(ZoneBlock(rings, kTissue).pack->get(), tolerance, 3 * tolerance);
    expect_stiffness(sharing_block(rings, CompressibleNeoHookean{1.0, 20.0}).pack->get(), tolerance,
                     3 * tolerance);
  }
}

// Beside a neighbour, too, whose loads the boundary gives; but for what the rim adds to it.
TEST(NonlinearZone, StiffnessBesideANeighbourIsTheDerivativeOfTheForce) {
  const ZoneBlock& organ = tissue_block(1, false, Eigen::Vector3d::Zero(), 6, 0.1, true);
  ASSERT_GT(organ.zone.most_boundary_nodes, 0);
  const std::vector<pal_contact> neighbour = {{3, {-0.02, 0.03, -0.05}, 0, {}, {}, {}}};
  const AlignedBytes bytes = without_rims(organ);
  expect_stiffness(OpenPack(bytes).get(), 1e-4, 0.015, neighbour);
  expect_stiffness(organ.pack->get(), 5e-3, 0.015, neighbour);
}

// What a pack carries of pairs is nothing to a session of one contact.
TEST(NonlinearZone, OneContactIsTheSameInAnySession) {
  const ZoneBlock& organ = tissue_block(2, false, Eigen::Vector3d::Zero(), 4, 0.26, true);
  OwnedSession alone(organ.pack->get(), organ.config(1));
  OwnedSession of_several(organ.pack->get(), organ.config(2));
  const auto found = settle(alone, kOne).front();
  const auto expected = settle(of_several, kOne).front();
  const Eigen::Matrix3d stiffness = Eigen::Map<const Eigen::Matrix3d>(expected.stiffness[0]);
  EXPECT_GT(stiffness.norm(), 0.1);
  EXPECT_LE((Eigen::Map<const Eigen::Matrix3d>(found.stiffness[0]) - stiffness).norm(),
            1e-9 * stiffness.norm());
  EXPECT_LE((Eigen::Vector3d(found.force) - Eigen::Vector3d(expected.force)).norm(), 1e-9);
}

// The work of contacts at these sites on closed paths of this size, a third of a turn apart, as part of the most that
// it was on the way. Those apart feel each other a frame late: each step has frames to come to rest in.
double work_around(const ZoneBlock& organ, const std::vector<uint32_t>& sites, double size) {
  constexpr int kSteps = 240;
  const auto at = [&](int step) {
    std::vector<pal_contact> contacts;
    for (size_t c = 0; c < sites.size(); ++c) {
      const double angle = 2 * std::numbers::pi * (step / double{kSteps} + static_cast<double>(c) / 3);
      contacts.push_back(
          {sites[c],
           {size * std::cos(angle), size * std::sin(angle), -size * (1.2 + 0.6 * std::sin(2 * angle))},
           0,
           {},
           {},
           {}});
    }
    return contacts;
  };
  OwnedSession session(organ.pack->get(), organ.config(static_cast<uint32_t>(sites.size())));
  std::vector<pal_contact> contacts = at(0);
  settle(session, contacts);
  std::vector<pal_contact_result> results = session.touch(contacts);
  double work = 0;
  double most = 0;
  for (int step = 1; step <= kSteps; ++step) {
    const std::vector<pal_contact> before = std::exchange(contacts, at(step));
    const std::vector<pal_contact_result> felt = std::exchange(results, session.touch(contacts));
    for (int frame = 0; frame < 11; ++frame) results = session.touch(contacts);
    for (size_t c = 0; c < contacts.size(); ++c) {
      EXPECT_EQ(results[c].flags, 0u);
      for (int i = 0; i < 3; ++i) {
        work += 0.5 * (results[c].force[i] + felt[c].force[i]) *
                (contacts[c].displacement[i] - before[c].displacement[i]);
      }
    }
    most = std::max(most, std::abs(work));
  }
  return std::abs(work) / most;
}

// Around closed paths forces do no work, but for the orders that the series of the exterior leaves out, which halve
// with the path, and what the columns of pairs do, which does not.
TEST(NonlinearZone, ClosedPathsGiveNoEnergy) {
  EXPECT_LE(work_around(ZoneBlock(2, kTissue), {4}, 0.05), 2e-5);
  const ZoneBlock& organ = tissue_block(1, false, Eigen::Vector3d::Zero(), 6, 0.1, true);
  for (const std::vector<uint32_t>& sites : {std::vector<uint32_t>{0, 4}, {6, 7}, {0, 4, 22}, {6, 7, 12}}) {
    const double size = 0.1 * organ.block.sites.mean_surface_edge;
    EXPECT_GE(work_around(organ, sites, size), 1e-6) << "rounding halves nothing";
    for (const double part : {1.0, 0.5, 0.25}) {
      EXPECT_LE(work_around(organ, sites, part * size), 3e-4 * part)
          << sites[0] << ", " << sites.size() << " contacts";
    }
  }
}

// With more rings it is nearer to the full solve.
TEST(NonlinearZone, RingsBringItNearer) {
  const ZoneBlock& organ = tissue_block(4, false, Eigen::Vector3d::Zero(), 6, 0.1);
  const std::vector<pal_contact> contacts = {{12, {0.02, -0.02, -0.1}, 0, {}, {}, {}}};
  const ContactAnswer truth = organ.solve(contacts);
  double before = 1;
  for (const uint32_t rings : {1u, 2u, 3u, 4u}) {
    OwnedSession session(organ.pack->get(), organ.config(1, rings));
    settle(session, contacts);
    const double error = (as_vector(session.field()) - truth.field).lpNorm<Eigen::Infinity>() / 0.1;
    EXPECT_LT(error, before) << rings << " rings";
    before = 0.8 * error;
  }
  EXPECT_LT(before, 0.01);
}

// A zone holds whole volume patches, so that rings more are elements more.
TEST(NonlinearZone, HoldsWholeVolumePatches) {
  const ZoneBlock organ =
      sharing_block(3, CompressibleNeoHookean{1.0, 50.0}, false, Eigen::Vector3d::Zero(), 6, 0.1);
  const ZoneFinder finder(organ.block.model);
  const auto patch_of = [&](int e) {
    return organ.block.model.elements[static_cast<size_t>(e)].volume_patch;
  };
  for (const ContactSite& site : organ.block.sites.sites) {
    const std::vector<int> inside = finder.elements_about(site, 1);
    std::set<int> patches;
    for (const int e : inside) patches.insert(patch_of(e));
    for (int e = 0; e < static_cast<int>(organ.block.model.elements.size()); ++e)
      EXPECT_EQ(patches.count(patch_of(e)) > 0, std::ranges::binary_search(inside, e));
  }
  const std::vector<pal_contact> contacts = {{12, {0.01, -0.01, -0.05}, 0, {}, {}, {}}};
  const ContactAnswer truth = organ.solve(contacts);
  double before = 0.05;
  for (const uint32_t rings : {1u, 2u, 3u}) {
    OwnedSession session(organ.pack->get(), organ.config(1, rings));
    settle(session, contacts);
    const double error = (as_vector(session.field()) - truth.field).lpNorm<Eigen::Infinity>() / 0.05;
    EXPECT_LT(error, before) << rings << " rings";
    before = error;
  }
  EXPECT_LT(before, 0.01);
}

// What the organ outside adds is right to fifth order: an error, as part of the push, goes with the fifth power of it.
TEST(NonlinearZone, ErrorsAreOfSixthOrder) {
  const Law yeoh = kYeoh;
  const ZoneBlock organs[] = {ZoneBlock(1, kTissue, false, Eigen::Vector3d::Zero(), 6, 0.1),
                              ZoneBlock(1, yeoh, false, {0.01, 0.02, -0.04}, 6, 0.1),
                              ZoneBlock(1, kTissue, true, Eigen::Vector3d::Zero(), 3, 0.2)};
  for (const ZoneBlock& organ : organs) {
    ASSERT_EQ(organ.zone.exterior_degree, 5);
    const auto site = static_cast<uint32_t>(organ.block.sites.sites.size() / 2);
    const auto errors_at = [&](double size) {
      const std::vector<pal_contact> contacts = {{site, {0.3 * size, -0.3 * size, -size}, 0, {}, {}, {}}};
      const ContactAnswer truth = organ.solve(contacts);
      OwnedSession session(organ.pack->get(), organ.config(1));
      const Eigen::Vector3d force(settle(session, contacts)[0].force);
      return std::pair((as_vector(session.field()) - truth.field).lpNorm<Eigen::Infinity>() / size,
                       (force - truth.forces[0]).norm() / size);
    };
    const double size = 0.4 * organ.block.sites.mean_surface_edge;
    const auto [field, force] = errors_at(size);
    const auto [field_of_half, force_of_half] = errors_at(size / 2);
    EXPECT_LE(field, 3e-3);
    EXPECT_LE(field_of_half, field / 24);
    EXPECT_LE(force_of_half, force / 24);
  }
}

// A block of which only the surface is shown, planned for two contacts up to one edge.
ZoneTables planned(const Law& law, double accuracy_target, TouchedBlock block = touched_block(4, 0.1)) {
  block.scene.max_contacts = 2;
  block.scene.accuracy_target = accuracy_target;
  block.scene.max_displacement = block.sites.mean_surface_edge;
  block.model.materials.front().law = law;
  block.model.materials.push_back({"of no element", CompressibleNeoHookean{1.0, 1e6}});
  return find_zones(block.scene, block.model, block.sites, 1);
}

// The more tissue keeps its volume, the more higher orders leave: packs have more of them.
TEST(NonlinearZone, WhatIsCarriedGoesWithTheLaw) {
  const ZoneTables soft = planned(CompressibleNeoHookean{1.0, 4.0}, 0.005);
  EXPECT_EQ(soft.exterior_degree, 3);
  EXPECT_FALSE(soft.between);
  const ZoneTables keeps_volume = planned(CompressibleNeoHookean{1.0, 9.0}, 0.005);
  EXPECT_EQ(keeps_volume.exterior_degree, 4);
  EXPECT_TRUE(keeps_volume.between);
}

// Where zones of near contacts hold what is between them, any free node may be on a boundary.
TEST(NonlinearZone, WhatMayBeBoundaryHasRows) {
  const TouchedBlock block = touched_block(4, 0.1);
  const ZoneTables zone = planned(kTissue, 1e-5, block);
  ASSERT_TRUE(zone.between);
  std::set<int> with_rows(block.sites.packed_nodes.begin(), block.sites.packed_nodes.end());
  with_rows.insert(zone.inner_nodes.begin(), zone.inner_nodes.end());
  for (size_t i = 0; i < static_cast<size_t>(zone.num_free); ++i)
    EXPECT_TRUE(with_rows.contains(zone.nodes[i])) << zone.nodes[i];
}

TEST(NonlinearZone, ReturnsToRest) {
  const ZoneBlock& organ = tissue_block(2);
  OwnedSession session(organ.pack->get(), organ.config(2));
  settle(session, kApart);
  session.touch({});
  EXPECT_EQ(as_vector(session.field()).lpNorm<Eigen::Infinity>(), 0.0);
  const auto again = session.touch({{4, {0, 0, 0}, 0, {}, {}, {}}}).front();
  EXPECT_LE(Eigen::Vector3d(again.force).norm(), 1e-12);
  // By way of the contacts, too.
  settle(session, kOne);
  const auto back = settle(session, {{4, {0, 0, 0}, 0, {}, {}, {}}}).front();
  EXPECT_LE(Eigen::Vector3d(back.force).norm(), 1e-9);
  EXPECT_LE(as_vector(session.field()).lpNorm<Eigen::Infinity>(), 1e-9);
}

// A set of contacts that changes goes on from where the organ is.
TEST(NonlinearZone, GoesOnWhereItWas) {
  constexpr double kNodeAlone = 0.1;
  const ZoneBlock& organ = tissue_block(2, false, Eigen::Vector3d::Zero(), 4, kNodeAlone);
  OwnedSession session(organ.pack->get(), organ.config(2));
  settle(session, {{4, {0.01, 0, -0.04}, 0, {}, {}, {}}});
  const Eigen::VectorXd before = as_vector(session.field());
  const Eigen::Vector3d place = before.segment<3>(3 * organ.block.sites.sites[0].packed_node);
  std::vector<pal_contact> both = {{4, {0.01, 0, -0.04}, 0, {}, {}, {}}};
  both.push_back({0, {place[0], place[1], place[2]}, 0, {}, {}, {}});
  session.touch(both);
  EXPECT_LE((as_vector(session.field()) - before).lpNorm<Eigen::Infinity>(),
            0.02 * before.lpNorm<Eigen::Infinity>());
}

// At a hundredth of an edge a frame, with the tangent of some frames before.
TEST(NonlinearZone, MovingContactsAreAsThoseHeld) {
  const ZoneBlock& organ = tissue_block(2);
  for (const std::vector<pal_contact>& contacts : {kOne, kAdjacent, kApart}) {
    SCOPED_TRACE(contacts.size());
    OwnedSession moving(organ.pack->get(), organ.config(4));
    OwnedSession held(organ.pack->get(), organ.config(4));
    constexpr int kFrames = 60;
    for (int frame = 0; frame <= kFrames; ++frame) {
      std::vector<pal_contact> here = contacts;
      const double t = 2 * std::numbers::pi * frame / kFrames;
      for (pal_contact& contact : here) {
        contact.displacement[0] = 0.03 * std::cos(t);
        contact.displacement[1] = 0.03 * std::sin(t);
      }
      const auto found = frame == 0 ? settle(moving, here) : moving.touch(here);
      if (frame % 20 != 7) continue;
      const auto expected = settle(held, here);
      for (size_t c = 0; c < contacts.size(); ++c) {
        const Eigen::Vector3d force(expected[c].force);
        EXPECT_EQ(found[c].flags & PAL_FLAG_UNCONVERGED, 0U);
        EXPECT_LE((Eigen::Vector3d(found[c].force) - force).norm(), 1e-3 * force.norm());
      }
      EXPECT_LE((as_vector(moving.field()) - as_vector(held.field())).lpNorm<Eigen::Infinity>(), 1e-3 * 0.1);
    }
  }
}

// Of one, two and three contacts, to four times what the scene asks for and beyond. On the way back what has no flag is
// right.
TEST(NonlinearZone, FarPushesAreFiniteAndFlagged) {
  const ZoneBlock& organ = tissue_block(2);
  const double edge = organ.block.sites.mean_surface_edge;
  TestRandom random(11);
  for (const auto& sites : {std::vector<uint32_t>{4}, {4, 0}, {4, 0, 5}}) {
    SCOPED_TRACE(sites.size());
    const auto pushed = [&](double length) {
      std::vector<pal_contact> contacts;
      for (const uint32_t site : sites) {
        const Eigen::Vector3d d = length * random.vector().normalized();
        contacts.push_back({site, {d[0], d[1], d[2]}, 0, {}, {}, {}});
      }
      return contacts;
    };
    const std::vector<pal_contact> near = pushed(0.5 * organ.block.scene.max_displacement);
    OwnedSession never_far(organ.pack->get(), organ.config(3));
    const auto expected = settle(never_far, near);
    ASSERT_EQ(expected[0].flags & ~uint32_t{PAL_FLAG_OVERLAPPING}, 0U);
    for (const double length : {4 * organ.block.scene.max_displacement, 4 * edge, 1e3, 1e200}) {
      SCOPED_TRACE(length);
      for (int direction = 0; direction < 20; ++direction) {
        const std::vector<pal_contact> far = pushed(length);
        OwnedSession session(organ.pack->get(), organ.config(3));
        const auto touch = [&](const std::vector<pal_contact>& contacts, int frame) {
          auto results = session.touch(contacts);
          for (const pal_contact_result& result : results) EXPECT_TRUE(all_finite(result)) << frame;
          EXPECT_TRUE(all_finite(session.field())) << frame;
          return results;
        };
        for (int frame = 0; frame < 30; ++frame) {
          for (const pal_contact_result& result : touch(far, frame))
            EXPECT_NE(result.flags & PAL_FLAG_EXTRAPOLATED, 0U) << frame;
        }
        int answered = 0;
        double error = 0;
        for (int frame = 0; frame < 100; ++frame) {
          const auto found = touch(near, frame);
          if ((found[0].flags & ~uint32_t{PAL_FLAG_OVERLAPPING}) != 0) continue;
          ++answered;
          error = worst_force_error(found, expected);
          EXPECT_LE(error, 1e-3) << frame;
        }
        EXPECT_GE(answered, 20) << "it has to come back";
        EXPECT_LE(error, 1e-6);
      }
    }
  }
}

// A pack that says less of its zones than they take: their contacts are left to linear_dd, or answered with a flag.
TEST(NonlinearZone, LargerThanThePackSaysItIsNone) {
  const ZoneBlock& organ = tissue_block(1, false, Eigen::Vector3d::Zero(), 6, 0.1);
  const std::vector<pal_contact> apart = {{0, {0.01, 0, -0.02}, 0, {}, {}, {}},
                                          {24, {0, 0.01, -0.02}, 0, {}, {}, {}}};
  const auto lie = [&](int ZoneTables::*most, int value) {
    ZoneTables lying = organ.zone;
    lying.*most = value;
    lying.most_boundary_nodes = std::min(lying.most_boundary_nodes, lying.most_nodes);
    return lying;
  };
  // The last two zones together have more boundary than the arena has room for, though each of their matrices fits.
  for (const ZoneTables& lying :
       {lie(&ZoneTables::most_nodes, 2), lie(&ZoneTables::most_elements, 2),
        lie(&ZoneTables::most_boundary_nodes, 2),
        lie(&ZoneTables::most_boundary_nodes, organ.zone.most_boundary_nodes * 3 / 4)}) {
    const AlignedBytes bytes = pack_of(organ, lying);
    const OpenPack pack(bytes);
    OwnedSession automatic(pack.get(), PAL_MODEL_AUTO, 2, 0);
    OwnedSession linear(pack.get(), PAL_MODEL_LINEAR, 2, 0);
    const auto expected = linear.touch(apart);
    const auto found = automatic.touch(apart);
    for (size_t c = 0; c < apart.size(); ++c) {
      EXPECT_EQ(found[c].model, PAL_MODEL_LINEAR);
      EXPECT_LE((Eigen::Vector3d(found[c].force) - Eigen::Vector3d(expected[c].force)).norm(), 1e-12);
    }
    // Nodes fixed while running are in every group, on top of what the pack says.
    OwnedSession fixing(pack.get(), PAL_MODEL_ZONE, 2, 32);
    std::vector<uint32_t> fixed;
    for (uint32_t node = 0; node < std::min(32u, pack.info().num_contact_nodes); ++node)
      fixed.push_back(node);
    fixing.fix(fixed);
    for (const pal_contact_result& result : fixing.touch(apart)) EXPECT_TRUE(all_finite(result));
    EXPECT_TRUE(all_finite(fixing.field()));
    OwnedSession zone(pack.get(), PAL_MODEL_ZONE, 2, 0);
    for (const pal_contact_result& result : zone.touch(apart)) {
      EXPECT_TRUE(all_finite(result));
      EXPECT_TRUE(result.flags & PAL_FLAG_ILL_CONDITIONED);
    }
    EXPECT_TRUE(all_finite(zone.field()));
  }
}

// What another model answered in between is not where the zone had been.
TEST(NonlinearZone, BeginsAtRestAfterAnotherModel) {
  const ZoneBlock& organ = tissue_block(2);
  OwnedSession session(organ.pack->get(), session_config(organ.pack->get(), PAL_MODEL_AUTO, 9, 0));
  settle(session, {{4, {0, 0, 0.3}, 0, {}, {}, {}}});  // further than a frame brings it back
  const std::vector<pal_contact> more_than_zones_answer(9, kOne[0]);
  EXPECT_EQ(session.touch(more_than_zones_answer)[0].model, PAL_MODEL_LINEAR);
  std::vector<pal_contact> light = kOne;
  for (double& d : light[0].displacement) d *= 0.01;
  const auto result = session.touch(light)[0];
  EXPECT_EQ(result.model, PAL_MODEL_ZONE);
  OwnedSession fresh(organ.pack->get(), organ.config(1));
  const Eigen::Vector3d expected(settle(fresh, light)[0].force);
  EXPECT_LE((Eigen::Vector3d(result.force) - expected).norm(), 1e-3 * expected.norm());
}

// Made ready in slices it is as at once, of one contact, and of three with what their fields count twice; until then
// what was before answers.
TEST(NonlinearZone, IsMadeReadyWithinABudget) {
  const ZoneBlock& one = tissue_block(2);
  const ZoneBlock& three = tissue_block(1, false, Eigen::Vector3d::Zero(), 6, 0.1, true);
  for (const auto& [organ, sites] :
       {std::pair<const ZoneBlock&, std::vector<uint32_t>>{one, {4}}, {three, {0, 4, 22}}}) {
    SCOPED_TRACE(sites.size());
    const auto count = static_cast<uint32_t>(sites.size());
    pal_session_config config = organ.config(count);
    config.max_tools = count;
    ToolSession at_once(organ.pack->get(), config);
    config.budget_seconds = 40e-6;
    config.seconds_per_operation = 1e-9;
    ToolSession sliced(organ.pack->get(), config);
    for (ToolSession* session : {&at_once, &sliced}) {
      for (uint32_t tool = 0; tool < count; ++tool) session->hold(tool, pal_default_hold(sites[tool]));
    }
    int preparing = 0;
    for (int frame = 0; frame < 400; ++frame) {
      const double depth = 0.05 * std::min(1.0, frame / 300.0);
      const std::vector<pal_pose> poses(count, pose({0, 0, -depth}, {0, 0, 0}));
      const auto first = at_once.frame(poses);
      const auto second = sliced.frame(poses);
      preparing += (second[0].flags & PAL_FLAG_PREPARING) != 0 ? 1 : 0;
      EXPECT_EQ(first[0].flags & PAL_FLAG_PREPARING, 0U);
      for (uint32_t tool = 0; tool < count && frame == 399; ++tool) {
        EXPECT_EQ(second[tool].model, PAL_MODEL_ZONE);
        EXPECT_LE((force_of(first[tool]) - force_of(second[tool])).norm(),
                  1e-6 * force_of(first[tool]).norm());
      }
    }
    EXPECT_GT(preparing, 2);
    EXPECT_LT(preparing, 300);
  }
}

}  // namespace
}  // namespace palpate::test
