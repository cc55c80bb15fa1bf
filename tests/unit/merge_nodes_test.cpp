// Merging of nodes while a model is read, and the refusal of a loose part that was meant to be joined.
#include "offline/mesh/merge_nodes.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "offline/mesh/geometry_check.hpp"
#include "offline/mesh/rigid_motion.hpp"
#include "tests/support/inp_fixture.hpp"
#include "tests/support/stacked_blocks.hpp"

namespace palpate {
namespace merge_nodes_test {

using test::block_at;
using test::hollow_block;
using test::inp_of;
using test::nodes_on_plane;
using test::stacked_blocks;
using test::with_part;

class MergeNodes : public test::InpFile {
 protected:
  Model merged(const std::string& text, double length) const {
    return read_inp(dir_.write("organ.inp", text), {}, length);
  }
  std::string merge_refusal(const std::string& text, double length) const {
    try {
      merged(text, length);
    } catch (const InputError& error) {
      return without_folder(error.what());
    }
    return "accepted";
  }
};

// The nodes 33 to 48 and 1001 to 1016 lie at z = 2.
TEST_F(MergeNodes, JoinsParts) {
  const Model apart = stacked_blocks();
  const std::string text = inp_of(apart, nodes_on_plane(apart, 2, 0)) +
                           "*NSET, NSET=BOTH\n48, 1016\n*NSET, NSET=UPPER\n1016\n"
                           "*STEP, NLGEOM\n*STATIC\n*BOUNDARY\n1001, 1, 1, 0.5\n*CLOAD\n1016, 3, 2\n48, 3, "
                           "3\n*END STEP\n";
  const Model model = merged(text, 1e-6);
  EXPECT_EQ(model.num_nodes(), 80);
  EXPECT_EQ(model.elements.size(), apart.elements.size());
  EXPECT_TRUE(find_unjoined(model).empty());
  const std::vector<int> parts = connected_parts(model);
  EXPECT_EQ(*std::max_element(parts.begin(), parts.end()), 0);
  // Labels, sets, supports and loads name the node that stays.
  EXPECT_EQ(model.find_node(1001), model.find_node(33));
  EXPECT_EQ(model.labels[static_cast<std::size_t>(model.find_node(1016))], 48);
  EXPECT_EQ(model.node_sets.at("BOTH"), std::vector<int>{model.find_node(48)});
  EXPECT_EQ(model.node_sets.at("UPPER"), std::vector<int>{model.find_node(48)});
  const Step& step = model.steps.front();
  ASSERT_EQ(step.forces.size(), 1U);
  EXPECT_EQ(step.forces.front().node, model.find_node(48));
  EXPECT_EQ(step.forces.front().value, 5);
  EXPECT_TRUE(std::any_of(step.prescribed.begin(), step.prescribed.end(), [&](const auto& held) {
    return held.node == model.find_node(33) && held.axis == 0 && held.value == 0.5;
  }));
  ASSERT_FALSE(model.warnings.empty());
  EXPECT_EQ(without_folder(model.warnings.front()),
            "organ.inp: merged 16 nodes into others closer than 1e-06; *CLOAD on a set acts once at each "
            "merged node, which concerns BOTH, EVERY");
  // Every element lies where it was.
  for (std::size_t i = 0; i < apart.elements.size(); ++i) {
    for (std::size_t a = 0; a < 4; ++a) {
      EXPECT_EQ(model.positions[static_cast<std::size_t>(model.elements[i].node_array[a])],
                apart.positions[static_cast<std::size_t>(apart.elements[i].node_array[a])]);
    }
  }
}

TEST_F(MergeNodes, LeavesNodesThatAreFurtherApart) {
  Model apart = stacked_blocks();
  for (std::size_t node = 48; node < apart.positions.size(); ++node) apart.positions[node].z() += 0.01;
  const std::string text =
      inp_of(apart, nodes_on_plane(apart, 2, 0)) + "1001, 1, 3\n1002, 1, 3\n1005, 1, 3\n";
  EXPECT_EQ(merged(text, 0.009).num_nodes(), 96);
  EXPECT_EQ(merged(text, 0.011).num_nodes(), 80);
}

TEST_F(MergeNodes, RefusesAnElementThatWouldCollapse) {
  const Model block = block_at({0, 0, 0}, {1, 1, 1}, {1, 1, 1});
  EXPECT_EQ(
      merge_refusal(inp_of(block, {0, 1, 2, 3}), 1.1),
      "organ.inp:11: element 1 collapses where nodes closer than 1.1 are merged: its nodes 1 and 2 are 1 "
      "apart; merge with a shorter length");
  EXPECT_EQ(merge_refusal(inp_of(block, {0, 1, 2, 3}), 0.9), "accepted");
}

// Nodes without element stay apart: a tool's reference node may stand at a node of the organ.
TEST_F(MergeNodes, LeavesNodesWithoutElement) {
  const Model block = block_at({0, 0, 0}, {1, 1, 1}, {1, 1, 1});
  const std::string text = "*NODE\n99, 1, 1, 1\n" + inp_of(block, {0, 1, 2, 3});
  EXPECT_EQ(merged(text, 1e-3).num_nodes(), 9);
}

TEST_F(MergeNodes, ALoosePartIsToBeJoinedAndNotHeld) {
  const Model inner = with_part(hollow_block(), block_at({1, 1, 1}, {1, 1, 1}, {1, 1, 1}));
  const std::vector<int> base = nodes_on_plane(inner, 2, 0);
  EXPECT_EQ(
      refusal(inp_of(inner, base)),
      "organ.inp: the part with node 1001 can still move along x, and its nodes 1001, 1002, 1003, ... "
      "lie where nodes 22, 23, 26, ... are; the parts are probably meant to be joined: --merge 1e-6 (in "
      "a scene: merge = 1e-6)");
  EXPECT_EQ(merge_refusal(inp_of(inner, base), 1e-6), "accepted");
  const Model within =
      with_part(block_at({0, 0, 0}, {3, 3, 3}, {3, 3, 3}), block_at({1.2, 1.3, 1.4}, {1, 1, 1}, {1, 1, 1}));
  EXPECT_NE(
      refusal(inp_of(within, base)).find("of it and of another part share volume; the parts are probably"),
      std::string::npos);
  const Model on_top =
      with_part(block_at({0, 0, 0}, {3, 3, 2}, {3, 3, 2}), block_at({1.2, 1.3, 2}, {1, 1, 1}, {1, 1, 1}));
  EXPECT_NE(refusal(inp_of(on_top, base)).find("of another part; the parts are probably meant to be joined"),
            std::string::npos);
  // A part on its own is to be held.
  const Model apart =
      with_part(block_at({0, 0, 0}, {3, 3, 2}, {3, 3, 2}), block_at({0, 0, 3}, {1, 1, 1}, {1, 1, 1}));
  EXPECT_EQ(refusal(inp_of(apart, base)),
            "organ.inp: the part with node 1001 can still move along x; hold more of it with *BOUNDARY");
}

}  // namespace merge_nodes_test
}  // namespace palpate
