// Scenes of models with parts that meet without common nodes.
#include <gtest/gtest.h>

#include "offline/mesh/input_error.hpp"
#include "offline/precompute/scene.hpp"
#include "tests/support/stacked_blocks.hpp"
#include "tests/support/temp_dir.hpp"

namespace palpate {
namespace scene_parts_test {

// Two blocks, one on the other, with their own nodes at z = 2.
TEST(SceneOfSeveralParts, IsRefusedUnlessTheyAreJoinedOrMeant) {
  const test::TempDir dir;
  const auto read = [&](const std::string& scene, const std::string& model) {
    dir.write("organ.inp", model);
    return read_scene(dir.write("scene.toml", scene));
  };
  const auto refusal = [&](const std::string& scene, const std::string& model) -> std::string {
    try {
      read(scene, model);
    } catch (const InputError& error) {
      return dir.without_folder(error.what());
    }
    return "accepted";
  };
  const Model apart = test::stacked_blocks();
  std::vector<int> held = test::nodes_on_plane(apart, 2, 0);
  const std::vector<int> top = test::nodes_on_plane(apart, 2, 4);
  held.insert(held.end(), top.begin(), top.end());
  const std::string model = test::inp_of(apart, held);
  const std::string contact = "[contact]\nsites = \"surface\"\nmax_displacement = 0.5\n";
  const std::string scene = "# stacked\nmodel = \"organ.inp\"\n";
  const std::string list = refusal(scene + contact, model);
  EXPECT_EQ(list.substr(0, list.find(':', 14)),
            "scene.toml:2: the model has elements that meet without common "
            "nodes, so that nothing passes from one to the other; join "
            "them, or write separate_bodies = true if they are bodies of "
            "their own");
  EXPECT_NE(list.find("\n  organ.inp: 16 nodes lie at the place of another"), std::string::npos) << list;
  EXPECT_NE(list.find("\n  organ.inp: 36 outer faces lie on outer faces"), std::string::npos) << list;

  const LoadedScene meant = read(scene + "separate_bodies = true\n" + contact, model);
  EXPECT_EQ(meant.scene.kept_apart, "16 nodes at the place of others, 36 faces on faces");
  EXPECT_EQ(meant.model.num_nodes(), 96);
  EXPECT_NE(refusal(scene + "separate_bodies = false\n" + contact, model), "accepted");

  const LoadedScene merged = read(scene + "merge = 1e-6\n" + contact, model);
  EXPECT_EQ(merged.scene.kept_apart, "");
  EXPECT_EQ(merged.model.num_nodes(), 80);
  const Model whole = test::block_at({0, 0, 0}, {3, 3, 4}, {3, 3, 4});
  const std::string one_body = test::inp_of(whole, test::nodes_on_plane(whole, 2, 0));
  EXPECT_EQ(read(scene + "separate_bodies = true\n" + contact, one_body).scene.kept_apart, "");
}

}  // namespace scene_parts_test
}  // namespace palpate
