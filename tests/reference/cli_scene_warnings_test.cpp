// What `build`, `info` and `eval` say of a scene that does not suit its mesh: immobile sites, a small tip, a
// mistaken unit.
#include <gtest/gtest.h>

#include <string>

#include "tests/support/scene_files.hpp"

namespace palpate::test {
namespace cli_scene_warnings_test {

const std::string kUnits = "[units]\nlength = \"mm\"\nforce = \"mN\"\n";

// The block of three cells, with the layer under its top fixed about node 54. An element of height 0.125 has
// its top corner at node 54 alone: J = 0.1 for a push of 0.1125.
std::string block_with_immobile_site() {
  std::string text = block_inp(3);
  text += "*BOUNDARY\n";
  for (const int row : {33, 37, 41}) {
    for (int node = row; node < row + 3; ++node) text += std::to_string(node) + ", 1, 3\n";
  }
  return text;
}

SceneFiles scene_with_sites(const std::string& sites) {
  return SceneFiles("[contact]\nsites = " + sites +
                        "\nmax_displacement = 0.5\ntip_radius = 0.01\n[models]\npolynomial = false\n",
                    block_with_immobile_site());
}

TEST(SceneWarnings, AnImmobileSiteIsLeftOut) {
  const SceneFiles files = scene_with_sites("[54, 64]");
  const ProgramRun run =
      run_program({"build", files.scene.string(), "-o", files.pack.string(), "--jobs", "1", "--json"});
  ASSERT_EQ(run.exit_code, 0) << run.error;
  EXPECT_NE(run.error.find("1 of 2 sites are left out"), std::string::npos) << run.error;
  EXPECT_NE(run.error.find(": 54 (0.113); 1 site is left"), std::string::npos) << run.error;
  EXPECT_EQ(run.json()["sites"], 1);
  EXPECT_EQ(run.json()["sites_left_out"], nlohmann::json::array({54}));
  const nlohmann::json info = run_cleanly({"info", files.pack.string(), "--json"}).json();
  ASSERT_EQ(info["sites"].size(), 1U);
  EXPECT_EQ(info["sites"][0]["node"], 64);
  const ProgramRun validated = run_program({"validate", files.pack.string(), "--samples", "4", "--json"});
  EXPECT_NE(validated.exit_code, 1) << validated.error;
}

TEST(SceneWarnings, ASceneWithoutAMobileSiteIsRefused) {
  const SceneFiles files = scene_with_sites("[54]");
  const ProgramRun run = files.build();
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_NE(run.error.find("no site is left"), std::string::npos) << run.error;
  EXPECT_FALSE(std::filesystem::exists(files.pack));
}

// The edges are 0.125 along the axes and 0.177 along diagonals.
TEST(SceneWarnings, ASmallTipIsSaidByEveryCommand) {
  for (const bool is_small : {true, false}) {
    const SceneFiles files(kUnits + "[contact]\nsites = [23]\nmax_displacement = 0.03\ntip_radius = " +
                           (is_small ? "0.1" : "0.2") + "\n");
    const std::string words = "is smaller than an edge";
    const auto says = [&](const std::string& text) { return text.find(words) != std::string::npos; };
    const ProgramRun build = files.build();
    ASSERT_EQ(build.exit_code, 0) << build.error;
    EXPECT_EQ(says(build.error), is_small) << build.error;
    const std::string pack = files.pack.string();
    EXPECT_EQ(says(run_cleanly({"info", pack}).out), is_small);
    EXPECT_EQ(run_cleanly({"info", pack, "--json"}).json()["tip_below_edge"], is_small);
    const std::vector<std::string> eval = {"eval", pack, "--contact", "23=0,0,-0.02"};
    EXPECT_EQ(says(run_cleanly(eval).out), is_small);
    std::vector<std::string> eval_json = eval;
    eval_json.emplace_back("--json");
    EXPECT_EQ(run_cleanly(eval_json).json().contains("tip_below_edge"), is_small);
  }
}

// The warning of a mistaken unit comes before the plan, and so does the end of a hopeless build.
TEST(SceneWarnings, TheSizeIsSaidWithItsUnit) {
  const SceneFiles files(kUnits + "[contact]\nsites = [23]\nmax_displacement = 0.03\ntip_radius = 0.2\n");
  const ProgramRun run = files.build();
  ASSERT_EQ(run.exit_code, 0) << run.error;
  EXPECT_NE(run.out.find("organ 0.25 x 0.25 x 0.25 mm; |d| to 0.03 mm: "), std::string::npos) << run.out;
  EXPECT_NE(run.out.find(" h, 12 % of it"), std::string::npos) << run.out;
  EXPECT_NE(run.error.find("the organ is 0.25 x 0.25 x 0.25 mm, below 1 mm"), std::string::npos) << run.error;
  const SceneFiles far(kUnits + "[contact]\nsites = [23]\nmax_displacement = 30\ntip_radius = 0.2\n");
  EXPECT_NE(far.build().error.find("120 times the organ"), std::string::npos);
}

}  // namespace cli_scene_warnings_test
}  // namespace palpate::test
