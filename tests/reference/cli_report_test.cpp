// `palpate report` as a user runs it.
#include <gtest/gtest.h>
#include <stdlib.h>

#include <algorithm>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/forged_pack.hpp"
#include "tests/support/nightly.hpp"
#include "tests/support/scene_files.hpp"

namespace palpate::test {
namespace cli_report_test {

ProgramRun report(const std::filesystem::path& organ, const std::filesystem::path& folder,
                  const std::vector<std::string>& more = {}) {
  std::vector<std::string> words = {"report", organ.string(), "-o", folder.string(), "--quick", "--json"};
  words.insert(words.end(), more.begin(), more.end());
  return run_program(words);
}

size_t count_of(const std::string& text, const std::string& what) {
  size_t count = 0;
  for (size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + what.size())) ++count;
  return count;
}

// The cells of a CSV, headings first. Quoted cells may hold commas.
std::vector<std::vector<std::string>> cells_of(const std::filesystem::path& csv) {
  std::vector<std::vector<std::string>> rows;
  std::istringstream stream(file_text(csv));
  for (std::string line; std::getline(stream, line);) {
    std::vector<std::string>& cells = rows.emplace_back(1);
    bool quoted = false;
    for (const char c : line) {
      if (c == '"') {
        quoted = !quoted;
      } else if (c == ',' && !quoted) {
        cells.emplace_back();
      } else {
        cells.back() += c;
      }
    }
  }
  return rows;
}

std::string cell(const std::vector<std::vector<std::string>>& rows, const std::vector<std::string>& row,
                 const std::string& heading) {
  const auto found = std::find(rows.front().begin(), rows.front().end(), heading);
  return found == rows.front().end() ? "no " + heading
                                     : row[static_cast<size_t>(found - rows.front().begin())];
}

// A model and a scene from outside the repository.
TEST(Report, AStrangersSceneGivesAWholePage) {
  const SceneFiles files(
      "[contact]\nsites = [19, 23, 27]\nmax_displacement = 0.03\nmax_contacts = 2\n"
      "[models]\nzone = true\nzone_rings = 2\n");
  const std::filesystem::path folder = files.dir.path() / "report";
  const ProgramRun run = report(files.scene, folder);
  ASSERT_EQ(run.exit_code, 0) << run.error << run.out;
  const nlohmann::json json = run.json();
  EXPECT_EQ(json["kept"], true);
  for (const char* model : {"linear_dd", "polynomial_dd", "nonlinear_zone"})
    EXPECT_EQ(json["organs"][0]["models"][model]["kept"], true) << model;
  const std::string page = file_text(folder / "index.html");
  EXPECT_NE(page.find("<b>Kept.</b>"), std::string::npos);
  // Speed against error: field and force of one contact, two contacts. Distribution, growth and coverage of errors. And
  // the error map.
  EXPECT_EQ(count_of(page, "data:image/svg+xml;base64,"), 6u);
  EXPECT_EQ(count_of(page, "data:image/png;base64,"), 1u);
  EXPECT_EQ(page.find("src=\"http"), std::string::npos);  // nothing from elsewhere
  EXPECT_EQ(count_of(page, "href=\"block_methods.csv\""), 3u);
  const std::string methods = file_text(folder / "block_methods.csv");
  for (const char* method :
       {"\"linear_dd\",1,", "\"linear_dd\",2,", "\"polynomial_dd, degree ", "\"nonlinear_zone, 1 ring\",1,",
        "\"nonlinear_zone, 1 ring\",2,", "\"nonlinear_zone, 2 rings\",1,", "\"nonlinear_zone, 2 rings\",2,",
        "\"full Newton, warm\",1,", "\"full Newton, warm\",2,"})
    EXPECT_NE(methods.find(method), std::string::npos) << method;
}

TEST(Report, ASecondRunGivesTheSameErrorsToTheDigit) {
  if (!is_nightly()) GTEST_SKIP() << "only in ./dev test --all";
  const SceneFiles files;
  ASSERT_EQ(files.build().exit_code, 0);
  const auto errors = [&](const std::string& name, const std::vector<std::string>& more) {
    const std::filesystem::path folder = files.dir.path() / name;
    EXPECT_EQ(report(files.pack, folder, more).exit_code, 0);
    std::string text = file_text(folder / "block_pushes.csv");
    const std::vector<std::vector<std::string>> rows = cells_of(folder / "block_methods.csv");
    for (const std::vector<std::string>& row : rows) {
      for (const char* column :
           {"method", "displacement_max", "displacement_off_p95", "force_median", "force_max"})
        text += cell(rows, row, column) + "\n";
    }
    return text;
  };
  const std::string first = errors("first", {"--jobs", "1"});
  EXPECT_GT(count_of(first, "\n"), 100u);
  EXPECT_EQ(errors("second", {"--jobs", "2"}), first);
  EXPECT_NE(errors("third", {"--seed", "2"}), first);
}

// A broken fit or kernel: forces 5 % too large.
TEST(Report, ABrokenFitTurnsItRed) {
  const SceneFiles files;
  ASSERT_EQ(files.build().exit_code, 0);
  forge_bytes(files.pack, [](const pack::Pack& tables, unsigned char* bytes) {
    const pack::Segment& energy = *tables.polynomial_dd()->energy();
    auto* numbers = reinterpret_cast<double*>(bytes + energy.offset());
    for (size_t i = 0; i < energy.bytes() / sizeof(double); ++i) numbers[i] *= 1.05;
  });
  const std::filesystem::path folder = files.dir.path() / "report";
  const ProgramRun run = report(files.pack, folder);
  EXPECT_EQ(run.exit_code, 2) << run.error;
  EXPECT_EQ(run.json()["kept"], false);
  EXPECT_EQ(run.json()["organs"][0]["models"]["polynomial_dd"]["kept"], false);
  EXPECT_EQ(run.json()["organs"][0]["models"]["linear_dd"]["kept"], true);
  EXPECT_NE(run.error.find("polynomial_dd"), std::string::npos) << run.error;
  EXPECT_NE(file_text(folder / "index.html").find("<b>Not kept.</b> block, polynomial_dd"),
            std::string::npos);
}

TEST(Report, AnOrganMayTurn) {
  const TempDir dir;
  const ProgramRun run = report(PALPATE_SOURCE_DIR "/tests/fuzz/corpus/scene/every_model.toml",
                                dir.path() / "report", {"--allow-outside"});
  EXPECT_EQ(run.exit_code, 0) << run.error;
}

TEST(Report, InputsLieElsewhere) {
  const SceneFiles files;
  const std::string scene = files.scene.string();
  const std::string folder = files.dir.path().string();
  EXPECT_EQ(refusal_of({"report", scene, "-o", folder}),
            scene + ": is an input in the folder of the results; name another folder with -o");
}

TEST(Report, NamesMissingPrograms) {
  const SceneFiles files;
  const std::string folder = (files.dir.path() / "report").string();
  EXPECT_EQ(refusal_of({"report", "/nowhere/organ.pack", "-o", folder}), "/nowhere/organ.pack: no such file");
  const std::string path = getenv("PATH");
  setenv("PATH", "/nowhere", 1);
  const std::string refusal = refusal_of({"report", files.scene.string(), "-o", folder});
  setenv("PATH", path.c_str(), 1);
  EXPECT_NE(refusal.find("gnuplot-nox"), std::string::npos) << refusal;
}

}  // namespace cli_report_test
}  // namespace palpate::test
