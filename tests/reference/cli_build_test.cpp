// `palpate build`, `info` and `verify` as a user runs them.
#include <gtest/gtest.h>

#include <sys/wait.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <sstream>
#include <string>
#include <thread>

#include "tests/support/nightly.hpp"
#include "tests/support/scene_files.hpp"

namespace palpate::test {
namespace cli_build_test {

TEST(Build, MakesAPackThatOpensAndSaysWhatItTakesFirst) {
  const SceneFiles files;
  const ProgramRun run = files.build();
  ASSERT_EQ(run.exit_code, 0) << run.error;
  const size_t estimate = run.out.find("estimate ");
  ASSERT_NE(estimate, std::string::npos) << run.out;
  EXPECT_LT(estimate, run.out.find("solved "));
  EXPECT_NE(run.out.find("polynomial_dd"), std::string::npos) << run.out;
  run_cleanly({"verify", files.pack.string()});
  EXPECT_EQ(names_in(files.dir.path()),
            (std::vector<std::string>{"block.inp", "block.pack", "block.pack.samples", "block.toml"}));
}

TEST(Build, BytesDependOnTheInputsAlone) {
  const SceneFiles files;
  std::vector<std::string> bytes;
  for (const char* jobs : {"1", "2", "2"}) {
    const ProgramRun run =
        run_program({"build", files.scene.string(), "-o", files.pack.string(), "--jobs", jobs, "--json",
                     "--samples", (files.dir.path() / std::to_string(bytes.size())).string()});
    ASSERT_EQ(run.exit_code, 0) << run.error;
    EXPECT_EQ(run.json()["reused"], 0);
    EXPECT_EQ(run.json()["bytes"].get<size_t>(), std::filesystem::file_size(files.pack));
    bytes.push_back(file_text(files.pack));
  }
  EXPECT_TRUE(bytes[0] == bytes[1]) << "one thread and two";
  EXPECT_TRUE(bytes[1] == bytes[2]) << "two runs";
}

// Contact sets are solved once and stored. `build` and `info` report their errors, and `validate` measures
// them anew.
TEST(Build, SurveysSeveralContacts) {
  const SceneFiles files(
      "[contact]\nsites = [50, 52, 55, 57, 62, 64]\nmax_displacement = 0.02\ntip_radius = 0.07\n"
      "max_contacts = 3\n[models]\npolynomial = false\n",
      block_inp(3));
  const std::vector<std::string> command = {
      "build", files.scene.string(), "-o", files.pack.string(), "--jobs", "1", "--json"};
  const ProgramRun run = run_program(command);
  ASSERT_EQ(run.exit_code, 0) << run.error;
  const std::string whole = file_text(files.pack);
  const nlohmann::json info = run_cleanly({"info", files.pack.string(), "--json"}).json();
  const nlohmann::json& several = info["errors"]["linear_dd"]["several"];
  ASSERT_EQ(several.size(), 4U) << info["errors"];
  int sets = 0;
  for (const nlohmann::json& kind : several) {
    sets += kind["sets"].get<int>();
    EXPECT_LE(kind["displacement"]["median"], kind["displacement"]["p95"]);
    EXPECT_GT(kind["force"]["median"].get<double>(), 0);
  }
  EXPECT_EQ(sets, 60);
  EXPECT_EQ(several[0]["contacts"], 2);
  EXPECT_EQ(several[0]["near"], true);
  const std::string text = run_cleanly({"info", files.pack.string()}).out;
  for (const char* words : {"2 near", "2 anywhere", "3 near", "3 apart"})
    EXPECT_NE(text.find(words), std::string::npos) << words << " is not in\n" << text;

  // Half of the stored solves are lost, as after a kill. The other half is not solved again, and no byte
  // changes.
  std::vector<std::filesystem::path> kept;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(files.pack.string() + ".samples")) {
    if (entry.path().filename().string().starts_with("set-")) kept.push_back(entry.path());
  }
  ASSERT_EQ(kept.size(), 60U);
  for (size_t i = 0; i < kept.size(); i += 2) std::filesystem::remove(kept[i]);
  std::filesystem::remove(files.pack);
  std::vector<std::string> threads = command;
  threads[5] = "2";
  const nlohmann::json resumed = run_cleanly(threads).json();
  EXPECT_EQ(resumed["solves"], 30);
  EXPECT_TRUE(file_text(files.pack) == whole);
  EXPECT_EQ(run_cleanly(command).json()["solves"], 0);

  const ProgramRun validated =
      run_program({"validate", files.pack.string(), "--samples", "16", "--sets", "32", "--json"});
  ASSERT_EQ(validated.exit_code, 0) << validated.out;
  const nlohmann::json json = validated.json();
  EXPECT_EQ(json["sets"], 32);
  for (const nlohmann::json& kind : json["models"]["linear_dd"]["several"]) {
    EXPECT_EQ(kind["sets"], 8);
    EXPECT_GT(kind["p95_ratio"]["force"].get<double>(), 0);
  }
  EXPECT_FALSE(json["models"]["linear_dd"].contains("several_within_estimate")) << "it estimates none";
  EXPECT_GE(json["models"]["nonlinear_zone"]["several_within_estimate"]["displacement"].get<double>(), 0.85);
  // One contact, and up to three, at four speeds with three lags. The faster and the later, the more wrong.
  const nlohmann::json& motion = json["motion"];
  ASSERT_EQ(motion.size(), 24U);
  EXPECT_EQ(motion[4]["speed_mm_s"], 20);
  EXPECT_EQ(motion[4]["lag_ms"], 10);
  EXPECT_EQ(motion[4]["contacts"], 1);
  EXPECT_EQ(motion[4]["frames"], 16);
  EXPECT_GT(motion[4]["force"]["p95"].get<double>(), 0);
  EXPECT_LT(motion[4]["force"]["p95"], motion[11]["force"]["p95"]);
  EXPECT_EQ(motion[12]["contacts"], 3);
}

// A column four times as tall as thick bends. Separate zones act on each other through all of it.
TEST(Build, ZonesAreExactWhereAColumnBends) {
  std::istringstream lines(block_inp(3));
  std::string column;
  bool is_node = true;
  for (std::string line; std::getline(lines, line); column += line + "\n") {
    if (line.starts_with('*')) is_node = line.starts_with("*NODE");
    const size_t height = line.rfind(',') + 1;
    if (is_node && !line.starts_with('*'))
      line.replace(height, std::string::npos, std::to_string(4 * std::stod(line.substr(height))));
  }
  const SceneFiles files(
      "[contact]\nsites = [36, 44, 48, 52, 60, 64]\nmax_displacement = 0.1\nmax_contacts = 3\n"
      "[models]\npolynomial = false\nzone = true\nzone_rings = 1\n",
      column);
  const ProgramRun bends = files.build();
  EXPECT_EQ(bends.exit_code, 0) << bends.error;
  const nlohmann::json errors = run_cleanly({"info", files.pack.string(), "--json"}).json()["errors"];
  for (const nlohmann::json& kind : errors["nonlinear_zone"]["several"]) {
    EXPECT_LE(kind["displacement"]["max"].get<double>(), 1e-4) << kind;
    EXPECT_LE(kind["force"]["max"].get<double>(), 1e-4) << kind;
  }
}

// The budget limits the rings.
TEST(Build, ChoosesRingsFromTheBudget) {
  const auto build = [](double frame_us) {
    std::ostringstream scene;
    scene << "[contact]\nsites = [50, 55, 62]\nmax_displacement = 0.1\nmax_contacts = "
             "2\n[models]\npolynomial = false\n[budget]\nframe_us = "
          << frame_us << "\n";
    return SceneFiles(scene.str(), block_inp(3)).build().out;
  };
  const auto has = [](const std::string& text, const char* words) {
    return text.find(words) != std::string::npos;
  };
  const std::string wide = build(1e5);
  EXPECT_TRUE(has(wide, "zones      2 rings:")) << wide;
  const std::string narrow = build(20);
  EXPECT_TRUE(has(narrow, "zones      1 ring:")) << narrow;
  const std::string none = build(1);
  EXPECT_TRUE(has(none, "zones      none: one ring would take more than [budget] frame_us = 1;")) << none;
}

// A pack for a quick try: it answers, and estimates no errors.
TEST(Build, WithoutASurvey) {
  const char* scene = "[contact]\nsites = [50, 55, 62]\nmax_displacement = 0.1\nmax_contacts = 2\n[models]\n";
  const SceneFiles zones(std::string(scene) + "polynomial = false\nzone = true\n", block_inp(3));
  const std::string pack = zones.pack.string();
  const ProgramRun run = run_program({"build", zones.scene.string(), "-o", pack, "--survey", "none"});
  EXPECT_EQ(run.exit_code, 0) << run.error;
  const nlohmann::json answer = run_cleanly({"eval", pack, "--contact", "55=0.01,0,-0.05", "--json"}).json();
  EXPECT_EQ(answer["contacts"][0]["model"], "zone");
  EXPECT_TRUE(run_cleanly({"info", pack, "--json"}).json()["errors"].empty());
  const SceneFiles polynomials(std::string(scene) + "polynomial = true\n", block_inp(3));
  const ProgramRun refused =
      run_program({"build", polynomials.scene.string(), "-o", polynomials.pack.string(), "--survey", "none"});
  EXPECT_NE(refused.exit_code, 0);
  EXPECT_NE(refused.error.find("[models] polynomial = false"), std::string::npos) << refused.error;
}

// More contacts at once than tools.
TEST(Build, TakesManyContacts) {
  const ProgramRun run = SceneFiles(
                             "[contact]\nsites = \"surface\"\nmax_displacement = 0.02\nmax_contacts = "
                             "20\n[models]\npolynomial = false\n",
                             block_inp(3))
                             .build();
  EXPECT_EQ(run.exit_code, 0) << run.error;
}

// Every free surface node is a site. The compliance is compressed, as for a larger organ.
TEST(Build, CompressedComplianceIsSaidAndMeasured) {
  if (!is_nightly()) GTEST_SKIP() << "only in ./dev test --all";
  const std::string scene =
      "[contact]\nsites = \"surface\"\nmax_displacement = 0.02\ntip_radius = 0.13\nmax_contacts = 3\n"
      "[models]\npolynomial = false\ncompliance = \"";
  std::vector<std::string> bytes;
  nlohmann::json built;
  const SceneFiles files(scene + "compressed\"\n", block_inp(5));
  for (const char* jobs : {"1", "2"}) {
    const ProgramRun run =
        run_program({"build", files.scene.string(), "-o", files.pack.string(), "--jobs", jobs, "--json"});
    ASSERT_EQ(run.exit_code, 0) << run.error;
    built = run.json();
    bytes.push_back(file_text(files.pack));
  }
  EXPECT_TRUE(bytes[0] == bytes[1]) << "one thread and two";
  EXPECT_GT(built["sites"].get<int>(), 100);
  const nlohmann::json info = run_cleanly({"info", files.pack.string(), "--json"}).json();
  EXPECT_EQ(info["compliance"], built["compliance"]);
  EXPECT_EQ(info["compliance"]["form"], "compressed");
  EXPECT_EQ(info["compliance"]["samples"], 24);
  EXPECT_GT(info["compliance"]["displacement_error"].get<double>(), 0);
  EXPECT_LE(info["compliance"]["displacement_error"].get<double>(), 2e-3);
  EXPECT_LE(info["compliance"]["force_error"].get<double>(), 5e-4);
  // Without polynomials: a push in each quarter of the range at 60 sites.
  EXPECT_EQ(info["errors"]["linear_dd"]["overall"]["samples"], 240);
  for (const nlohmann::json& bin : info["errors"]["linear_dd"]["bins"]) EXPECT_EQ(bin["samples"], 60);
  EXPECT_NE(run_cleanly({"info", files.pack.string()}).out.find("compressed"), std::string::npos);
  run_cleanly({"verify", files.pack.string()});

  const SceneFiles dense(scene + "auto\"\n", block_inp(5));
  const ProgramRun run = dense.build();
  ASSERT_EQ(run.exit_code, 0) << run.error;
  EXPECT_NE(run.out.find("compliance dense"), std::string::npos) << run.out;
  EXPECT_EQ(run_cleanly({"info", dense.pack.string(), "--json"}).json()["compliance"]["form"], "dense");
}

// Only the compliance that answers a contact until its zone is prepared, and that compressed.
TEST(Build, ZonesMayBeAlone) {
  const SceneFiles files(
      "[contact]\nsites = \"surface\"\nmax_displacement = 0.1\n"
      "[models]\nlinear = false\npolynomial = false\nzone = true\nzone_rings = 1\n",
      block_inp(3));
  const ProgramRun run =
      run_program({"build", files.scene.string(), "-o", files.pack.string(), "--survey", "none", "--json"});
  ASSERT_EQ(run.exit_code, 0) << run.error;
  EXPECT_EQ(run.json()["compliance"]["form"], "dense");  // few nodes
  const nlohmann::json answer =
      run_cleanly({"eval", files.pack.string(), "--at", "0.5,0.5,1=0,0,-0.1", "--json"}).json();
  EXPECT_EQ(answer["contacts"][0]["model"], "zone") << answer.dump(1);
}

TEST(Build, ForcesThatNoPackHoldsAreSaidAsSuch) {
  std::string model = block_inp(2);
  const std::string law = "*HYPERELASTIC, COMPRESSIBLE NEO HOOKE\n";
  const size_t numbers = model.find(law) + law.size();
  ASSERT_GE(numbers, law.size());
  model.replace(numbers, model.find('\n', numbers) - numbers, "1e38, 4e38");
  const SceneFiles files(kContact, model);
  const ProgramRun run = files.build();
  EXPECT_NE(run.exit_code, 0);
  EXPECT_NE(run.error.find("state the model in other units of length or force"), std::string::npos)
      << run.error;
  EXPECT_FALSE(std::filesystem::exists(files.pack));
}

}  // namespace cli_build_test
}  // namespace palpate::test
