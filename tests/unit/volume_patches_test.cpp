// Volume patches partition the elements that share volumes into connected groups of about the requested size.
#include "offline/mesh/volume_patches.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <vector>

#include "offline/mesh/element_faces.hpp"
#include "offline/mesh/inp_reader.hpp"
#include "tests/support/inp_fixture.hpp"
#include "tests/support/tetrahedral_block.hpp"

namespace palpate {
namespace volume_patches_test {

using test::BlockShape;
using test::tetrahedral_block;

Model block_of(int cells) {
  BlockShape shape;
  shape.cells = {cells, cells, cells};
  return tetrahedral_block(shape);
}

std::map<int, std::vector<int>> patches_of(const Model& model) {
  std::map<int, std::vector<int>> patches;
  for (size_t e = 0; e < model.elements.size(); ++e)
    patches[model.elements[e].volume_patch].push_back(static_cast<int>(e));
  return patches;
}

// Whether faces within the patch connect all its elements.
bool is_connected(const Model& model, const std::vector<int>& patch) {
  std::set<int> reached = {patch.front()};
  for (size_t round = 0; round < patch.size(); ++round) {
    for (const int e : patch) {
      const auto shares_face = [&](int other) {
        const auto a = model.elements[static_cast<size_t>(e)].corners();
        const auto b = model.elements[static_cast<size_t>(other)].corners();
        return std::ranges::count_if(a, [&](int n) { return std::ranges::find(b, n) != b.end(); }) == 3;
      };
      if (std::ranges::any_of(reached, shares_face)) reached.insert(e);
    }
  }
  return reached.size() == patch.size();
}

TEST(VolumePatches, AreConnectedAndOfTheirSize) {
  const Model brain = read_inp(PALPATE_SOURCE_DIR "/models/brain/brain.inp");
  for (Model model : {block_of(5), brain}) {
    form_volume_patches(model, std::vector<int>(model.elements.size(), 0));
    const auto patches = patches_of(model);
    EXPECT_EQ(patches.count(-1), 0U);
    size_t usual = 0;
    for (const auto& [number, patch] : patches) {
      EXPECT_GT(patch.size(), kElementsPerVolumePatch / 2U);
      EXPECT_LT(patch.size(), 2U * kElementsPerVolumePatch);
      EXPECT_TRUE(is_connected(model, patch)) << "patch " << number;
      usual += patch.size() == kElementsPerVolumePatch;
    }
    EXPECT_GT(2 * usual, patches.size());
    const VolumePatchCount count = count_volume_patches(model);
    EXPECT_EQ(count.patches, static_cast<int>(patches.size()));
  }
}

TEST(VolumePatches, StayWithinTheirSection) {
  Model model = block_of(4);
  std::vector<int> groups;
  for (size_t e = 0; e < model.elements.size(); ++e) groups.push_back(static_cast<int>(e / 96) % 3 - 1);
  form_volume_patches(model, groups);
  std::map<int, std::set<int>> groups_of_patch;
  for (size_t e = 0; e < model.elements.size(); ++e) {
    EXPECT_EQ(model.elements[e].volume_patch < 0, groups[e] < 0);
    groups_of_patch[model.elements[e].volume_patch].insert(groups[e]);
  }
  for (const auto& [number, of_patch] : groups_of_patch) EXPECT_EQ(of_patch.size(), 1U);
}

TEST(VolumePatches, FewElementsMakeOnePatch) {
  for (const size_t kept : {1U, 2U, 3U, 6U}) {
    Model model = block_of(1);
    model.elements.resize(kept);
    form_volume_patches(model, std::vector<int>(kept, 0));
    EXPECT_EQ(patches_of(model).size(), 1U) << kept << " elements";
  }
}

TEST(VolumePatches, TenNodeElementsAreTheirOwnPatches) {
  Model model = test::with_middle_nodes(block_of(2));
  form_volume_patches(model, std::vector<int>(model.elements.size(), 0));
  for (const auto& [number, patch] : patches_of(model)) EXPECT_EQ(patch.size(), 1U);
}

TEST(VolumePatches, AreTheSameEachTime) {
  const std::vector<int> groups(6 * 5 * 5 * 5, 0);
  Model once = block_of(5);
  Model again = block_of(5);
  form_volume_patches(once, groups);
  form_volume_patches(again, groups);
  EXPECT_EQ(patches_of(once), patches_of(again));
}

}  // namespace volume_patches_test
}  // namespace palpate
