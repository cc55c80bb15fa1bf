// What `palpate check` says of a mesh: parts, free motions, shells, joints, locking, faults.
#include "offline/io/organ_check.hpp"

#include <gtest/gtest.h>

#include "offline/mesh/largest_part.hpp"
#include "offline/mesh/rigid_motion.hpp"
#include "tests/support/stacked_blocks.hpp"

namespace palpate {
namespace organ_check_test {

using test::block_at;
using test::hollow_block;
using test::nodes_on_plane;
using test::stacked_blocks;
using test::with_part;

std::vector<PrescribedDisplacement> held_at(const std::vector<int>& nodes, const std::vector<int>& axes) {
  std::vector<PrescribedDisplacement> held;
  for (const int node : nodes) {
    for (const int axis : axes) held.push_back({node, axis, 0});
  }
  return held;
}

// The block and a second one whose corner is the first one's last corner: one node in common.
Model blocks_at_a_corner() {
  Model model =
      with_part(block_at({0, 0, 0}, {1, 1, 1}, {1, 1, 1}), block_at({1, 1, 1}, {1, 1, 1}, {1, 1, 1}));
  for (Tetrahedron& element : model.elements) {
    for (int& node : element.nodes()) node = node == 8 ? 7 : node;
  }
  return model;
}

TEST(OrganCheck, CountsPartsAndSaysHowEachCanMove) {
  const Model model =
      with_part(block_at({0, 0, 0}, {2, 2, 2}, {2, 2, 2}), block_at({9, 0, 0}, {1, 1, 1}, {1, 1, 1}));
  std::vector<PrescribedDisplacement> held = held_at(nodes_on_plane(model, 0, 2), {0});  // the plane x = 2
  const OrganCheck check = check_organ(model, held);
  ASSERT_EQ(check.parts.size(), 2U);
  EXPECT_EQ(check.parts[0].num_nodes, 27);
  EXPECT_EQ(check.parts[0].num_elements, 48);
  EXPECT_EQ(check.parts[1].num_nodes, 8);
  EXPECT_EQ(check.parts[1].first_node, 1001);
  EXPECT_EQ(check.parts[1].box.min().x(), 9);
  // Nodes of a plane that stay in it: along y and z, and about x.
  EXPECT_EQ(check.parts[0].free_motions,
            (std::vector<std::string>{"move along y", "move along z", "turn about an axis along x"}));
  EXPECT_EQ(check.parts[1].free_motions.size(), 6U);
  EXPECT_EQ(check.num_held_nodes, 9);
  EXPECT_TRUE(check.faults.empty());
}

// Two nodes on a slanted line leave the turn about the line, which has no axis of its own name.
TEST(OrganCheck, CountsAMotionWithoutAName) {
  const Model model = block_at({0, 0, 0}, {1, 1, 1}, {1, 1, 1});
  EXPECT_EQ(check_organ(model, held_at({0, 7}, {0, 1, 2})).parts.front().free_motions,
            std::vector<std::string>{"move as a whole"});
  EXPECT_EQ(check_organ(model, held_at({0, 1, 2, 7}, {0, 1, 2})).parts.front().free_motions,
            std::vector<std::string>{});
}

TEST(OrganCheck, CountsShellsAndCavities) {
  const OrganCheck hollow = check_organ(hollow_block(), {});
  EXPECT_EQ(hollow.num_shells, 2);
  EXPECT_EQ(hollow.num_cavities, 1);
  EXPECT_NEAR(hollow.volume, 26, 1e-12);
  const OrganCheck two = check_organ(
      with_part(block_at({0, 0, 0}, {1, 1, 1}, {1, 1, 1}), block_at({9, 0, 0}, {1, 1, 1}, {1, 1, 1})), {});
  EXPECT_EQ(two.num_shells, 2);
  EXPECT_EQ(two.num_cavities, 0);
}

TEST(OrganCheck, FindsPartsThatTouchAtANode) {
  const Model model = blocks_at_a_corner();
  const OrganCheck check = check_organ(model, held_at({0, 1, 2, 3}, {0, 1, 2}));
  EXPECT_EQ(check.parts.size(), 1U);  // the node connects them
  EXPECT_EQ(check.num_shared_nodes, 1);
  EXPECT_EQ(check.num_open_edges, 0);
  ASSERT_EQ(check.faults.size(), 1U);
  EXPECT_NE(check.faults[0].find("hang on the rest by a corner"), std::string::npos) << check.faults[0];
  EXPECT_EQ(check_organ(block_at({0, 0, 0}, {2, 2, 2}, {2, 2, 2}), {}).num_shared_nodes, 0);
}

TEST(OrganCheck, ListsWhatABuildRefuses) {
  const OrganCheck check = check_organ(stacked_blocks(), {});
  ASSERT_EQ(check.faults.size(), 2U);  // nodes at nodes, faces on faces
  EXPECT_NE(check.faults[0].find("--merge"), std::string::npos) << check.faults[0];
  Model flat = block_at({0, 0, 0}, {1, 1, 1}, {1, 1, 1});
  flat.positions[7] = flat.positions[6];
  EXPECT_NE(check_organ(flat, {}).faults.front().find("is flat"), std::string::npos);
}

TEST(OrganCheck, WarnsOfLocking) {
  Model model = block_at({0, 0, 0}, {2, 2, 2}, {2, 2, 2});
  model.materials = {{"SOFT", CompressibleNeoHookean{1, 4}}};  // nu = 0.4
  EXPECT_TRUE(check_organ(model, {}).warnings.empty());
  model.materials[0].law = CompressibleNeoHookean{1, 49};  // nu = 0.49
  ASSERT_EQ(check_organ(model, {}).warnings.size(), 1U);
  EXPECT_NE(check_organ(model, {}).warnings[0].find("MEAN DILATATION"), std::string::npos);
  for (Tetrahedron& element : model.elements) element.material = -1;
  EXPECT_TRUE(check_organ(model, {}).warnings.empty());
}

// Elements that have a volume patch for themselves lock as elements without one do.
TEST(OrganCheck, WarnsOfSmallSharedVolumes) {
  Model model = block_at({0, 0, 0}, {2, 2, 2}, {2, 2, 2});
  model.materials = {{"SOFT", CompressibleNeoHookean{1, 49}}};
  for (size_t i = 0; i < model.elements.size(); ++i) model.elements[i].volume_patch = static_cast<int>(i) / 6;
  EXPECT_TRUE(check_organ(model, {}).warnings.empty());
  for (size_t i = 0; i < model.elements.size(); ++i) model.elements[i].volume_patch = static_cast<int>(i) / 2;
  ASSERT_EQ(check_organ(model, {}).warnings.size(), 1U);
  EXPECT_NE(check_organ(model, {}).warnings[0].find("48 of 48"), std::string::npos)
      << check_organ(model, {}).warnings[0];
}

TEST(LargestPart, KeepsOnePartWithItsSetsAndSupports) {
  Model model =
      with_part(block_at({9, 0, 0}, {1, 1, 1}, {1, 1, 1}), block_at({0, 0, 0}, {2, 2, 2}, {2, 2, 2}));
  model.node_sets["BOTH"] = {0, 8, 34};
  model.element_sets["BOTH"] = {5, 6};
  model.fixed = {{0, 0, 0}, {8, 1, 0}};
  keep_largest_part(model);
  const Model alone = block_at({0, 0, 0}, {2, 2, 2}, {2, 2, 2});
  ASSERT_EQ(model.num_nodes(), 27);
  EXPECT_EQ(model.positions, alone.positions);
  ASSERT_EQ(model.elements.size(), 48U);
  for (size_t i = 0; i < 48; ++i) EXPECT_EQ(model.elements[i].node_array, alone.elements[i].node_array);
  EXPECT_EQ(model.node_sets["BOTH"], (std::vector<int>{0, 26}));
  EXPECT_EQ(model.element_sets["BOTH"], std::vector<int>{0});
  ASSERT_EQ(model.fixed.size(), 1U);
  EXPECT_EQ(model.fixed[0].axis, 1);
  EXPECT_EQ(model.find_node(1001), 0);
  EXPECT_EQ(model.find_node(1), -1);
  ASSERT_EQ(model.warnings.size(), 1U);
  EXPECT_EQ(model.warnings[0],
            "block: kept the largest of 2 parts, and dropped 8 nodes and 6 elements of the others");
}

}  // namespace organ_check_test
}  // namespace palpate
