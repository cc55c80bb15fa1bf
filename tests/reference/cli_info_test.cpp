// `palpate info`, `verify`, `bench` and `picture` of a pack.
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
namespace cli_info_test {

class BuiltPack : public ::testing::Test {
 protected:
  void SetUp() override { ASSERT_EQ(files_.build().exit_code, 0); }
  SceneFiles files_;
};

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

// Every 97th byte reaches header, tables and segments.
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
  EXPECT_EQ(json["contacts"].size(), 1u);  // from above
}

}  // namespace cli_info_test
}  // namespace palpate::test
