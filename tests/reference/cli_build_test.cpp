// `palpate build`, `info` and `verify` as a user meets them.
#include <gtest/gtest.h>

#include <sys/wait.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <sstream>
#include <string>
#include <thread>

#include "tests/support/scene_files.hpp"

namespace palpate::test {
namespace {

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

// Killed at any moment, it goes on where it was and makes the same bytes.
TEST(Build, GoesOnAfterItWasKilled) {
  const SceneFiles files("[contact]\nsites = \"surface\"\nmax_displacement = 0.05\ntip_radius = 0.13\n",
                         block_inp(3));
  ASSERT_EQ(files.build().exit_code, 0);
  const std::string whole = file_text(files.pack);
  std::filesystem::remove_all(files.pack.string() + ".samples");
  const std::vector<std::string> command = {
      "build", files.scene.string(), "-o", files.pack.string(), "--jobs", "1", "--json"};
  ProgramProcess process(command);
  const auto kept = [&] {
    std::uintmax_t bytes = 0;
    std::error_code ignored;
    for (const auto& entry :
         std::filesystem::recursive_directory_iterator(files.pack.string() + ".samples", ignored))
      bytes += entry.is_regular_file() ? entry.file_size() : 0;
    return bytes;
  };
  while (kept() < 100000 && process.is_running())
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  process.kill_now();
  ASSERT_EQ(process.finish().exit_code, -1) << "it was through before it was killed: make the scene larger";
  const ProgramRun resumed_run = run_program(command);
  ASSERT_EQ(resumed_run.exit_code, 0) << resumed_run.error;
  const nlohmann::json resumed = resumed_run.json();
  EXPECT_GT(resumed["reused"].get<int>(), 0);
  EXPECT_GT(resumed["solves"].get<int>(), 0);
  EXPECT_TRUE(file_text(files.pack) == whole);
  EXPECT_EQ(run_program(command).json()["solves"], 0);
  EXPECT_TRUE(file_text(files.pack) == whole);
}

// Sets of several contacts are solved once, kept, and told of: by the build, by `info`, and measured anew by
// `validate`.
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

  // Of those that were kept half are lost, as by a kill: the others are not solved again, and nothing changes.
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
}

// A column four times as tall as it is thick bends: several contacts on it are better answered by the linear
// model, and nothing else of the build would say so.
TEST(Build, SaysWhereZonesAreWorseThanTheLinearModel) {
  std::istringstream lines(block_inp(3));
  std::string column;
  bool is_node = true;
  for (std::string line; std::getline(lines, line); column += line + "\n") {
    if (line.starts_with('*')) is_node = line.starts_with("*NODE");
    const size_t height = line.rfind(',') + 1;
    if (is_node && !line.starts_with('*'))
      line.replace(height, std::string::npos, std::to_string(4 * std::stod(line.substr(height))));
  }
  const std::string scene =
      "[contact]\nsites = [36, 44, 48, 52, 60, 64]\nmax_displacement = 0.1\nmax_contacts = 3\n"
      "[models]\npolynomial = false\nzone = true\nzone_rings = 1\n";
  const char* words = "nonlinear_zone is worse than linear_dd for several contacts";
  const ProgramRun bends = SceneFiles(scene, column).build();
  EXPECT_EQ(bends.exit_code, 0) << bends.error;
  EXPECT_NE(bends.error.find(words), std::string::npos) << bends.error;
  EXPECT_NE(bends.error.find("3 near ("), std::string::npos) << bends.error;
  // Linear tissue is answered exactly by both.
  std::string is_linear = block_inp(3);
  const size_t law = is_linear.find("*HYPERELASTIC");
  is_linear.replace(law, is_linear.find('*', law + 1) - law, "*ELASTIC\n1, 0.3\n");
  for (const std::string& block : {block_inp(3), is_linear}) {
    const ProgramRun run = SceneFiles(scene, block).build();
    EXPECT_EQ(run.exit_code, 0) << run.error;
    EXPECT_EQ(run.error.find(words), std::string::npos) << run.error;
  }
}

// Rings that the target asks for, as many of them as the budget lets; what is missed all the same is said.
TEST(Build, ChoosesRingsFromTargetAndBudget) {
  const auto build = [](double target, double frame_us) {
    std::ostringstream scene;
    scene << "[contact]\nsites = [50, 55, 62]\nmax_displacement = 0.1\nmax_contacts = "
             "2\n[models]\npolynomial = false\n"
          << "[accuracy]\ntarget = " << target << "\n[budget]\nframe_us = " << frame_us << "\n";
    return SceneFiles(scene.str(), block_inp(3)).build().out;
  };
  const auto has = [](const std::string& text, const char* words) {
    return text.find(words) != std::string::npos;
  };
  const char* missed = "nonlinear_zone misses the target";
  const std::string coarse = build(0.1, 1e5);
  EXPECT_TRUE(has(coarse, "zones      1 ring:")) << coarse;
  EXPECT_FALSE(has(coarse, missed)) << coarse;
  EXPECT_TRUE(has(build(0.01, 1e5), "zones      2 rings:"));
  EXPECT_TRUE(has(build(0.001, 1e5), "zones      3 rings:"));
  const std::string narrow = build(0.001, 20);
  EXPECT_TRUE(has(narrow, "zones      1 ring:")) << narrow;
  EXPECT_TRUE(has(narrow, missed)) << narrow;
  const std::string none = build(0.01, 1);
  EXPECT_TRUE(has(none, "zones      none: one ring would take more than [budget] frame_us = 1 ")) << none;
}

// More contacts at once than tools there may be.
TEST(Build, TakesManyContacts) {
  const ProgramRun run = SceneFiles(
                             "[contact]\nsites = \"surface\"\nmax_displacement = 0.02\nmax_contacts = "
                             "20\n[models]\npolynomial = false\n",
                             block_inp(3))
                             .build();
  EXPECT_EQ(run.exit_code, 0) << run.error;
}

TEST(Build, SamplesThatCannotBeKeptAreSaidBeforeTheWork) {
  const SceneFiles files;
  const ProgramRun run = run_program({"build", files.scene.string(), "-o", files.pack.string(), "--samples",
                                      (files.inp / "below").string()});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_NE(run.error.find("--samples"), std::string::npos) << run.error;
}

// What another scene solved is not taken for one's own; another target, precision or number of tools is no other scene.
TEST(Build, SamplesOfAnotherSceneAreNotTaken) {
  const SceneFiles files;
  const std::string scene = file_text(files.scene);
  const auto reused = [&](const std::string& changed) {
    files.dir.write("block.toml", changed);
    const ProgramRun run = run_program({"build", files.scene.string(), "-o", files.pack.string(), "--json"});
    EXPECT_EQ(run.exit_code, 0) << run.error;
    return run.exit_code == 0 && run.json()["reused"].get<int>() > 0;
  };
  const auto with = [&](const std::string& was, const std::string& now) {
    const size_t at = scene.find(was);
    EXPECT_NE(at, std::string::npos) << was;
    return std::string(scene).replace(at, was.size(), now);
  };
  EXPECT_FALSE(reused(scene));
  EXPECT_TRUE(reused(scene));
  EXPECT_TRUE(reused(scene + "[accuracy]\ntarget = 0.02\n"));
  EXPECT_FALSE(reused(with("tip_radius = 0.13", "tip_radius = 0.14")));
  EXPECT_FALSE(reused(with("[contact]\n", "[contact]\ndirections = \"inward\"\n")));
  EXPECT_FALSE(reused(with("max_displacement = 0.03", "max_displacement = 0.031")));
  EXPECT_FALSE(reused(scene + "[output]\nnodes = \"all\"\n"));
  EXPECT_FALSE(reused(scene + "[models]\npolynomial_method = \"paper_ray\"\n"));
  const std::string mesh = file_text(files.inp);
  files.dir.write("block.inp", "** a comment\n" + mesh);
  EXPECT_FALSE(reused(scene));
}

// Every free node of the surface a site, the compliance compressed as it would be of a larger one.
TEST(Build, CompressedComplianceIsSaidAndMeasured) {
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
  // With no polynomials to fit, one push in each quarter of the range at 60 sites.
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

// Kills a build of many sites once it has said its plan and works.
void kill_build_half_way(const SceneFiles& files) {
  ProgramProcess process({"build", files.scene.string(), "-o", files.pack.string(), "--jobs", "1"});
  while (process.printed_so_far().find("estimate") == std::string::npos && process.is_running())
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  process.kill_now();
  EXPECT_EQ(process.finish().exit_code, -1) << "it was through before it was killed: make the scene larger";
}

const std::string kSlow =
    "[contact]\nsites = \"surface\"\nmax_displacement = 0.05\ntip_radius = 0.13\n[accuracy]\ntarget = 1.0\n";

TEST(Build, KilledLeavesNothingUnderItsName) {
  const SceneFiles files(kSlow, block_inp(5));
  kill_build_half_way(files);
  EXPECT_FALSE(std::filesystem::exists(files.pack));
}

TEST(Build, KilledLeavesThePackThatWasThere) {
  const SceneFiles files(kSlow, block_inp(5));
  files.dir.write("block.pack", "the pack of yesterday");
  kill_build_half_way(files);
  EXPECT_EQ(file_text(files.pack), "the pack of yesterday");
}

// The kernel kills a process that writes past its file size limit: here in the middle of writing the pack.
TEST(Build, KilledWhileItWritesLeavesThePackThatWasThere) {
  const SceneFiles files;
  ASSERT_EQ(files.build().exit_code, 0) << "so that nothing but the pack is left to be written";
  files.dir.write("block.pack", "the pack of yesterday");
  const std::string command = "ulimit -c 0; ulimit -f 8; exec " PALPATE_PROGRAM " build " +
                              files.scene.string() + " -o " + files.pack.string() +
                              " --json > /dev/null 2>&1";
  const int status = std::system(("sh -c '" + command + "'").c_str());
  ASSERT_EQ(WEXITSTATUS(status), 128 + SIGXFSZ) << "it was not killed in a write: make the pack larger";
  EXPECT_EQ(file_text(files.pack), "the pack of yesterday");
  // What it had written so far goes with the next build.
  EXPECT_EQ(names_in(files.dir.path()).size(), 5u);
  ASSERT_EQ(files.build().exit_code, 0);
  EXPECT_EQ(names_in(files.dir.path()),
            (std::vector<std::string>{"block.inp", "block.pack", "block.pack.samples", "block.toml"}));
}

TEST(Build, PlaceThatCannotBeWrittenIsSaidBeforeTheWork) {
  const SceneFiles files;
  const std::string nowhere = (files.dir.path() / "nowhere" / "x.pack").string();
  const auto refusal = [&](const std::string& pack) {
    return refusal_of({"build", files.scene.string(), "-o", pack});
  };
  EXPECT_EQ(refusal(nowhere), nowhere + ": its folder does not exist; make it first");
  EXPECT_EQ(refusal(files.dir.path().string()),
            files.dir.path().string() + ": is a folder; name a file in it");
  EXPECT_EQ(refusal(files.scene.string()),
            files.scene.string() + ": is an input of this command; name another file with -o");
  const std::string model = (files.dir.path() / "block.inp").string();
  EXPECT_EQ(refusal(model), model + ": is an input of this command; name another file with -o");
  EXPECT_EQ(refusal("/proc/x.pack").substr(0, 14), "/proc/x.pack: ");
  EXPECT_EQ(names_in(files.dir.path()), (std::vector<std::string>{"block.inp", "block.toml"}));
}

class BuiltPack : public ::testing::Test {
 protected:
  void SetUp() override { ASSERT_EQ(files_.build().exit_code, 0); }
  SceneFiles files_;
};

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

TEST_F(BuiltPack, InfoJsonHoldsEverything) {
  const nlohmann::json info = run_cleanly({"info", files_.pack.string(), "--json"}).json();
  EXPECT_EQ(info["tool_version"], run_cleanly({"--version"}).out.substr(0, 5));
  EXPECT_EQ(info["bytes"].get<size_t>(), std::filesystem::file_size(files_.pack));
  EXPECT_GT(info["arena_bytes"].get<size_t>(), 0u);
  EXPECT_EQ(info["model_nodes"], 27);
  EXPECT_EQ(info["model_elements"], 40);
  EXPECT_EQ(info["max_contacts"], 2);
  EXPECT_EQ(info["max_displacement"], 0.03);
  EXPECT_EQ(info["tip_radius"], 0.13);
  ASSERT_EQ(info["inputs"].size(), 2u);
  EXPECT_EQ(info["inputs"][0]["name"], "block.toml");
  EXPECT_EQ(info["inputs"][1]["name"], "block.inp");
  EXPECT_EQ(info["inputs"][0]["xxh3_128"].get<std::string>().size(), 32u);
  ASSERT_EQ(info["sites"].size(), 2u);
  EXPECT_EQ(info["sites"][1]["node"], 23);
  EXPECT_GE(info["sites"][1]["patch"].size(), 5u);
  for (const char* model : {"linear_dd", "polynomial_dd"}) {
    for (const char* cost : {"bytes", "force_operations", "force_bytes", "field_operations", "field_bytes"})
      EXPECT_GT(info["models"][model][cost].get<size_t>(), 0u) << model << ' ' << cost;
    const nlohmann::json& errors = info["errors"][model];
    EXPECT_GE(errors["bins"].size(), 2u);
    EXPECT_GT(errors["overall"]["samples"].get<int>(), 0);
    for (const char* kind : {"displacement", "force"}) {
      const nlohmann::json& row = errors["overall"][kind];
      EXPECT_LE(row["median"].get<double>(), row["p95"].get<double>());
      EXPECT_LE(row["p95"].get<double>(), row["max"].get<double>());
      EXPECT_GT(row["max"].get<double>(), 0);
    }
  }
  EXPECT_LT(info["errors"]["polynomial_dd"]["overall"]["displacement"]["p95"].get<double>(),
            info["errors"]["linear_dd"]["overall"]["displacement"]["p95"].get<double>());
}

TEST_F(BuiltPack, InfoTextNamesEverything) {
  const std::string text = run_cleanly({"info", files_.pack.string()}).out;
  for (const char* word :
       {"block.toml", "block.inp", "XXH3-128", "arena", "units", "27 nodes", "2 sites", "22, 23",
        "surface_bvh", "linear_dd", "polynomial_dd", "worst frame", "p95", "Palpate"})
    EXPECT_NE(text.find(word), std::string::npos) << word << " is not in\n" << text;
}

TEST_F(BuiltPack, HashesFollowTheContentOfTheInputs) {
  const nlohmann::json before = run_cleanly({"info", files_.pack.string(), "--json"}).json()["inputs"];
  files_.dir.write("block.inp", block_inp(2) + "** a remark\n");
  ASSERT_EQ(files_.build().exit_code, 0);
  const nlohmann::json after = run_cleanly({"info", files_.pack.string(), "--json"}).json()["inputs"];
  EXPECT_EQ(before[0], after[0]);
  EXPECT_NE(before[1]["xxh3_128"], after[1]["xxh3_128"]);
}

TEST_F(BuiltPack, VerifyAnswersInJsonToo) {
  const nlohmann::json answer = run_cleanly({"verify", files_.pack.string(), "--json"}).json();
  EXPECT_EQ(answer["valid"], true);
  EXPECT_EQ(answer["bytes"].get<size_t>(), std::filesystem::file_size(files_.pack));
}

// Every 97th byte, so that header, tables and segments all have their turn.
TEST_F(BuiltPack, FlippedBitsAreRefused) {
  const std::string sound = file_text(files_.pack);
  constexpr size_t kTrials = 60;
  for (size_t trial = 0; trial < kTrials; ++trial) {
    const size_t at = trial < 20 ? trial * 9 : trial * sound.size() / kTrials;
    std::string broken = sound;
    broken[at] = static_cast<char>(broken[at] ^ (1 << trial % 8));
    const std::string file = files_.dir.write("broken.pack", broken).string();
    EXPECT_EQ(refusal_of({"verify", file}).substr(0, file.size() + 2), file + ": ") << "byte " << at;
  }
}

TEST_F(BuiltPack, CutAndPaddedPacksAreRefused) {
  const std::string sound = file_text(files_.pack);
  for (const size_t size : {size_t{0}, size_t{1}, size_t{63}, size_t{64}, size_t{200}, sound.size() / 2,
                            sound.size() - 64, sound.size() - 1}) {
    refusal_of({"verify", files_.dir.write("cut.pack", sound.substr(0, size)).string()});
  }
  refusal_of({"verify", files_.dir.write("padded.pack", sound + "x").string()});
}

TEST_F(BuiltPack, BenchPrintsRows) {
  const ProgramRun text = run_cleanly({"bench", files_.pack.string(), "--frames", "1000"});
  for (const char* word : {"median", "p99", "p99.9", "max", "linear", "polynomial", "memcpy"})
    EXPECT_NE(text.out.find(word), std::string::npos) << text.out;
  const nlohmann::json rows =
      run_cleanly({"bench", files_.pack.string(), "--frames", "1000", "--json"}).json()["rows"];
  ASSERT_GE(rows.size(), 8u);
  for (const nlohmann::json& row : rows) {
    EXPECT_LE(row["median_ns"].get<double>(), row["p99_ns"].get<double>()) << row;
    EXPECT_LE(row["p99_ns"].get<double>(), row["p999_ns"].get<double>()) << row;
    EXPECT_LE(row["p999_ns"].get<double>(), row["max_ns"].get<double>()) << row;
  }
}

TEST_F(BuiltPack, PictureIsAPng) {
  const std::filesystem::path png = files_.dir.path() / "push.png";
  run_cleanly({"picture", files_.pack.string(), "--contact", "23=0,0,-0.03", "-o", png.string()});
  EXPECT_EQ(file_text(png).substr(0, 8), "\x89PNG\r\n\x1a\n");
  const nlohmann::json json =
      run_cleanly({"picture", files_.pack.string(), "-o", png.string(), "--json"}).json();
  EXPECT_EQ(json["picture"], png.string());
  EXPECT_EQ(json["contacts"].size(), 0u);
}

}  // namespace
}  // namespace palpate::test
