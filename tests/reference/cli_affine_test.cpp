// A scene that samples as few sites as possible, from `palpate build` to responses at unsampled sites.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <map>
#include <string>

#include "tests/support/scene_files.hpp"

namespace palpate::test {
namespace cli_affine_test {

std::string whole_top(double max_displacement, double target) {
  return fmt::format(
      "[contact]\nsites = \"surface\"\nsampled = \"fewest\"\nmax_displacement = {}\ntip_radius = 0.13\n"
      "[accuracy]\ntarget = {}\n",
      max_displacement, target);
}

nlohmann::json built(const SceneFiles& files, const std::string& jobs = "1") {
  const ProgramRun run =
      run_program({"build", files.scene.string(), "-o", files.pack.string(), "--jobs", jobs, "--json"});
  EXPECT_EQ(run.exit_code, 0) << run.error;
  return run.json();
}

nlohmann::json contact_of(const SceneFiles& files, int node, const std::string& push,
                          const std::string& model) {
  return run_cleanly({"eval", files.pack.string(), "--contact", fmt::format("{}={}", node, push), "--model",
                      model, "--json"})
      .json()["contacts"][0];
}

// Small pushes need no samples: two solves a site confirm the linear response, and the survey takes the other
// solves.
TEST(Affine, SmallPushesAreAnsweredWithoutSamples) {
  const SceneFiles files(whole_top(0.04, 0.01));
  const nlohmann::json result = built(files);
  EXPECT_EQ(result["sites_sampled"], 0);
  EXPECT_EQ(result["target_met"], true);
  const auto sites = result["sites"].get<int>();
  EXPECT_EQ(result["errors"].count("polynomial_dd"), 0u);
  const nlohmann::json overall = result["errors"]["affine_site"]["overall"];
  EXPECT_EQ(result["solves"], 2 * sites + overall["samples"].get<int>()) << "that of rest takes none";
  EXPECT_LT(overall["displacement"]["p95"], 0.005);
  EXPECT_LT(overall["displacement"]["p95"].get<double>(),
            0.2 * result["errors"]["linear_dd"]["overall"]["displacement"]["p95"].get<double>());
  run_cleanly({"verify", files.pack.string()});
  const ProgramRun validated =
      run_program({"validate", files.pack.string(), "--samples", "32", "--seed", "5"});
  EXPECT_EQ(validated.exit_code, 0) << validated.out;

  const nlohmann::json affine = contact_of(files, 23, "0.01,0,-0.03", "affine");
  EXPECT_EQ(affine["model"], "affine");
  EXPECT_EQ(affine["flags"], nlohmann::json::array());
  EXPECT_LT(affine["error_estimate"]["displacement"], 0.02);
  for (const char* model : {"auto", "polynomial"}) {
    EXPECT_EQ(contact_of(files, 23, "0.01,0,-0.03", model), affine) << "there is no other polynomial";
  }
}

// Larger pushes need samples at some sites; each site states its model.
TEST(Affine, WhereTheTargetAsksForThemSitesAreSampled) {
  const SceneFiles files(whole_top(0.06, 0.004));
  const nlohmann::json result = built(files, "2");
  const std::string bytes = file_text(files.pack);
  const auto num_sites = result["sites"].get<size_t>();
  const auto num_sampled = result["sites_sampled"].get<size_t>();
  ASSERT_GT(num_sampled, 0u);
  ASSERT_LT(num_sampled, num_sites) << "change the target: it is to be a mixture";
  EXPECT_GT(result["errors"]["affine_site"]["overall"]["samples"], 0);
  EXPECT_GE(result["errors"]["polynomial_dd"]["overall"]["samples"], 60) << "however few are sampled";

  const nlohmann::json info = run_cleanly({"info", files.pack.string(), "--json"}).json();
  std::map<bool, int> one_of_each;
  for (const nlohmann::json& site : info["sites"]) one_of_each[site["samples"] > 0] = site["node"];
  ASSERT_EQ(one_of_each.size(), 2u);
  const std::string push = "0.02,0.01,-0.03";
  EXPECT_EQ(contact_of(files, one_of_each[true], push, "auto")["model"], "polynomial");
  EXPECT_EQ(contact_of(files, one_of_each[false], push, "auto")["model"], "affine");
  nlohmann::json own = contact_of(files, one_of_each[true], push, "polynomial");
  own["model"] = "affine";
  EXPECT_EQ(contact_of(files, one_of_each[true], push, "affine"), own) << "its own polynomial answers best";

  // A push at a site of one model says nothing about the other model.
  const nlohmann::json validated =
      run_program({"validate", files.pack.string(), "--samples", "1", "--sets", "0", "--json"})
          .json()["models"];
  EXPECT_NE(validated["affine_site"]["p95_ratio"].is_null(),
            validated["polynomial_dd"]["p95_ratio"].is_null());
  EXPECT_NE(validated["affine_site"]["within_estimate"].is_null(),
            validated["polynomial_dd"]["within_estimate"].is_null());

  // The same bytes on one thread, and from stored solves.
  EXPECT_EQ(built(files)["solves"], 0);
  EXPECT_TRUE(file_text(files.pack) == bytes);
  std::filesystem::remove_all(files.pack.string() + ".samples");
  built(files);
  EXPECT_TRUE(file_text(files.pack) == bytes);
}

TEST(Affine, BetweenSitesItIsTheirBlend) {
  const SceneFiles files(whole_top(0.04, 0.01));
  built(files);
  const nlohmann::json info = run_cleanly({"info", files.pack.string(), "--json"}).json();
  const nlohmann::json between = run_cleanly({"eval", files.pack.string(), "--at",
                                              "0.13,0.15,0.25=0.01,0,-0.02", "--model", "affine", "--json"})
                                     .json()["contacts"][0];
  EXPECT_EQ(between["model"], "affine");
  ASSERT_GT(between["corners"].size(), 1u);
  Eigen::Vector3d expected = Eigen::Vector3d::Zero();
  for (const nlohmann::json& corner : between["corners"]) {
    const nlohmann::json own = contact_of(files, corner["node"], "0.01,0,-0.02", "affine");
    for (int axis = 0; axis < 3; ++axis)
      expected[axis] +=
          corner["weight"].get<double>() * own["force"][static_cast<size_t>(axis)].get<double>();
  }
  for (int axis = 0; axis < 3; ++axis)
    EXPECT_NEAR(between["force"][static_cast<size_t>(axis)].get<double>(), expected[axis],
                1e-12 * expected.norm());
}

TEST(Affine, ForOneContactThatIsMoved) {
  const SceneFiles files;
  ASSERT_EQ(files.build().exit_code, 0);
  const auto refusal = [&](const std::vector<std::string>& more) {
    std::vector<std::string> command = {"eval", files.pack.string(), "--model", "affine"};
    command.insert(command.end(), more.begin(), more.end());
    const ProgramRun run = run_program(command);
    EXPECT_NE(run.exit_code, 0);
    return run.error;
  };
  EXPECT_NE(refusal({"--contact", "22=0,0,0.01", "--contact", "23=0,0,0.01"}).find("one displaced contact"),
            std::string::npos);
  EXPECT_NE(refusal({"--contact", "22=0,0,0.01", "--fix", "23"}).find("--fix"), std::string::npos);
}

}  // namespace cli_affine_test
}  // namespace palpate::test
