// How far a patch can move, and the sites that are left out because theirs cannot.
#include "offline/precompute/patch_reach.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "offline/fem/assembly.hpp"
#include "offline/pipeline/opened_pack.hpp"
#include "offline/pipeline/pack_build.hpp"
#include "offline/precompute/sample_points.hpp"
#include "offline/precompute/sampling.hpp"
#include "tests/support/touched_block.hpp"

namespace palpate {
namespace patch_reach_test {

// Fixes every node that shares an element with the first site, but no node of its patch.
void fix_around_first_site(test::TouchedBlock& block) {
  const std::vector<int>& patch = block.sites.sites.front().patch_nodes;
  const auto is_in_patch = [&](int node) { return std::ranges::count(patch, node) > 0; };
  std::vector<char> fixed = block.model.fixed_nodes();
  for (const Tetrahedron& element : block.model.elements) {
    if (std::ranges::none_of(element.nodes(), is_in_patch)) continue;
    for (const int node : element.nodes()) {
      if (!is_in_patch(node)) fixed[static_cast<size_t>(node)] = 1;
    }
  }
  block.model.fixed.clear();
  for (int node = 0; node < block.model.num_nodes(); ++node) {
    for (int axis = 0; axis < 3 && fixed[static_cast<size_t>(node)] != 0; ++axis)
      block.model.fixed.push_back({node, axis, 0.0});
  }
}

// det F of a held element is linear in the displacement. The assembly knows no limit and gives the slopes.
double reach_by_assembly(const test::TouchedBlock& block, bool inward_only) {
  constexpr double kSmall = 1e-3;
  constexpr int kDirections = 4000;
  const Assembly assembly(block.model, block.model.fixed_dofs());
  const ContactSite& site = block.sites.sites.front();
  double reach = std::numeric_limits<double>::infinity();
  for (const Eigen::Vector3d& direction : sphere_points(kDirections)) {
    if (inward_only && direction.dot(site.inward) < 0) continue;
    Eigen::VectorXd u = Eigen::VectorXd::Zero(block.model.num_dofs());
    for (const int node : site.patch_nodes) u.segment<3>(3 * node) = kSmall * direction;
    Eigen::VectorXd force;
    const double fall = 1 - assembly.internal_force(u, force).min_jacobian;
    if (fall > 0) reach = std::min(reach, (1 - kLeastSampledJacobian) * kSmall / fall);
  }
  return reach;
}

TEST(PatchReach, IsWhereTheAssemblySeesAnElementInvert) {
  constexpr double kBetweenDirections = 5e-3;  // 4000 directions are 2 degrees apart
  for (const bool ten_nodes : {false, true}) {
    for (const double tip_radius : {0.0, 0.4}) {
      test::TouchedBlock block = test::touched_block(3, tip_radius, ten_nodes);
      fix_around_first_site(block);
      for (const Directions directions : {Directions::all, Directions::inward}) {
        block.scene.directions = directions;
        const double reach = patch_reaches(block.scene, block.model, block.sites).front();
        const double expected = reach_by_assembly(block, directions == Directions::inward);
        EXPECT_NEAR(reach, expected, kBetweenDirections * expected)
            << ten_nodes << ' ' << tip_radius << ' ' << static_cast<int>(directions);
        EXPECT_LE(reach, expected * (1 + 1e-9));
      }
    }
  }
}

TEST(PatchReach, AFreeNodeSetsNoLimit) {
  const test::TouchedBlock block = test::touched_block(3, 0.0);
  for (const double reach : patch_reaches(block.scene, block.model, block.sites))
    EXPECT_TRUE(std::isinf(reach));
}

// A node that is fixed along an axis may slide along the others.
TEST(PatchReach, ARollerSetsNoLimit) {
  test::TouchedBlock block = test::touched_block(3, 0.0);
  fix_around_first_site(block);
  std::erase_if(block.model.fixed, [](const PrescribedDisplacement& one) { return one.axis == 0; });
  EXPECT_TRUE(std::isinf(patch_reaches(block.scene, block.model, block.sites).front()));
}

TEST(PatchReach, SitesBelowAQuarterAreLeftOutByName) {
  test::TouchedBlock block = test::touched_block(3, 0.0);
  fix_around_first_site(block);
  const int node = block.sites.sites.front().node;
  const double reach = patch_reaches(block.scene, block.model, block.sites).front();
  block.scene.max_displacement = 3 * reach;
  EXPECT_TRUE(find_contact_sites(block.scene, block.model).left_out.empty());
  block.scene.max_displacement = 4.1 * reach;
  const ContactSites sites = find_contact_sites(block.scene, block.model);
  ASSERT_EQ(sites.left_out.size(), 1U);
  EXPECT_EQ(sites.left_out.front().node, node);
  EXPECT_EQ(sites.left_out.front().out_of_reach, reach);
  EXPECT_EQ(sites.sites.size(), block.sites.sites.size() - 1);
  block.scene.sites = {node};
  try {
    find_contact_sites(block.scene, block.model);
    FAIL() << "a scene without a site was accepted";
  } catch (const std::runtime_error& error) {
    const std::string label = std::to_string(block.model.labels[static_cast<size_t>(node)]);
    EXPECT_NE(std::string(error.what()).find("reach: " + label + " ("), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("no site is left"), std::string::npos) << error.what();
  }
}

// A thin sheet leaves out nearly all sites.
TEST(PatchReach, FiveSitesThatAreLeftOutHaveNames) {
  const test::TouchedBlock block = test::touched_block(3, 0.0);
  std::vector<LeftOutSite> left_out;
  for (int node = 0; node < 8; ++node) left_out.push_back({node, 0.5});
  const std::string text = left_out_text(block.scene, block.model, left_out, 2);
  EXPECT_NE(text.find("8 of 10 sites are left out"), std::string::npos) << text;
  EXPECT_EQ(std::ranges::count(text, '('), 5 + 1) << text;
  EXPECT_NE(text.find(" and 3 more (build --json names all); 2 sites are left"), std::string::npos) << text;
}

// The node 0.3 under a site is fixed, but each element between them has a free node too: only the solver
// finds the limit. The other sites keep their errors and contact sets.
TEST(LeftOut, AnUnsampledSiteEndsNoBuild) {
  constexpr int kImmobile = 110;  // node of the site, at (2, 2, 2)
  constexpr int kUnder = 65;      // node under it
  test::BlockShape shape;
  shape.cells = {8, 4, 2};
  shape.size = {8, 4, 2};
  shape.jitter = 0;
  test::TouchedBlock block;
  block.model = test::with_fixed_base(test::tetrahedral_block(shape));
  block.model.positions[kUnder].z() = 1.7;
  for (int axis = 0; axis < 3; ++axis) block.model.fixed.push_back({kUnder, axis, 0.0});
  block.scene.sites = {103, kImmobile, 114};
  block.scene.max_displacement = 1;
  block.scene.tip_radius = 1.1;
  block.scene.max_contacts = 2;
  block.scene.output_nodes = extract_surface(block.model).nodes;
  block.sites = find_contact_sites(block.scene, block.model);
  const std::vector<ContactSite> before = block.sites.sites;
  ASSERT_EQ(before.size(), 3U);
  const Assembly assembly(block.model, block.model.fixed_dofs());
  const RestState rest;
  const SamplingPlan plan = plan_sampling(block.scene, block.sites, 2);
  const auto build = build_pack({assembly, block.scene, block.sites, rest, plan}, {});
  ASSERT_EQ(build->left_out.size(), 1U);
  EXPECT_EQ(build->left_out.front().node, kImmobile);
  EXPECT_GE(build->left_out.front().out_of_reach, 0.25);
  ASSERT_EQ(build->sites.sites.size(), before.size() - build->left_out.size());
  ASSERT_EQ(build->results.size(), build->sites.sites.size());
  const OpenedPack opened(*build->bytes);
  ASSERT_EQ(opened.info().num_sites, build->sites.sites.size());
  for (size_t i = 0; i < build->results.size(); ++i) {
    EXPECT_EQ(opened.label_of_site(i), block.model.labels[static_cast<size_t>(build->sites.sites[i].node)]);
    for (const SurveySample& sample : build->results[i].survey) EXPECT_EQ(sample.site, i);
  }
  ASSERT_FALSE(build->sets.sets.empty());
  EXPECT_LT(build->sets.sets.size(), 60U) << "those of the site are dropped";
  for (size_t i = 0; i < build->sets.sets.size(); ++i) {
    const ContactTruth& truth = build->sets.truths[i];
    for (size_t c = 0; c < truth.contacts.size(); ++c) {
      const size_t site = truth.contacts[c].site;
      EXPECT_EQ(site, build->sets.sets[i].contacts[c].site);
      ASSERT_LT(site, build->sites.sites.size());
      if (!truth.solved) continue;
      // The solved field has the contact's displacement at the node of the renumbered site.
      const Eigen::Vector3d moved = truth.field.segment<3>(3 * build->sites.sites[site].packed_node);
      EXPECT_LE((moved - truth.contacts[c].displacement).norm(), 1e-5 * moved.norm());
    }
  }
}

}  // namespace patch_reach_test
}  // namespace palpate
