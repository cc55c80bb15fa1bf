// The examples run, and the README quotes the first one as it stands.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>

#include "tests/support/shell_command.hpp"
#include "tests/support/small_pack.hpp"

namespace palpate::test {
namespace example_test {

const std::filesystem::path kSource = PALPATE_SOURCE_DIR;

std::string text_of(const std::filesystem::path& file) {
  std::ifstream stream(file);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

long count_lines(const std::string& text) {
  return std::count(text.begin(), text.end(), '\n');
}

// The first ```c block that starts with the first line of `example`, or "".
std::string quoted_block(const std::string& readme, const std::string& example) {
  const std::string fence = "```c\n";
  const std::size_t at = readme.find(fence + example.substr(0, example.find('\n') + 1));
  if (at == std::string::npos) return "";
  const std::size_t begin = at + fence.size();
  const std::size_t end = readme.find("\n```", begin);
  return end == std::string::npos ? "" : readme.substr(begin, end + 1 - begin);
}

TEST(Example, TouchPrintsGrowingForces) {
  const TempDir dir;
  const auto bytes = small_pack_bytes().bytes();
  const auto pack = dir.write("block.pack", {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  const CommandResult run = run_command(shell_word(PALPATE_EXAMPLE_TOUCH) + " " + shell_word(pack.string()));
  EXPECT_EQ(run.exit_code, 0) << run.output;
  EXPECT_EQ(count_lines(run.output), 6) << run.output;
  std::istringstream lines(run.output);
  double last = -1;
  for (std::string line; std::getline(lines, line);) {
    double pushed = 0;
    double force = 0;
    ASSERT_EQ(sscanf(line.c_str(), "pushed %lf, force %lf", &pushed, &force), 2) << line;
    EXPECT_EQ(force == 0, pushed == 0);
    EXPECT_GT(force, last);
    last = force;
  }
}

TEST(Example, RecordsWhatReplays) {
  const TempDir dir;
  const auto bytes = small_pack_bytes().bytes();
  const std::string pack = shell_word(
      dir.write("block.pack", {reinterpret_cast<const char*>(bytes.data()), bytes.size()}).string());
  const std::string recording = shell_word((dir.path() / "touch.rec").string());
  const CommandResult run = run_command(shell_word(PALPATE_EXAMPLE_RECORD) + " " + pack + " " + recording);
  ASSERT_EQ(run.exit_code, 0) << run.output;
  EXPECT_EQ(count_lines(run.output), 11) << run.output;
  EXPECT_NE(run.output.find("1 contacts"), std::string::npos) << run.output;
  const CommandResult replay = run_command(shell_word(PALPATE_PROGRAM) + " replay " + pack + " " + recording);
  EXPECT_EQ(replay.exit_code, 0) << replay.output;
  EXPECT_EQ(replay.output, "1001 frames, 1.001 s: every answer is the recorded one, to the bit\n");
  EXPECT_EQ(run_command(shell_word(PALPATE_PROGRAM) + " replay " + pack + " " + pack).exit_code, 1);
}

TEST(Example, RefinesUntilTheForceStandsStill) {
  const TempDir dir;
  const auto bytes = zone_pack_bytes().bytes();
  const std::string pack = shell_word(
      dir.write("block.pack", {reinterpret_cast<const char*>(bytes.data()), bytes.size()}).string());
  const CommandResult run = run_command(shell_word(PALPATE_EXAMPLE_REFINE) + " " + pack);
  ASSERT_EQ(run.exit_code, 0) << run.output;
  EXPECT_EQ(count_lines(run.output), 11) << run.output;
  EXPECT_NE(run.output.find("1000 ms: force"), std::string::npos) << run.output;
  const auto force_at = [&](const std::string& time) {
    double force[3] = {};
    const size_t at = run.output.find(time + " ms: force (");
    EXPECT_EQ(
        sscanf(run.output.c_str() + at + time.size() + 12, "%lf, %lf, %lf", force, force + 1, force + 2), 3);
    return Eigen::Vector3d(force);
  };
  EXPECT_LE((force_at("1000") - force_at(" 900")).norm(), 1e-3 * force_at("1000").norm());
}

TEST(Example, TouchSaysWhyItCannotOpen) {
  for (const std::string argument : {" /no/such/file.pack", ""}) {
    const CommandResult run = run_command(shell_word(PALPATE_EXAMPLE_TOUCH) + argument);
    EXPECT_EQ(run.exit_code, 1);
    EXPECT_EQ(count_lines(run.output), 1) << run.output;
  }
}

TEST(Example, ReadmeQuotesItVerbatim) {
  if (!std::filesystem::exists(kSource / "README.md")) GTEST_SKIP() << "no README.md";
  const std::string example = text_of(kSource / "examples/01_touch.c");
  ASSERT_GT(example.size(), 100U);
  EXPECT_EQ(quoted_block(text_of(kSource / "README.md"), example), example);
}

TEST(Example, QuoteCheckSeesADifference) {
  const std::string example = "#include <a>\n\nint main() {}\n";
  EXPECT_EQ(quoted_block("Text\n```c\nint x;\n```\n\n```c\n" + example + "```\nmore\n", example), example);
  EXPECT_EQ(quoted_block("Text\n```c\nint x;\n```\n", example), "");
  EXPECT_NE(quoted_block("```c\n#include <a>\n\nint main() { }\n```\n", example), example);
  EXPECT_NE(quoted_block("```c\n#include <a>\n\nint main() {}\n\n```\n", example), example);
  EXPECT_NE(quoted_block("```c\n" + example, example), example);
}

}  // namespace example_test
}  // namespace palpate::test
