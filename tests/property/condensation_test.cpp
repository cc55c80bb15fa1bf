// The exterior of a zone, condensed onto the zone's boundary, against Eigen's dense elimination of the offline
// solver's stiffness.
#include "runtime/src/exterior/condensation.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "offline/numerics/decompositions.hpp"
#include "tests/support/condensed_organ.hpp"

namespace palpate {
namespace condensation_test {

using test::CondensedOrgan;
using test::tissue_block;
using test::ZoneBlock;

// Panels are float32.
constexpr double kFloatPanels = 2e-5;

CondensedOrgan condensed(const ZoneBlock& organ) {
  const ZoneFinder finder(organ.block.model);
  return CondensedOrgan(organ, finder.elements_about(organ.block.sites.sites.front(), 1));
}

void forward_substitute(CondensedOrgan& of, const Condensation& condensation, double* forces) {
  for (uint32_t f = 0; f < condensation.num_fronts; ++f)
    forward_substitute_front(condensation, of.kernel, f, of.scratch, forces);
}

void backward_substitute(CondensedOrgan& of, const Condensation& condensation, double* values) {
  for (uint32_t f = condensation.num_fronts; f-- > 0;)
    backward_substitute_front(condensation, of.kernel, f, of.scratch, values);
}

double relative_error(const Eigen::MatrixXd& found, const Eigen::MatrixXd& expected) {
  return (found - expected).cwiseAbs().maxCoeff() / expected.cwiseAbs().maxCoeff();
}

void expect_condensed(const ZoneBlock& organ) {
  CondensedOrgan of = condensed(organ);
  ASSERT_TRUE(of.run());
  EXPECT_GT(of.slices, 3);
  ASSERT_GT(of.exterior.num_kept, 0u);
  const std::vector<Eigen::Index> outside = of.dofs_of(NodeRole::eliminated);
  const std::vector<Eigen::Index> boundary = of.dofs_of(NodeRole::kept);
  const Eigen::MatrixXd stiffness = of.stiffness(true);
  const Eigen::MatrixXd K_OO = stiffness(outside, outside);
  const Eigen::MatrixXd K_OB = stiffness(outside, boundary);
  const auto inside = [&](const Eigen::MatrixXd& forces) { return solve_definite(K_OO, forces); };
  const Eigen::MatrixXd expected = stiffness(boundary, boundary) - K_OB.transpose() * inside(K_OB);
  Eigen::MatrixXd found = expected;
  std::vector<Eigen::Index> place_of(of.pack.organ.num_nodes, -1);
  for (uint32_t i = 0; i < of.exterior.num_kept; ++i)
    place_of[of.exterior.kept[i]] = static_cast<Eigen::Index>(3 * i);
  const auto row_of = [&](Eigen::Index dof) { return place_of[static_cast<size_t>(dof / 3)] + dof % 3; };
  for (Eigen::Index j = 0; j < found.cols(); ++j) {
    for (Eigen::Index i = 0; i < found.rows(); ++i)
      found(i, j) = static_cast<double>(
          of.exterior.schur[row_of(boundary[static_cast<size_t>(j)]) * of.exterior.schur_stride +
                            row_of(boundary[static_cast<size_t>(i)])]);
  }
  EXPECT_LT(relative_error(found, expected), kFloatPanels);

  std::srand(5);
  Eigen::VectorXd forces = Eigen::VectorXd::Zero(stiffness.rows());
  const Eigen::VectorXd random = Eigen::VectorXd::Random(stiffness.rows());
  forces(outside) = random(outside);
  forces(boundary) = random(boundary);
  const Eigen::VectorXd on_boundary = forces(boundary) - K_OB.transpose() * inside(forces(outside));
  Eigen::VectorXd moves = Eigen::VectorXd::Random(static_cast<Eigen::Index>(boundary.size()));
  const Eigen::VectorXd extended = inside(-forces(outside) - K_OB * moves);
  forward_substitute(of, of.exterior, forces.data());
  EXPECT_LT(relative_error(forces(boundary), on_boundary), kFloatPanels);
  Eigen::VectorXd values = -forces;
  values(boundary) = moves;
  backward_substitute(of, of.exterior, values.data());
  EXPECT_LT(relative_error(values(outside), extended), kFloatPanels);
}

TEST(Condensation, IsTheDenseElimination) {
  expect_condensed(tissue_block(2));
  expect_condensed(tissue_block(1, true, Eigen::Vector3d(0, 0.1, -0.3), 2, 0.6));
}

TEST(Condensation, KeepsSharedVolumesTogether) {
  expect_condensed(tissue_block(1, false, Eigen::Vector3d::Zero(), 3, 0.4, true));
}

TEST(Condensation, OfTheWholeOrganSolvesForForces) {
  const ZoneBlock& organ = tissue_block(2);
  CondensedOrgan of = condensed(organ);
  ASSERT_TRUE(of.run());
  const Eigen::MatrixXd stiffness = of.stiffness(false);
  std::vector<Eigen::Index> free = of.dofs_of(NodeRole::eliminated);
  for (const NodeRole role : {NodeRole::kept, NodeRole::absent}) {
    const std::vector<Eigen::Index> more = of.dofs_of(role);
    free.insert(free.end(), more.begin(), more.end());
  }
  Eigen::VectorXd forces = Eigen::VectorXd::Zero(stiffness.rows());
  forces(free).setRandom();
  const Eigen::VectorXd expected = solve_definite(stiffness(free, free), forces(free));
  forward_substitute(of, of.whole, forces.data());
  backward_substitute(of, of.whole, forces.data());
  EXPECT_LT(relative_error(forces(free), expected), kFloatPanels);
}

TEST(Condensation, SharesTheFrontsThatHoldNothingOfTheZone) {
  CondensedOrgan of = condensed(tissue_block(2));
  ASSERT_TRUE(of.run());
  const auto own = std::count(of.exterior.is_own, of.exterior.is_own + of.pack.organ.num_fronts, 1);
  EXPECT_GT(own, 0);
  EXPECT_LT(own, of.pack.organ.num_fronts);
}

// A contact set that changes in mid-front leaves nothing behind.
TEST(Condensation, BeginsAnewInMidFront) {
  CondensedOrgan once = condensed(tissue_block(2));
  CondensedOrgan anew = condensed(tissue_block(2));
  ASSERT_TRUE(once.run());
  ASSERT_TRUE(anew.run());
  for (uint64_t operations = 1000; operations < 200000; operations *= 3) {
    uint64_t spent = 0;
    begin_condensation(anew.outside(), &anew.whole, anew.scratch, anew.exterior);
    advance_condensation(anew.outside(), operations, anew.scratch, anew.exterior, spent);
  }
  ASSERT_TRUE(anew.advance(&anew.whole, anew.zone_of_simd_lane.data(), anew.exterior));
  const size_t size = size_t{once.exterior.schur_stride} * once.exterior.schur_stride;
  for (size_t i = 0; i < size; ++i) ASSERT_EQ(once.exterior.schur[i], anew.exterior.schur[i]);
}

TEST(Condensation, FailsWhereTheExteriorIsNotPositiveDefinite) {
  CondensedOrgan of = condensed(tissue_block(2));
  // Crushed to a tenth of its height: the tangent of the tissue between is not positive definite.
  for (uint32_t node = 0; node < of.pack.organ.num_nodes; ++node) {
    const double height = of.pack.organ.nodes[node].position[2];
    of.rest[3 * node + 2] = height > 0.5 ? -0.45 : 0;
  }
  EXPECT_FALSE(of.run());
}

}  // namespace condensation_test
}  // namespace palpate
