// The builder's compressed compliance, compared with exact columns.
#include "offline/precompute/compressed_compliance.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <set>

#include "offline/numerics/decompositions.hpp"
#include "offline/precompute/linear_contacts.hpp"
#include "offline/precompute/site_survey.hpp"
#include "tests/support/compressed_pack.hpp"

namespace palpate::test {
namespace compressed_compliance_test {

// Displacements of the packed nodes for a unit force along an axis at a contact node.
Eigen::VectorXd column_of(const CompressedCompliance& compressed, size_t contact, Eigen::Index axis) {
  Eigen::VectorXd column =
      Eigen::VectorXd::Constant(static_cast<Eigen::Index>(3 * compressed.node_places.size()), std::nan(""));
  for (size_t p = 0; p < compressed.panels.size(); ++p) {
    const pack::CompressedPanel& panel = compressed.panels[p];
    const pack::CompressedBlock& block = compressed.blocks[contact * compressed.panels.size() + p];
    const float* weights = &compressed.coefficients[size_t{block.start} * pack::kBlockUnit] +
                           static_cast<size_t>(axis) * block.rank;
    for (size_t row = 0; row < pack::kPanelRows; ++row) {
      if (panel.nodes[row / 3] == pack::kNoNode) continue;
      double sum = 0;
      if (block.rank == pack::kPanelRows) {
        sum = static_cast<double>(weights[row]);
      } else {
        for (size_t k = 0; k < block.rank; ++k) {
          sum += static_cast<double>(compressed.basis[(panel.first_column + k) * pack::kPanelRows + row]) *
                 static_cast<double>(weights[k]);
        }
      }
      column[static_cast<Eigen::Index>(3 * panel.nodes[row / 3] + row % 3)] = sum;
    }
  }
  return column;
}

// Largest error of any entry, in units of s_b min(s_a, s_b), with s_a = sqrt of the dof's own compliance.
double worst_entry(const CompressedCompliance& compressed, const LinearDd& exact, const ContactSites& sites) {
  Eigen::VectorXd roots = Eigen::VectorXd::Zero(exact.field_compliance.rows());
  for (size_t c = 0; c < sites.contact_nodes.size(); ++c) {
    for (int axis = 0; axis < 3; ++axis) {
      const int row = 3 * sites.contact_nodes[c] + axis;
      roots[row] = std::sqrt(exact.field_compliance(row, static_cast<Eigen::Index>(3 * c) + axis));
    }
  }
  double worst = 0;
  for (size_t c = 0; c < sites.contact_nodes.size(); ++c) {
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      const Eigen::VectorXd error = column_of(compressed, c, axis) -
                                    exact.field_compliance.col(static_cast<Eigen::Index>(3 * c) + axis);
      const double own = roots[3 * sites.contact_nodes[c] + axis];
      for (Eigen::Index row = 0; row < error.size(); ++row) {
        if (roots[row] > 0) {
          worst = std::max(worst, std::abs(error[row]) / (own * std::min(own, roots[row])));
        } else {
          EXPECT_EQ(error[row], 0) << "a node that is held";
        }
      }
    }
  }
  return worst;
}

TEST(CompressedCompliance, EveryEntryIsWithinTheTolerance) {
  const ContactSites& sites = touched_surface().block.sites;
  size_t bytes = 0;
  for (const double tolerance : {1e-4, 1e-3, 1e-2}) {
    const CompressedCompliance compressed = compress_linear_dd(touched_surface().assembly, sites, tolerance);
    const double worst = worst_entry(compressed, dense_compliance(), sites);
    EXPECT_LE(worst, tolerance * (1 + 1e-3));  // rounding to float
    EXPECT_GE(worst, 0.3 * tolerance) << "more than was asked for";
    if (bytes > 0) {
      EXPECT_LT(compressed.num_bytes(), bytes);
    }
    bytes = compressed.num_bytes();
  }
}

TEST(CompressedCompliance, FarBlocksAreSmallAndNearOnesWhole) {
  const CompressedCompliance& compressed = compressed_compliance();
  const ContactSites& sites = touched_surface().block.sites;
  size_t exact = 0;
  size_t far = 0;
  size_t columns = 0;
  for (size_t c = 0; c < sites.contact_nodes.size(); ++c) {
    const size_t own =
        compressed.node_places[static_cast<size_t>(sites.contact_nodes[c])] / pack::kPanelNodes;
    for (size_t p = 0; p < compressed.panels.size(); ++p) {
      const std::uint32_t rank = compressed.blocks[c * compressed.panels.size() + p].rank;
      if (p == own) {
        EXPECT_EQ(rank, pack::kPanelRows);
      }
      (rank == pack::kPanelRows ? exact : far) += 1;
      columns += rank == pack::kPanelRows ? 0 : rank;
    }
  }
  EXPECT_GT(far, exact);
  EXPECT_LT(columns, far * pack::kPanelRows / 3);
  EXPECT_LT(static_cast<double>(compressed.num_bytes()),
            0.4 * dense_compliance_bytes(sites.packed_nodes.size(), sites.contact_nodes.size()));
}

TEST(CompressedCompliance, PanelsHoldEveryNodeOnce) {
  const CompressedCompliance& compressed = compressed_compliance();
  std::set<std::uint32_t> seen;
  for (size_t p = 0; p < compressed.panels.size(); ++p) {
    for (size_t i = 0; i < pack::kPanelNodes; ++i) {
      const std::uint32_t node = compressed.panels[p].nodes[i];
      if (node == pack::kNoNode) continue;
      EXPECT_TRUE(seen.insert(node).second);
      EXPECT_EQ(compressed.node_places[node], p * pack::kPanelNodes + i);
    }
  }
  EXPECT_EQ(seen.size(), touched_surface().block.sites.packed_nodes.size());
}

template <typename T>
bool same_bytes(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0;
}

TEST(CompressedCompliance, DoesNotDependOnTheThreads) {
  const TouchedSurface& surface = touched_surface();
  const Assembly threaded(surface.block.model, surface.block.model.fixed_dofs(), 3);
  const CompressedCompliance other = compress_linear_dd(threaded, surface.block.sites, kComplianceTolerance);
  const CompressedCompliance& one = compressed_compliance();
  EXPECT_TRUE(same_bytes(one.panels, other.panels));
  EXPECT_TRUE(same_bytes(one.node_places, other.node_places));
  EXPECT_TRUE(same_bytes(one.basis, other.basis));
  EXPECT_TRUE(same_bytes(one.blocks, other.blocks));
  EXPECT_TRUE(same_bytes(one.coefficients, other.coefficients));
}

TEST(CompressedCompliance, ABodyThatFloatsIsRefused) {
  TouchedBlock block = touched_block(2, 0.0);
  block.model.fixed.clear();
  const Assembly assembly(block.model, block.model.fixed_dofs());
  EXPECT_THROW(compress_linear_dd(assembly, block.sites, 1e-4), std::runtime_error);
}

// More packed nodes that no tool can touch than nodes that a tool can touch.
TEST(CompressedCompliance, ShownNodesNeedNotBeTouchable) {
  TouchedBlock block = touched_block(6, 0.2);
  show_every_node(block);
  const Assembly assembly(block.model, block.model.fixed_dofs());
  const LinearDd exact = compute_linear_dd(assembly, block.sites);
  const CompressedCompliance compressed = compress_linear_dd(assembly, block.sites, 1e-4);
  for (size_t c = 0; c < block.sites.contact_nodes.size(); ++c) {
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      const Eigen::Index column = static_cast<Eigen::Index>(3 * c) + axis;
      const double own = exact.field_compliance(3 * block.sites.contact_nodes[c] + axis, column);
      EXPECT_LE(
          (column_of(compressed, c, axis) - exact.field_compliance.col(column)).lpNorm<Eigen::Infinity>(),
          1.001e-4 * own);
    }
  }
}

TEST(ExactContacts, AreThoseOfTheDenseBlocks) {
  const ContactSites& sites = touched_surface().block.sites;
  StaticSolver solver(touched_surface().assembly);
  factor_at_rest(solver);
  TestRandom random(5);
  for (const size_t other : {size_t{1}, sites.sites.size() / 2}) {  // overlapping, and apart
    const std::vector<LinearContact> contacts = {{0, random.vector()}, {other, random.vector()}};
    const LinearContactAnswer answer = solve_contacts(solver, sites, contacts);
    // The same held nodes in the dense blocks.
    std::set<int> held;
    for (const LinearContact& contact : contacts)
      held.insert(sites.sites[contact.site].patch.begin(), sites.sites[contact.site].patch.end());
    std::vector<int> dofs;
    Eigen::VectorXd motion(static_cast<Eigen::Index>(3 * held.size()));
    for (const int node : held) {
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      int count = 0;
      for (const LinearContact& contact : contacts) {
        const std::vector<int>& patch = sites.sites[contact.site].patch;
        if (std::find(patch.begin(), patch.end(), node) == patch.end()) continue;
        sum += contact.displacement;
        ++count;
      }
      motion.segment<3>(static_cast<Eigen::Index>(dofs.size())) = sum / count;
      for (int axis = 0; axis < 3; ++axis) dofs.push_back(3 * node + axis);
    }
    const Eigen::VectorXd forces = solve_definite(dense_compliance().contact_compliance(dofs, dofs), motion);
    const Eigen::VectorXd field = dense_compliance().field_compliance(Eigen::all, dofs) * forces;
    EXPECT_LE((answer.field - field).norm(), 1e-9 * field.norm());
    EXPECT_NEAR(
        answer.forces[0].dot(contacts[0].displacement) + answer.forces[1].dot(contacts[1].displacement),
        forces.dot(motion), 1e-9 * forces.dot(motion));
  }
}

TEST(LinearResponseBySolve, IsThatOfTheBlocks) {
  const ContactSites& sites = touched_surface().block.sites;
  StaticSolver solver(touched_surface().assembly);
  for (const size_t site : {size_t{0}, sites.sites.size() / 3}) {
    const SiteLinearResponse blocks = linear_response(dense_compliance(), sites.sites[site]);
    const SiteLinearResponse solved = linear_response(solver, sites, sites.sites[site]);
    EXPECT_LE((solved.field - blocks.field).cwiseAbs().maxCoeff(), 1e-9);
    EXPECT_LE((solved.stiffness - blocks.stiffness).norm(), 1e-9 * blocks.stiffness.norm());
    EXPECT_EQ(solved.stiffness, solved.stiffness.transpose());
  }
}

TEST(SpreadSites, AreFarApartAndTheSameEachTime) {
  const TouchedSurface& surface = touched_surface();
  const auto position = [&](size_t site) {
    return surface.block.model.positions[static_cast<size_t>(surface.block.sites.sites[site].node)];
  };
  const std::vector<size_t> chosen = spread_sites(surface.block.model, surface.block.sites, 12);
  ASSERT_EQ(chosen.size(), 12U);
  EXPECT_EQ(chosen, spread_sites(surface.block.model, surface.block.sites, 12));
  for (size_t i = 1; i < chosen.size(); ++i) {
    EXPECT_GT(chosen[i], chosen[i - 1]);
    for (size_t j = 0; j < i; ++j) EXPECT_GT((position(chosen[i]) - position(chosen[j])).norm(), 0.4);
  }
  EXPECT_EQ(spread_sites(surface.block.model, surface.block.sites, 100000).size(),
            surface.block.sites.sites.size());
}

}  // namespace compressed_compliance_test
}  // namespace palpate::test
