// Organs that are no compact ball: `palpate new` and `build` take them with nothing edited.
#include <gtest/gtest.h>

#include "offline/io/mesh_formats.hpp"
#include "offline/io/model_from_mesh.hpp"
#include "offline/precompute/scene.hpp"
#include "tests/support/run_program.hpp"
#include "tests/support/stacked_blocks.hpp"

namespace palpate::test {
namespace cli_odd_organs_test {

class OddOrgan : public ::testing::Test {
 protected:
  // Writes the mesh, and runs `new` and `build` as a stranger does. Returns what `info` says of the pack.
  nlohmann::json packed(const Model& model, const std::vector<std::string>& options = {}) {
    write_mesh(mesh_from_model(model), {}, path("organ.vtu"));
    std::vector<std::string> words = {"new", path("organ.vtu"), "-o", path("made")};
    words.insert(words.end(), options.begin(), options.end());
    run_cleanly(words);
    const ProgramRun built =
        run_program({"build", path("made/organ.toml"), "-o", path("organ.pack"), "--survey", "none"});
    EXPECT_EQ(built.exit_code, 0) << built.error;
    run_cleanly({"verify", path("organ.pack")});
    return run_cleanly({"info", path("organ.pack"), "--json"}).json();
  }
  // The force of a push of the site nearest to the place, which must be nonlinear and finite.
  nlohmann::json touched(const std::string& push) {
    return run_cleanly({"eval", path("organ.pack"), "--at", push, "--json"}).json()["contacts"][0];
  }
  std::string path(const std::string& name) const { return (dir_.path() / name).string(); }
  TempDir dir_;
};

// The walls of the cavity are free surface nodes too.
TEST_F(OddOrgan, HollowOrgan) {
  EXPECT_EQ(packed(hollow_block())["sites"].size(), 64U - 16U);
  const nlohmann::json contact = touched("1,1,3=0,0,-0.4");
  EXPECT_LT(contact["force"][2].get<double>(), 0) << contact;
}

// All nodes lie on the surface.
TEST_F(OddOrgan, MembraneOneElementThick) {
  EXPECT_EQ(packed(block_at({0, 0, 0}, {10, 1, 10}, {10, 1, 10}))["sites"].size(), 242U - 2 * 22U);
  const nlohmann::json contact = touched("5,1,5=0,-0.4,0");
  EXPECT_LT(contact["force"][1].get<double>(), 0) << contact;
}

TEST_F(OddOrgan, OrganOf200Nodes) {
  EXPECT_EQ(packed(block_at({0, 0, 0}, {4, 4, 7}, {4, 4, 7}))["sites"].size(), 200U - 6 * 9U - 25U);
  EXPECT_LT(touched("2,2,7=0,0,-0.4")["force"][2].get<double>(), 0);
}

// The build takes minutes, so the test ends with a model that the build accepts.
TEST_F(OddOrgan, OrganOf50000Nodes) {
  write_mesh(mesh_from_model(block_at({0, 0, 0}, {36, 36, 36}, {36, 36, 36})), {}, path("organ.vtu"));
  run_cleanly({"new", path("organ.vtu"), "-o", path("made"), "--probe", "nearest 18,18,36,4"});
  const LoadedScene scene = read_scene(path("made/organ.toml"));
  EXPECT_EQ(scene.model.num_nodes(), 37 * 37 * 37);
  EXPECT_EQ(scene.scene.sites.size(), 49U);
}

}  // namespace cli_odd_organs_test
}  // namespace palpate::test
