// nonlinear_zone compared with the full finite element solve: exact where the zone is the whole organ.
#include <gtest/gtest.h>

#include "tests/support/nightly.hpp"
#include "tests/support/nonlinear_zone_fixture.hpp"

namespace palpate::test::nonlinear_zone_fixture {
namespace nonlinear_zone_test {

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

const InvariantLaw kStiffYeoh = {2, 0, 0.4, 0.2, {{2.4, 0.8, 0}}};

const InvariantLaw kMooneyRivlin = {0.3, 0.2, 0, 0, {{0.7, 0, 0}}};

const Ogden kOgden = {{{0.5, 1.3}, {0.1, 5.0}, {0.3, -2.0}}, {{0.6, 0, 0.1}}};

const Law kLaws[] = {
    kTissue, kYeoh, kMooneyRivlin, kOgden, StVenantKirchhoff{1.0, 2.0}, LinearElastic{1.0, 2.0}};

// A zone that is the whole organ, with elements of four or ten nodes about the same sites.
ZoneBlock whole_block(const Law& law, bool quadratic, bool shares_volumes = false,
                      const Eigen::Vector3d& gravity = Eigen::Vector3d::Zero()) {
  return {8, law, quadratic, gravity, quadratic ? 2 : 4, quadratic ? 0.3 : 0.26, shares_volumes};
}

// Expects forces as exact as the full solve, and fields to single precision. Without `all` only the neighbours touch,
// which is the hardest of the three contact sets.
void expect_truth_of_each(const ZoneBlock& organ, bool all = true) {
  constexpr double kRounding = field_tolerance(2e-7);
  ASSERT_EQ(organ.zone.most_boundary_nodes, 0);
  for (const auto* contacts : {&kAdjacent, &kOne, &kApart}) {
    if (contacts != &kAdjacent && !all) break;
    SCOPED_TRACE(testing::Message() << contacts->size() << " from " << contacts->front().site);
    expect_truth(organ, *contacts, kRounding, 2e-10);
  }
}

TEST(NonlinearZone, IsTheFullSolveWhereItIsTheWholeOrgan) {
  for (const bool quadratic : {false, true}) {
    for (const Law& law : kLaws) {
      if (quadratic && &law != kLaws && !is_nightly()) continue;  // elements are independent of the law
      SCOPED_TRACE(testing::Message() << law.index() << (quadratic ? ", ten nodes" : ""));
      expect_truth_of_each(whole_block(law, quadratic), &law == kLaws || is_nightly());
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

// Two materials, a half each, the second three times as dense, under gravity.
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

// Nearly incompressible tissue with shared volumes, also at a patch partly held by another contact.
const Law kNearlyIncompressible[] = {
    CompressibleNeoHookean{1.0, 50.0}, InvariantLaw{0.5, 0, 0.1, 0.05, {{25, 3, 0}}},
    Ogden{{{0.5, 1.3}, {0.1, 5.0}, {0.3, -2.0}}, {{25, 0, 0.1}}}, StVenantKirchhoff{1.0, 20.0}};

TEST(NonlinearZone, IsTheFullSolveWhereVolumesAreShared) {
  if (!is_nightly()) GTEST_SKIP() << "only in ./dev test --all";
  for (const bool quadratic : {false, true}) {
    for (const Law& law : kNearlyIncompressible) {
      if (quadratic && !is_nightly()) continue;
      SCOPED_TRACE(testing::Message() << law.index() << (quadratic ? ", ten nodes" : ""));
      expect_truth_of_each(whole_block(law, quadratic, true), &law == kNearlyIncompressible || is_nightly());
    }
  }
}

// Pushed in a single frame: Newton's first steps diverge, and step rejection with shorter steps converges.
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
    // The tangent of the first frames may come from an intermediate state.
    for (int frame = 0; frame < 2; ++frame) found = session.touch(contacts);
    EXPECT_LE((Eigen::Vector3d(found[0].force) - truth.forces[0]).norm(), 1e-4 * truth.forces[0].norm());
    EXPECT_LE((as_vector(session.field()) - truth.field).lpNorm<Eigen::Infinity>(), 1e-4 * 0.12);
  }
}

// Neighbours crush the tissue between them to a hundredth of its volume and less.
TEST(NonlinearZone, FollowsWhatNeighboursCrush) {
  const ZoneBlock& organ = tissue_block(8);
  const std::vector<pal_contact> contacts = {{0, {0.124, 0.124, 0}, 0, {}, {}, {}},
                                             {8, {-0.124, -0.124, 0}, 0, {}, {}, {}}};
  ASSERT_LT(organ.solve(contacts).min_jacobian, 0.01);
  expect_truth(organ, contacts, kFieldTolerance, 1e-6);
}

// Relative to `expected`.
double stiffness_difference(const pal_contact_result& found, const pal_contact_result& expected) {
  const auto of = [](const pal_contact_result& result) {
    return Eigen::Map<const Eigen::Matrix3d>(&result.stiffness[0][0]);
  };
  return (of(found) - of(expected)).norm() / of(expected).norm();
}

// Pushes the first contact far in one frame, and counts the frames that return to an earlier state. The
// contact must then have that state's displacement, force and, to a tolerance, field and stiffness. Other
// contacts may have moved meanwhile.
int count_goings_back(const ZoneBlock& organ, std::vector<pal_contact> contacts) {
  constexpr double kFarther = 1000;
  struct Frame {
    pal_contact_result first;
    Eigen::VectorXd field;
  };
  OwnedSession session(organ.pack->get(), organ.config(4));
  settle_unrefined(session, contacts);
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
             stiffness_difference(now.first, then.first) <= 5e-3 &&  // a tangent of some frames before
             (now.field - then.field).lpNorm<Eigen::Infinity>() <=
                 kFieldTolerance * then.field.lpNorm<Eigen::Infinity>();
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

TEST(NonlinearZone, RejectsAStepAsAWhole) {
  const std::vector<pal_contact> one = {{0, {0.0003, -0.0002, -0.0012}, 0, {}, {}, {}}};
  const std::vector<pal_contact> two = {one[0], {8, {0, 0.0004, 0.0003}, 0, {}, {}, {}}};
  constexpr CompressibleNeoHookean kAlmostIncompressible = {1.0, 1e4};
  const ZoneBlock whole = sharing_block(8, kAlmostIncompressible, false, Eigen::Vector3d::Zero(), 4, 0.3);
  EXPECT_GT(count_goings_back(whole, one), 0) << "else this test shows nothing";
  EXPECT_GT(count_goings_back(whole, two), 0);
}

// Before the refining lane, more rings bring the zone nearer to the full solve.
TEST(NonlinearZone, RingsBringItNearer) {
  const ZoneBlock& organ = tissue_block(4, false, Eigen::Vector3d::Zero(), 6, 0.1);
  const std::vector<pal_contact> contacts = {{12, {0.02, -0.02, -0.1}, 0, {}, {}, {}}};
  const ContactAnswer truth = organ.solve(contacts);
  double before = 1;
  for (const uint32_t rings : {1u, 2u, 3u, 4u}) {
    OwnedSession session(organ.pack->get(), organ.config(1, rings));
    const Eigen::Vector3d force(settle_unrefined(session, contacts)[0].force);
    const double error = (force - truth.forces[0]).norm() / truth.forces[0].norm();
    EXPECT_LT(error, before) << rings << " rings";
    before = 0.8 * error;
  }
  EXPECT_LT(before, 0.01);
}

// A zone holds whole volume patches, so more rings mean more elements.
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
    settle_unrefined(session, contacts);
    const double error = (as_vector(session.field()) - truth.field).lpNorm<Eigen::Infinity>() / 0.05;
    EXPECT_LT(error, before) << rings << " rings";
    before = error;
  }
  EXPECT_LT(before, 0.01);
}

}  // namespace nonlinear_zone_test
}  // namespace palpate::test::nonlinear_zone_fixture
