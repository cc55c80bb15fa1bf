// The builder's compliance blocks compared with a dense inverse, and a site's linear response with the
// solver.
#include "offline/precompute/linear_dd.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "tests/support/touched_block.hpp"

namespace palpate {
namespace linear_dd_offline_test {

using test::touched_block;
using test::TouchedBlock;

// Rounding of a factor times the condition of a small block (about 1e3), with reserve.
constexpr double kCompliance = 1e-11;
// The tolerance of the solver's refinement.
constexpr double kResponse = 1e-10;

struct LinearDdOffline : ::testing::Test {
  TouchedBlock block = touched_block(4, 0.26);  // patches of five or more nodes
  Assembly assembly{block.model, block.model.fixed_dofs()};
  int calls = 0;
  int last = 0;
  LinearDd linear = compute_linear_dd(assembly, block.sites, [this](int done, int total) {
    ++calls;
    EXPECT_GT(done, last);
    EXPECT_LE(done, total);
    last = done;
  });
};

TEST_F(LinearDdOffline, BlocksAreThoseOfTheDenseInverse) {
  Assembly::SparseLower lower;
  assembly.tangent(Eigen::VectorXd::Zero(assembly.num_dofs()), false, lower);
  const Eigen::MatrixXd half(lower);
  const Eigen::MatrixXd stiffness = half.selfadjointView<Eigen::Lower>();
  const Eigen::MatrixXd inverse = stiffness.inverse();

  const ContactSites& sites = block.sites;
  ASSERT_GT(3 * sites.contact_nodes.size(), 48U) << "more than one block of right-hand sides";
  EXPECT_GT(calls, 1);
  EXPECT_EQ(last, static_cast<int>(3 * sites.contact_nodes.size()));
  ASSERT_EQ(linear.field_compliance.rows(), static_cast<Eigen::Index>(3 * sites.packed_nodes.size()));
  ASSERT_EQ(linear.field_compliance.cols(), static_cast<Eigen::Index>(3 * sites.contact_nodes.size()));
  double worst = 0;
  for (Eigen::Index row = 0; row < linear.field_compliance.rows(); ++row) {
    const int row_dof = 3 * sites.packed_nodes[static_cast<size_t>(row / 3)] + static_cast<int>(row % 3);
    const int row_equation = assembly.dof_equations()[static_cast<size_t>(row_dof)];
    for (Eigen::Index column = 0; column < linear.field_compliance.cols(); ++column) {
      const int column_dof =
          3 * sites.model_node(static_cast<int>(column / 3)) + static_cast<int>(column % 3);
      const int column_equation = assembly.dof_equations()[static_cast<size_t>(column_dof)];
      ASSERT_GE(column_equation, 0);
      const double expected =
          row_equation < 0 ? 0.0 : inverse(row_equation, column_equation);  // zero at fixed dofs
      worst = std::max(worst, std::abs(linear.field_compliance(row, column) - expected));
    }
  }
  EXPECT_LE(worst, kCompliance * inverse.cwiseAbs().maxCoeff());
  double worst_contact = 0;
  for (Eigen::Index row = 0; row < linear.contact_compliance.rows(); ++row) {
    const Eigen::Index packed_row = 3 * sites.contact_nodes[static_cast<size_t>(row / 3)] + row % 3;
    worst_contact = std::max(
        worst_contact,
        (linear.contact_compliance.row(row) - linear.field_compliance.row(packed_row)).cwiseAbs().maxCoeff());
  }
  EXPECT_LE(worst_contact, kCompliance * inverse.cwiseAbs().maxCoeff());
}

TEST_F(LinearDdOffline, IsReciprocal) {
  EXPECT_EQ(linear.contact_compliance, linear.contact_compliance.transpose());
  // The field rows are reciprocal, too, and the builder does not symmetrise them.
  const ContactSites& sites = block.sites;
  double worst = 0;
  for (size_t a = 0; a < sites.contact_nodes.size(); ++a) {
    for (size_t b = 0; b < a; ++b) {
      const auto there =
          linear.field_compliance.block<3, 3>(3 * sites.contact_nodes[a], static_cast<Eigen::Index>(3 * b));
      const auto back =
          linear.field_compliance.block<3, 3>(3 * sites.contact_nodes[b], static_cast<Eigen::Index>(3 * a));
      worst = std::max(worst, (there - back.transpose()).cwiseAbs().maxCoeff());
    }
  }
  EXPECT_LE(worst, kCompliance * linear.contact_compliance.cwiseAbs().maxCoeff());
}

TEST_F(LinearDdOffline, ResponseOfASiteIsTheConstrainedLinearSolve) {
  StaticSolver solver(assembly);
  const Eigen::VectorXd rest = Eigen::VectorXd::Zero(assembly.num_dofs());
  for (const ContactSite& site : block.sites.sites) {
    ASSERT_GE(site.patch.size(), 5U);
    LoadCase load = LoadCase::rest(block.model);
    Eigen::MatrixXd motion = Eigen::MatrixXd::Zero(assembly.num_dofs(), 3);
    for (const int node : site.patch_nodes) {
      motion.middleRows<3>(3 * node).setIdentity();
      for (int axis = 0; axis < 3; ++axis) load.held[static_cast<size_t>(3 * node + axis)] = 1;
    }
    Eigen::MatrixXd whole;
    ASSERT_TRUE(solver.tangent_response(load, rest, motion, whole));
    const SiteLinearResponse response = linear_response(linear, site);
    ASSERT_EQ(response.field.rows(), static_cast<Eigen::Index>(3 * block.sites.packed_nodes.size()));
    for (size_t i = 0; i < block.sites.packed_nodes.size(); ++i) {
      EXPECT_LE((response.field.middleRows<3>(static_cast<Eigen::Index>(3 * i)) -
                 whole.middleRows<3>(3 * block.sites.packed_nodes[i]))
                    .cwiseAbs()
                    .maxCoeff(),
                kResponse);
    }
    const Eigen::Matrix3d stiffness = motion.transpose() * assembly.tangent_times(rest, whole);
    EXPECT_LE((response.stiffness - stiffness).norm(), kResponse * stiffness.norm());
    EXPECT_EQ(response.stiffness, response.stiffness.transpose());
  }
}

TEST(LinearDdOfflineRefusal, ABodyThatFloatsIsRefused) {
  TouchedBlock block = touched_block(2, 0.0);
  block.model.fixed.clear();
  const Assembly assembly(block.model, block.model.fixed_dofs());
  EXPECT_EQ(assembly.num_equations(), block.model.num_dofs());
  EXPECT_THROW(compute_linear_dd(assembly, block.sites), std::runtime_error);
}

}  // namespace linear_dd_offline_test
}  // namespace palpate
