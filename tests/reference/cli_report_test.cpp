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
  // Speed against error for field and force, two for contacts, three distributions, coverage, frames; and the
  // error map.
  EXPECT_EQ(count_of(page, "data:image/svg+xml;base64,"), 8u);
  EXPECT_EQ(count_of(page, "data:image/png;base64,"), 1u);
  EXPECT_EQ(page.find("src=\"http"), std::string::npos);  // nothing from elsewhere
  EXPECT_EQ(count_of(page, "href=\"block_methods.csv\""), 4u);
  const std::string methods = file_text(folder / "block_methods.csv");
  for (const char* method :
       {"\"linear_dd\",1,1,", "\"polynomial_dd, degree 2, ", "\"nonlinear_zone, 1 ring\",1,1,",
        "\"nonlinear_zone, 2 rings\",1,1,", "\"nonlinear_zone, 1 ring\",1,2,",
        "\"nonlinear_zone, 1 ring, 1 iteration a frame\",0,1,",
        "\"nonlinear_zone, 1 ring, 4 iterations a frame\",0,2,", "\"linear, back-solve\",0,1,",
        "\"linear, PFE\",0,2,", "\"linear, LCG to 0.1\",0,1,", "\"full Newton, warm\",0,1,",
        "\"full Newton, warm\",0,2,", "\"linear_dd\",1,2,"})
    EXPECT_NE(methods.find(method), std::string::npos) << method;
}

// Back-solve and PFE by CHOLMOD, and LCG, share only the stiffness with linear_dd.
TEST(Report, LinearMethodsAreAsWrongAsEachOther) {
  const SceneFiles files;
  ASSERT_EQ(files.build().exit_code, 0);
  const std::filesystem::path folder = files.dir.path() / "report";
  ASSERT_EQ(report(files.pack, folder).exit_code, 0);
  const std::vector<std::vector<std::string>> rows = cells_of(folder / "block_methods.csv");
  constexpr double kRounding = 1e-6;      // rounding of fields in float32
  constexpr double kLcgTolerance = 1e-2;  // ten times the tolerance of the residual
  int compared = 0;
  for (const std::vector<std::string>& linear : rows) {
    if (cell(rows, linear, "method") != "linear_dd" || cell(rows, linear, "contacts") != "1") continue;
    for (const std::vector<std::string>& other : rows) {
      const std::string name = cell(rows, other, "method");
      const bool is_lcg = name == "linear, LCG to 0.001";
      if ((name != "linear, back-solve" && name != "linear, PFE" && !is_lcg) ||
          cell(rows, other, "contacts") != "1" ||
          cell(rows, other, "part_of_max") != cell(rows, linear, "part_of_max"))
        continue;
      ++compared;
      for (const char* error : {"displacement_p95", "displacement_max", "force_p95", "force_max"}) {
        const double expected = std::stod(cell(rows, linear, error));
        EXPECT_GT(expected, 1e-3) << error;
        EXPECT_NEAR(std::stod(cell(rows, other, error)), expected, is_lcg ? kLcgTolerance : kRounding)
            << name << ", " << error;
      }
    }
  }
  EXPECT_EQ(compared, 3 * 4);
}

// Nine sites in a square: each compared site has others at one and at two edges.
TEST(Report, PolynomialsAreMovedFromSitesNearby) {
  const SceneFiles files(
      "[contact]\nsites = [19, 20, 21, 22, 23, 24, 25, 26, 27]\nmax_displacement = 0.03\n[models]\nzone = "
      "false\n");
  ASSERT_EQ(files.build().exit_code, 0);
  const std::filesystem::path folder = files.dir.path() / "report";
  ASSERT_EQ(report(files.pack, folder).exit_code, 0);
  const std::vector<std::vector<std::string>> rows = cells_of(folder / "block_methods.csv");
  const auto error_of = [&](const std::string& method, const char* part,
                            const char* error = "displacement_median") {
    for (const std::vector<std::string>& row : rows) {
      if (cell(rows, row, "method") == method && cell(rows, row, "part_of_max") == part)
        return std::stod(cell(rows, row, error));
    }
    ADD_FAILURE() << method;
    return 0.0;
  };
  for (const char* way : {"eq. (25) as printed", "eq. (25) inverse", "affine about the site", "rigid",
                          "exact linear part, remainder rigid"}) {
    for (const char* away : {", from 1 edge", ", from 2 edges"})
      EXPECT_GT(error_of(std::string("moved polynomial, ") + way + away, "0.25"), 0);
  }
  // Relative to the push, the nonlinear part of the error halves with the push.
  const char* exact = "moved polynomial, exact linear part, remainder rigid, from 1 edge";
  const char* moved = "moved polynomial, rigid, from 1 edge";
  for (const char* error : {"displacement_median", "force_median"}) {
    EXPECT_LT(error_of(exact, "0.25", error), 0.2 * error_of(moved, "0.25", error)) << error;
    EXPECT_LT(error_of(exact, "0.25", error), error_of("linear_dd", "0.25", error)) << error;
    EXPECT_NEAR(error_of(exact, "0.25", error) / error_of(exact, "0.5", error), 0.5, 0.1) << error;
  }
}

TEST(Report, ShowsTablesAndMethodsOfOthers) {
  const SceneFiles files;
  ASSERT_EQ(files.build().exit_code, 0);
  const std::filesystem::path table =
      files.dir.write("hard.csv", "case,error %\n\"thin, soft\",0.5\n\"says \"\"no\"\"\",2\n");
  files.dir.write("hard.txt", "What is hard < for it.");
  files.dir.write("hard_more.csv", "x\n1\n");
  files.dir.write("hard.svg", "<svg xmlns=\"http://www.w3.org/2000/svg\"/>");
  const std::filesystem::path csv = files.dir.write(
      "peer.csv",
      "method,contacts,part_of_max,pushes,diverged,displacement_p95,displacement_max,force_p95,force_max,"
      "haptic_median_us,haptic_p999_us,haptic_max_us\n"
      "peer,1,1,8,0,0.0712,0.08,0.1,0.2,86000,99000,99900\n"
      "\"peer, far\",1,0.5,8,3,1,1,1,1,86000,99000,99900\n"
      "peer,1,0.3,8,0,0.07,0.08,0.1,0.2,86000,99000,99900\n");
  files.dir.write("peer.txt", "A peer < ours.");
  const std::filesystem::path folder = files.dir.path() / "report";
  const ProgramRun run = report(
      files.pack, folder, {"--table", "Hard cases=" + table.string(), "--methods", "block=" + csv.string()});
  ASSERT_EQ(run.exit_code, 0) << run.error;
  const std::string page = file_text(folder / "index.html");
  for (const char* part :
       {"<h2>Hard cases</h2>", "<th>error %</th>", "<td>thin, soft</td>", "says &quot;no&quot;",
        "What is hard &lt; for it.", "href=\"hard_more.csv\"", "href=\"#hard\"", "alt=\"Hard cases\"",
        "<td>peer</td>", "<td>7.12</td>", "<td>8.6e+04</td>", "A peer &lt; ours.",
        "peer, far; 3 of 8 DIVERGED", "peer with 1 contact at 0.3 of the largest |d| is left out"})
    EXPECT_NE(page.find(part), std::string::npos) << part;
  EXPECT_EQ(file_text(folder / "hard.csv"), file_text(table));
  EXPECT_NE(file_text(folder / "plots" / "block_speed_error.gp").find("86000"), std::string::npos);
  EXPECT_NE(file_text(folder / "block_methods.csv").find("\"peer, far\",0,1,0.5,"), std::string::npos);
  const std::string to = (files.dir.path() / "other").string();
  EXPECT_EQ(refusal_of({"report", files.pack.string(), "-o", to, "--table", "hard.csv"}),
            "--table hard.csv: not TITLE=FILE.csv");
  files.dir.write("bad.csv", "a,b\n1,2\n3\n");
  const std::string bad = (files.dir.path() / "bad.csv").string();
  EXPECT_EQ(refusal_of({"report", files.pack.string(), "-o", to, "--table", "Bad=" + bad}),
            bad + ":3: 1 cells, where the first line has 2 headings");
  EXPECT_EQ(refusal_of({"report", files.pack.string(), "-o", to, "--methods", csv.string()}),
            "--methods " + csv.string() + ": not ORGAN=FILE.csv");
  EXPECT_EQ(refusal_of({"report", files.pack.string(), "-o", to, "--methods", "brain=" + csv.string()}),
            "--methods brain=" + csv.string() + ": this report has no such organ, but block");
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

// Packs of other settings lack linear_dd, which answers turns of gravity.
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
  const std::string table = files.dir.write("report/about.csv", "a\n1\n").string();
  EXPECT_EQ(refusal_of({"report", scene, "-o", folder + "/report", "--table", "About=" + table}),
            table + ": is an input in the folder of the results; name another folder with -o");
  EXPECT_EQ(file_text(table), "a\n1\n");
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
