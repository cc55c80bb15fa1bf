// `palpate solve` of a model with *STATIC, RIKS as a user runs it: path.csv, its nodes, its ends.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <sstream>

#include "tests/support/arch_rod.hpp"
#include "tests/support/nodal_csv.hpp"
#include "tests/support/run_program.hpp"

namespace palpate::test {
namespace cli_riks_test {

// St. Venant-Kirchhoff, mu = lambda = 1. A force -F along z pushes the fourth corner of a tetrahedron, which
// only moves along z. With the stretch s = 1 + u, F = 3 s (s^2 - 1) / 2 / 6, with its minimum at s = 1 /
// sqrt(3).
const std::string kTetrahedron =
    "*NODE, NSET=ALL\n1, 0, 0, 0\n2, 1, 0, 0\n3, 0, 1, 0\n44, 0, 0, 1\n*ELEMENT, TYPE=C3D4, ELSET=E\n9, 1, "
    "2, 3, "
    "44\n*NSET, NSET=TWO\n44, 2\n*MATERIAL, NAME=M\n*ELASTIC\n2.5, 0.25\n*SOLID SECTION, ELSET=E, "
    "MATERIAL=M\n"
    "*BOUNDARY\n1, 1, 3\n2, 1, 3\n3, 1, 3\n44, 1, 2\n";
constexpr double kForce = 0.1;

double factor_at(double u) {
  const double s = 1 + u;
  return -0.25 * s * (s * s - 1) / kForce;
}
const double kLimit = factor_at(1 / std::sqrt(3.0) - 1);

using PathRows = std::vector<std::map<std::string, double>>;

class SolveRiks : public ::testing::Test {
 protected:
  ProgramRun solve(const std::string& text, const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments = {"solve", dir_.write("model.inp", kTetrahedron + text).string(),
                                          "-o", folder().string()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_program(arguments);
  }
  std::filesystem::path folder() const { return dir_.path() / "results"; }
  nlohmann::json step() const {
    return nlohmann::json::parse(file_text(folder() / "summary.json"))["steps"].back();
  }
  PathRows path() const {
    std::istringstream text(file_text(folder() / "path.csv"));
    std::vector<std::string> names;
    PathRows rows;
    for (std::string line; std::getline(text, line);) {
      std::istringstream fields(line);
      if (!names.empty()) rows.emplace_back();
      size_t column = 0;
      for (std::string field; std::getline(fields, field, ',');) {
        if (rows.empty()) {
          names.push_back(field);
        } else {
          rows.back()[names.at(column++)] = std::stod(field);
        }
      }
    }
    return rows;
  }

  TempDir dir_;
};

std::string riks(const std::string& data_line, const std::string& more = "", const std::string& step = "") {
  return "*STEP, NLGEOM" + step + "\n*STATIC, RIKS\n" + data_line + "*CLOAD\n44, 3, -0.1\n" + more +
         "*END STEP\n";
}

TEST_F(SolveRiks, FollowsThePathPastItsLimit) {
  const ProgramRun run = solve(riks("0.1, 1, , , , 44, 3, -0.8\n"));
  ASSERT_EQ(run.exit_code, 0) << run.error;
  EXPECT_EQ(run.error, "");
  EXPECT_EQ(names_in(folder()),
            (std::vector<std::string>{"path.csv", "result.vtu", "step1.csv", "summary.json"}));
  EXPECT_TRUE(
      file_text(folder() / "path.csv")
          .starts_with("increment,arc_length,load_factor,current_stiffness,negative_pivots,min_J,ux_44,"
                       "uy_44,uz_44\n0,0,0,1,0,1,0,0,0\n"));
  const PathRows rows = path();
  ASSERT_GE(rows.size(), 6U);
  for (const auto& row : rows) {
    const double u = row.at("uz_44");
    EXPECT_NEAR(row.at("load_factor"), factor_at(u), 1e-9);
    EXPECT_EQ(row.at("negative_pivots"), u < 1 / std::sqrt(3.0) - 1 ? 1 : 0);
    // dF/du over its value at rest: (3 s^2 - 1) / 2
    EXPECT_NEAR(row.at("current_stiffness"), 0.5 * (3 * (1 + u) * (1 + u) - 1), 1e-9);
    EXPECT_NEAR(row.at("min_J"), 1 + u, 1e-9);
    EXPECT_EQ(row.at("ux_44"), 0);
  }
  EXPECT_NEAR(rows.back().at("uz_44"), -0.8, 1e-12);
  const CsvRow end = row_of(read_csv(folder() / "step1.csv"), 44);
  EXPECT_NEAR(end.u[2], -0.8, 1e-12);
  EXPECT_NEAR(end.f[2], -kForce * factor_at(-0.8), 1e-9);
  EXPECT_EQ(step()["converged"], true);
  EXPECT_EQ(step()["positive_definite"], false);
  EXPECT_NEAR(step()["load_factor"].get<double>(), factor_at(-0.8), 1e-9);
  ASSERT_EQ(step()["limit_load_factors"].size(), 1U);
  EXPECT_NEAR(step()["limit_load_factors"][0].get<double>(), kLimit, 0.02 * kLimit);
  EXPECT_NE(run.out.find("step 1: the load factor ends at 0.48, with limit points at 0.9"), std::string::npos)
      << run.out;
  EXPECT_NE(run.out.find("unstable"), std::string::npos) << run.out;
}

// With one unknown v / v0 = 1 / S. The arc length is dl_1 sqrt|S| sqrt((1 + 1 / S^2) / 2), at most half as
// much again as the last. The limit is inactive where S changed by less than a tenth.
TEST_F(SolveRiks, BergansProcedureSizesIncrementsByTheCurrentStiffness) {
  const ProgramRun run = solve(riks("0.1, 1, , , , 44, 3, -0.8\n"), {"--stepping", "current-stiffness"});
  ASSERT_EQ(run.exit_code, 0) << run.error;
  EXPECT_EQ(run.error, "");
  const PathRows rows = path();
  ASSERT_GE(rows.size(), 6U);
  double last = 0.1;
  int by_stiffness = 0;
  for (size_t i = 1; i < rows.size(); ++i) {
    EXPECT_NEAR(rows[i].at("load_factor"), factor_at(rows[i].at("uz_44")), 1e-9);
    EXPECT_LT(rows[i].at("uz_44"), rows[i - 1].at("uz_44"));
    const double S = rows[i - 1].at("current_stiffness");
    const double wanted = 0.1 * std::sqrt(std::abs(S) * (1 + 1 / (S * S)) / 2);
    const double length = rows[i].at("arc_length") - rows[i - 1].at("arc_length");
    const bool steady = i > 1 && std::abs(S - rows[i - 2].at("current_stiffness")) < 0.1 * std::abs(S);
    by_stiffness += !steady && wanted < 1.5 * last ? 1 : 0;
    if (i + 1 < rows.size()) {
      EXPECT_NEAR(length, steady ? 1.5 * last : std::min(wanted, 1.5 * last), 1e-9);
    }
    last = length;
  }
  EXPECT_GE(by_stiffness, 5) << "else this test shows nothing";
  EXPECT_LT(rows.back().at("current_stiffness"), 0);
  EXPECT_NEAR(rows.back().at("uz_44"), -0.8, 1e-12);
  ASSERT_EQ(step()["limit_load_factors"].size(), 1U);
  EXPECT_NEAR(step()["limit_load_factors"][0].get<double>(), kLimit, 0.02 * kLimit);
  EXPECT_EQ(nlohmann::json::parse(file_text(folder() / "summary.json"))["stepping"], "current-stiffness");
}

// The tetrahedron pushed through another, 30 long and softer than the first one's falling branch: its upper
// end snaps back while the corner goes on.
TEST_F(SolveRiks, ASnapBackIsSaidByBergansProcedureAndPassedByArcLength) {
  const std::string column =
      "*NODE, NSET=TOP\n51, 1, 0, 31\n52, -0.5, 0.866, 31\n53, -0.5, -0.866, 31\n*ELEMENT, TYPE=C3D4, "
      "ELSET=E\n10, 44, 51, 52, 53\n*BOUNDARY\nTOP, 1, 2\n*STEP, NLGEOM\n*STATIC, RIKS\n0.05, 1, , , , "
      "44, 3, -0.8\n*CLOAD\nTOP, 3, -0.0333333\n*NODE PRINT, NSET=TWO\nU\n*NODE PRINT, "
      "NSET=TOP\nU\n*END STEP\n";
  const ProgramRun run = solve(column, {"--stepping", "current-stiffness"});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_NE(run.error.find("the body snaps back there"), std::string::npos) << run.error;
  EXPECT_NE(run.error.find("solve with --stepping arc-length"), std::string::npos) << run.error;
  EXPECT_EQ(names_in(folder()),
            (std::vector<std::string>{"partial.csv", "path.csv", "result.vtu", "summary.json"}));
  PathRows rows = path();
  ASSERT_GE(rows.size(), 4U);
  EXPECT_LE(rows.size(), 40U);
  for (size_t i = 1; i < rows.size(); ++i) {
    EXPECT_NEAR(rows[i].at("load_factor"), factor_at(rows[i].at("uz_44")), 1e-5) << "1 over 0.0999999";
    EXPECT_LT(rows[i].at("uz_44"), rows[i - 1].at("uz_44"));
  }
  EXPECT_LT(rows.back().at("load_factor"), rows[rows.size() - 2].at("load_factor"));
  EXPECT_NEAR(row_of(read_csv(folder() / "partial.csv"), 44).u[2], rows.back().at("uz_44"), 1e-11);
  EXPECT_EQ(step()["converged"], false);
  EXPECT_NEAR(step()["load_factor"].get<double>(), rows.back().at("load_factor"), 1e-11);

  ASSERT_EQ(solve(column, {"--stepping", "arc-length"}).exit_code, 0);
  rows = path();
  EXPECT_NEAR(rows.back().at("uz_44"), -0.8, 1e-12);
  bool comes_back = false;
  for (size_t i = 1; i < rows.size(); ++i) {
    EXPECT_NEAR(rows[i].at("load_factor"), factor_at(rows[i].at("uz_44")), 1e-5);
    comes_back = comes_back || rows[i].at("uz_51") > rows[i - 1].at("uz_51") + 0.1;
  }
  EXPECT_TRUE(comes_back) << "else this test shows nothing";
}

TEST_F(SolveRiks, SteppingIsRefusedWhereItMeansNothing) {
  const std::string without = "*STEP, NLGEOM\n*STATIC\n*CLOAD\n44, 3, -0.05\n*END STEP\n";
  for (const char* stepping : {"arc-length", "current-stiffness"}) {
    const ProgramRun run = solve(without, {"--stepping", stepping});
    EXPECT_EQ(run.exit_code, 1);
    EXPECT_NE(run.error.find("model.inp:19: --stepping is for *STATIC, RIKS"), std::string::npos)
        << run.error;
  }
  const ProgramRun moved =
      solve("*STEP, NLGEOM\n*STATIC, RIKS\n0.25, 1, , , 1\n*BOUNDARY\n44, 3, 3, -0.5\n*END STEP\n",
            {"--stepping", "current-stiffness"});
  EXPECT_EQ(moved.exit_code, 1);
  EXPECT_NE(moved.error.find("model.inp:19: --stepping current-stiffness is for steps that change loads"),
            std::string::npos)
      << moved.error;
  const ProgramRun other = solve(riks("0.1\n"), {"--stepping", "bergan"});
  EXPECT_EQ(other.exit_code, 1);
  EXPECT_NE(other.error.find("--stepping"), std::string::npos) << other.error;
}

TEST_F(SolveRiks, EndsAtTheLoadFactor) {
  ASSERT_EQ(solve(riks("0.1, 1, , , 0.75\n")).exit_code, 0);
  EXPECT_EQ(path().back().at("load_factor"), 0.75);
  EXPECT_EQ(step()["load_factor"], 0.75);
  EXPECT_EQ(step()["positive_definite"], true);
  // The data line's lengths are fractions of its total.
  const PathRows rows = path();
  ASSERT_EQ(solve(riks("10, 100, , , 0.75\n")).exit_code, 0);
  EXPECT_EQ(path(), rows);
  // INC alone ends the path.
  ASSERT_EQ(solve(riks("0.1\n", "", ", INC=3")).exit_code, 0);
  EXPECT_EQ(path().size(), 4U);
}

// The first increment would press the corner through the opposite face into the mirror image, where forces
// are finite, too.
TEST_F(SolveRiks, NoStateIsInverted) {
  ASSERT_EQ(solve("*STEP, NLGEOM\n*STATIC, RIKS\n1, 1, , , , 44, 3, -0.9\n*CLOAD\n44, 3, -1.0\n*END STEP\n")
                .exit_code,
            0);
  EXPECT_GE(step()["cutbacks"].get<int>(), 1) << "else this test shows nothing";
  for (const auto& row : path()) {
    EXPECT_GT(row.at("min_J"), 0);
    EXPECT_NEAR(10 * row.at("load_factor"), factor_at(row.at("uz_44")), 1e-9);
  }
}

TEST_F(SolveRiks, WatchesTheNodesOfTheRequest) {
  const ProgramRun run = solve(riks("0.1, 1, , , 0.5\n", "*NODE PRINT, NSET=TWO\nU\n"));
  ASSERT_EQ(run.exit_code, 0);
  EXPECT_EQ(run.error, "");
  EXPECT_TRUE(path().front().contains("uz_2"));
  EXPECT_TRUE(path().front().contains("uz_44"));
  EXPECT_EQ(path().front().size(), 12U);
  const ProgramRun all = solve(riks("0.1, 1, , , 0.5\n", "*NODE FILE\nU\n"));
  ASSERT_EQ(all.exit_code, 0);
  EXPECT_NE(all.error.find("*NODE FILE is passed over"), std::string::npos) << all.error;
  EXPECT_EQ(path().front().size(), 9U) << "the node that moves furthest";
  EXPECT_TRUE(path().front().contains("uz_44"));
  const ProgramRun forces = solve(riks("0.1, 1, , , 0.5\n", "*NODE PRINT, NSET=TWO\nU, RF\n"));
  EXPECT_NE(forces.error.find("RF is passed over: path.csv has displacements"), std::string::npos)
      << forces.error;
}

TEST_F(SolveRiks, FailureLeavesThePathSoFar) {
  const ProgramRun run = solve(riks("0.1, 1, , , 5\n", "", ", INC=6"));
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_EQ(names_in(folder()),
            (std::vector<std::string>{"partial.csv", "path.csv", "result.vtu", "summary.json"}));
  EXPECT_EQ(path().size(), 7U);
  EXPECT_NE(run.error.find("INC of *STEP is reached"), std::string::npos) << run.error;
  EXPECT_NEAR(row_of(read_csv(folder() / "partial.csv"), 44).u[2], path().back().at("uz_44"), 1e-11);

  ASSERT_EQ(solve("*STEP, NLGEOM\n*STATIC\n*CLOAD\n44, 3, -0.05\n*END STEP\n").exit_code, 0);
  EXPECT_FALSE(std::filesystem::exists(folder() / "path.csv")) << "of another run";
}

// The first step's dead load stays: the path is the same, counted from there.
TEST_F(SolveRiks, GoesOnFromAnEarlierStep) {
  ASSERT_EQ(
      solve("*STEP, NLGEOM\n*STATIC\n*CLOAD\n44, 3, -0.05\n*END STEP\n" + riks("0.1, 1, , , , 44, 3, -0.7\n"))
          .exit_code,
      0);
  // The second step replaces -0.05 by -0.1: half of the load grows.
  for (const auto& row : path())
    EXPECT_NEAR(0.5 + 0.5 * row.at("load_factor"), factor_at(row.at("uz_44")), 1e-9);
  EXPECT_TRUE(std::filesystem::exists(folder() / "step1.csv"));
  EXPECT_TRUE(std::filesystem::exists(folder() / "step2.csv"));
}

// Young's modulus 1000; half the load 0.1 at factor 1.
TEST_F(SolveRiks, TheShippedArchSnapsAsARod) {
  const Arch arch;
  const double rise = arch.radius * (1 - std::cos(arch.half_angle));
  ArchRod rod(arch);
  std::vector<double> factors;
  for (int i = 0; i <= 1500; ++i) factors.push_back(1000 / 0.1 * rod.force(1e-3 * i * rise));
  const double upper = *std::max_element(factors.begin(), factors.begin() + 1000);
  const double lower = *std::min_element(factors.begin() + 700, factors.end());
  run_cleanly({"solve", PALPATE_SOURCE_DIR "/models/arch/arch_snap.inp", "-o", folder().string()});
  ASSERT_EQ(step()["limit_load_factors"].size(), 2U);
  EXPECT_NEAR(step()["limit_load_factors"][0].get<double>(), upper, 0.01 * upper);
  EXPECT_NEAR(step()["limit_load_factors"][1].get<double>(), lower, 0.01 * upper);
  const PathRows rows = path();
  for (const auto& row : rows) {
    const double w = -row.at("uz_362");
    const double expected = factors[static_cast<size_t>(std::clamp(1000 * w / rise, 0.0, 1500.0))];
    if (w > 1.3 * rise) break;  // stretched beyond the rod's range
    EXPECT_NEAR(row.at("load_factor"), expected, 0.01 * upper);
  }
  EXPECT_NEAR(rows.back().at("uz_362"), -1.6, 1e-12);
}

TEST_F(SolveRiks, ASolveAtGivenLoadsNamesTheWayOut) {
  const ProgramRun run = solve("*STEP, NLGEOM\n*STATIC\n0.1, 1\n*CLOAD\n44, 3, -0.3\n*END STEP\n");
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_NE(run.error.find("limit point"), std::string::npos) << run.error;
  EXPECT_NE(run.error.find("*STATIC, RIKS"), std::string::npos) << run.error;
  EXPECT_NEAR(3 * step()["load_factor"].get<double>(), kLimit, 1e-3 * kLimit);
}

TEST_F(SolveRiks, AStepThatChangesNothingIsRefused) {
  const ProgramRun run = solve("*STEP, NLGEOM\n*STATIC, RIKS\n*CLOAD\n44, 3, 0\n*END STEP\n");
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_NE(run.error.find("model.inp:19: *STATIC, RIKS has no path to follow"), std::string::npos)
      << run.error;
}

TEST_F(SolveRiks, ABodyHeldEverywhereIsMovedByTheFactor) {
  const ProgramRun run =
      solve("*STEP, NLGEOM\n*STATIC, RIKS\n0.25, 1, , , 1\n*BOUNDARY\n44, 3, 3, -0.5\n*END STEP\n");
  ASSERT_EQ(run.exit_code, 0) << run.error;
  for (const auto& row : path()) EXPECT_NEAR(row.at("uz_44"), -0.5 * row.at("load_factor"), 1e-12);
  EXPECT_EQ(path().back().at("load_factor"), 1);
}

TEST_F(SolveRiks, ConjugateGradientsAreRefused) {
  const ProgramRun run = solve(riks("0.1\n"), {"--solver", "cg"});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_NE(run.error.find("model.inp:19: *STATIC, RIKS needs a factor"), std::string::npos) << run.error;
}

}  // namespace cli_riks_test
}  // namespace palpate::test
