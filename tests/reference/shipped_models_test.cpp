// The shipped models as a user builds them: the promises of docs/accuracy.md, at a few of the brain's sites.
#include <gtest/gtest.h>

#include <filesystem>

#include "tests/support/nightly.hpp"
#include "tests/support/run_program.hpp"
#include "tests/support/temp_dir.hpp"

namespace palpate::test {
namespace shipped_models_test {

const std::filesystem::path kBrain = std::filesystem::path(PALPATE_SOURCE_DIR) / "models" / "brain";

// Nodes of the brain's PROBE set; brain_push.inp pushes node 936.
constexpr const char* kSites = "[711, 812, 936]";

// One build serves all checks, because the build is slow. The nightly run surveys several contacts, too.
TEST(ShippedBrain, IsAnsweredToAPercent) {
  const TempDir dir;
  const std::filesystem::path scene = dir.write(
      "brain.toml", "model = \"" + (kBrain / "brain.inp").string() + "\"\n[contact]\nsites = " + kSites +
                        "\nmax_displacement = 8.24\ntip_radius = 10.0\nmax_contacts = " +
                        (is_nightly() ? "3" : "1") + "\n");
  const std::string pack = (dir.path() / "brain.pack").string();
  const nlohmann::json built = run_cleanly({"build", scene.string(), "-o", pack, "--json"}).json();

  const nlohmann::json info = run_cleanly({"info", pack, "--json"}).json();
  EXPECT_EQ(info["model_nodes"], 3924);
  EXPECT_EQ(info["model_elements"], 19734);
  EXPECT_NEAR(info["mean_surface_edge"].get<double>(), 8.23, 0.005);

  // Degree 3 keeps the largest errors of displacement and force below 1 %, for pushes of a mean surface edge.
  EXPECT_TRUE(built["target_met"].get<bool>());
  EXPECT_EQ(built["survey_pushes_without_equilibrium"], 0);
  EXPECT_GE(built["max_displacement_over_h"].get<double>(), 1.0);
  const nlohmann::json& errors = built["errors"]["polynomial_dd"]["overall"];
  EXPECT_GE(errors["samples"].get<int>(), 128);
  EXPECT_LE(errors["displacement"]["max"].get<double>(), 0.01);
  EXPECT_LE(errors["force"]["max"].get<double>(), 0.01);

  // brain_push.inp and the contact in its heading must be the same push, or `eval --reference` refuses.
  const std::filesystem::path push = kBrain / "brain_push.inp";
  const std::string text = file_text(push);
  const std::string mark = "** contact: ";
  const size_t start = text.find(mark) + mark.size();
  const std::string contact = text.substr(start, text.find('\n', start) - start);
  const std::filesystem::path out = dir.path() / "push";
  run_cleanly({"solve", push.string(), "-o", out.string()});
  const std::string table = (out / "step1.csv").string();
  const nlohmann::json answer =
      run_cleanly({"eval", pack, "--contact", contact, "--reference", table, "--json"}).json();
  EXPECT_LE(answer["contacts"][0]["reference"]["force_error"].get<double>(), 0.01);
  EXPECT_LE(answer["reference"]["displacement_error"].get<double>(), 0.01);
}

TEST(ShippedCylinder, SolvesItsPush) {
  const TempDir dir;
  const std::filesystem::path push =
      std::filesystem::path(PALPATE_SOURCE_DIR) / "models/cylinder/cylinder_push.inp";
  const nlohmann::json summary =
      run_cleanly({"solve", push.string(), "-o", dir.path().string(), "--json"}).json();
  EXPECT_EQ(summary["nodes"], 195);
  EXPECT_EQ(summary["elements"], 586);
  EXPECT_TRUE(summary["steps"][0]["converged"].get<bool>());
}

}  // namespace shipped_models_test
}  // namespace palpate::test
