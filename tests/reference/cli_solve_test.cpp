// `palpate solve` as a user runs it: its files, their numbers, and the results of a failed solve.
#include <gtest/gtest.h>

#include <cmath>

#include "offline/mesh/inp_reader.hpp"
#include "offline/mesh/model_check.hpp"
#include "tests/support/block_mesh.hpp"
#include "tests/support/nodal_csv.hpp"
#include "tests/support/run_program.hpp"

namespace palpate::test {
namespace cli_solve_test {

const std::string kCylinder = PALPATE_SOURCE_DIR "/models/cylinder/cylinder.inp";
const std::string kCylinderPush = PALPATE_SOURCE_DIR "/models/cylinder/cylinder_push.inp";

std::string step(const std::string& loads, const std::string& options = "") {
  return "*STEP, NLGEOM=YES" + options + "\n*STATIC\n" + loads + "*END STEP\n";
}

size_t significant_digits(const std::string& number) {
  const std::string mantissa = number.substr(0, number.find('e'));
  const size_t first = mantissa.find_first_of("123456789");
  if (first == std::string::npos) return 0;
  return static_cast<size_t>(std::count_if(mantissa.begin() + static_cast<std::ptrdiff_t>(first),
                                           mantissa.end(), [](char c) { return c != '.'; }));
}

// Both linear solvers agree on a whole model, and the summary names the solver.
TEST(SolveCylinder, BothSolversAgree) {
  const TempDir dir;
  std::vector<std::vector<CsvRow>> rows;
  for (const std::string solver : {"cholesky", "cg"}) {
    const std::string folder = (dir.path() / solver).string();
    const nlohmann::json summary =
        run_cleanly({"solve", kCylinderPush, "-o", folder, "--solver", solver, "--json"}).json();
    EXPECT_EQ(summary["solver"], solver);
    rows.push_back(read_csv(dir.path() / solver / "step1.csv"));
  }
  ASSERT_EQ(rows[0].size(), rows[1].size());
  for (size_t i = 0; i < rows[0].size(); ++i) {
    for (size_t axis = 0; axis < 3; ++axis) EXPECT_NEAR(rows[0][i].u[axis], rows[1][i].u[axis], 1e-7);
  }
  const std::string refusal =
      refusal_of({"solve", kCylinderPush, "-o", dir.path().string(), "--solver", "lu"});
  EXPECT_NE(refusal.find("--solver"), std::string::npos) << refusal;
}

class Solve : public ::testing::Test {
 protected:
  ProgramRun solve(const std::string& text, const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments = {"solve", "--allow-outside", dir_.write("model.inp", text).string(),
                                          "-o", folder().string()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_program(arguments);
  }
  std::filesystem::path folder() const { return dir_.path() / "results"; }
  nlohmann::json summary() const { return nlohmann::json::parse(file_text(folder() / "summary.json")); }

  TempDir dir_;
};

// A tetrahedron with corners at the origin and on the axes, stretched by its fourth corner: F = I + d e3^T, J
// = 1 + d3. Eq. (1), P = mu (F - F^-T) + lambda J (J-1) F^-T, has W = mu/2 (F:F - 3 - 2 ln J) + lambda/2
// (J-1)^2. The force at the corner is dW/dd / 6 (the volume).
TEST_F(Solve, OneTetrahedronAnswersAsItsLawSays) {
  constexpr double kMu = 0.48;
  constexpr double kLambda = 0.2;
  const std::array<double, 3> d = {0.11, -0.07, -0.3};
  const ProgramRun run = solve(
      "*NODE\n30, 0, 0, 0\n7, 1, 0, 0\n1001, 0, 1, 0\n5, 0, 0, 1\n*ELEMENT, TYPE=C3D4, ELSET=E\n9, 30, 7, "
      "1001, 5\n*MATERIAL, NAME=M\n*HYPERELASTIC, COMPRESSIBLE NEO HOOKE\n0.48, 0.2\n*SOLID SECTION, "
      "ELSET=E, MATERIAL=M\n*BOUNDARY\n30, 1, 3\n7, 1, 3\n1001, 1, 3\n" +
      step("*BOUNDARY\n5, 1, 1, 0.11\n5, 2, 2, -0.07\n5, 3, 3, -0.3\n"));
  ASSERT_EQ(run.exit_code, 0) << run.error;
  const std::vector<CsvRow> rows = read_csv(folder() / "step1.csv");
  ASSERT_EQ(rows.size(), 4u);
  const CsvRow& pulled = row_of(rows, 5);
  const double jacobian = 1 + d[2];
  const std::array<double, 3> force = {kMu * d[0] / 6, kMu * d[1] / 6,
                                       (kMu * (jacobian - 1 / jacobian) + kLambda * (jacobian - 1)) / 6};
  for (size_t axis = 0; axis < 3; ++axis) {
    EXPECT_EQ(pulled.u[axis], d[axis]);
    EXPECT_NEAR(pulled.f[axis], force[axis], 1e-12);
  }
  EXPECT_NEAR(summary()["steps"][0]["min_J"].get<double>(), jacobian, 1e-12);
}

TEST_F(Solve, WritesATableOfTheCylinderInEquilibrium) {
  run_cleanly({"solve", kCylinderPush, "-o", folder().string()});
  EXPECT_EQ(names_in(folder()), (std::vector<std::string>{"result.vtu", "step1.csv", "summary.json"}));
  const std::vector<CsvRow> rows = read_csv(folder() / "step1.csv");
  ASSERT_EQ(rows.size(), 195u);
  std::array<double, 3> total{};
  constexpr double kLoad = 8;
  constexpr double kBalance = 1e-9 * kLoad;  // the solver's tolerance, and the rounding to 12 digits
  size_t most_digits = 0;
  for (const CsvRow& row : rows) {
    for (size_t axis = 0; axis < 3; ++axis) {
      total[axis] += row.f[axis];
      most_digits = std::max(most_digits, significant_digits(row.fields[4 + axis]));
    }
    const double size = std::hypot(row.f[0], row.f[1], row.f[2]);
    const bool held = row.x[2] == 0;
    if (row.node == 6) {
      EXPECT_NEAR(row.f[2], -kLoad, kBalance);
      EXPECT_LT(row.u[2], -0.5);
    } else if (!held) {
      EXPECT_LT(size, kBalance) << row.node;
    } else {
      EXPECT_EQ(row.fields[4] + row.fields[5] + row.fields[6], "000") << row.node;
    }
  }
  EXPECT_EQ(most_digits, 12u);
  for (const double component : total) EXPECT_NEAR(component, 0, kBalance);
}

TEST_F(Solve, KeepsTheLabelsAndDigitsOfTheModel) {
  const ProgramRun run = solve(
      "*NODE\n1001, 0, 0, 0\n5, 0.123456789012, 0, 0\n70, 0, 1, 0\n6, 0, 0, 1\n*ELEMENT, TYPE=C3D4, "
      "ELSET=E\n5000, 1001, 5, 70, 6\n*MATERIAL, NAME=M\n*HYPERELASTIC, COMPRESSIBLE NEO HOOKE\n1, 1\n*SOLID "
      "SECTION, ELSET=E, MATERIAL=M\n*BOUNDARY\n1001, 1, 3\n5, 1, 3\n70, 1, 3\n" +
      step("*CLOAD\n6, 3, 0.001\n"));
  ASSERT_EQ(run.exit_code, 0) << run.error;
  std::vector<int> labels;
  const std::vector<CsvRow> rows = read_csv(folder() / "step1.csv");
  labels.reserve(rows.size());
  for (const CsvRow& row : rows) labels.push_back(row.node);
  EXPECT_EQ(labels, (std::vector<int>{1001, 5, 70, 6}));
  EXPECT_EQ(row_of(rows, 5).fields[1], "0.123456789012");
}

TEST_F(Solve, SummaryTellsEachStep) {
  const ProgramRun run = solve("*INCLUDE, INPUT=" + kCylinder + "\n" + step("*CLOAD\nP1, 3, -4\n") +
                               step("*CLOAD\nP1, 3, -8\n"));
  ASSERT_EQ(run.exit_code, 0) << run.error;
  const nlohmann::json steps = summary()["steps"];
  ASSERT_EQ(steps.size(), 2u);
  for (const nlohmann::json& one : steps) {
    EXPECT_EQ(one["converged"], true);
    EXPECT_EQ(one["load_factor"], 1.0);
    EXPECT_GE(one["increments"].get<int>(), 1);
    EXPECT_GE(one["iterations"].get<int>(), 1);
    EXPECT_LT(one["residual"].get<double>(), 1e-8);
    EXPECT_GT(one["min_J"].get<double>(), 0);
    EXPECT_LT(one["min_J"].get<double>(), 1);
    EXPECT_GE(one["seconds"].get<double>(), 0);
    EXPECT_EQ(one["positive_definite"], true);
  }
  EXPECT_GT(summary()["seconds"]["factor"].get<double>(), 0);
  EXPECT_GT(summary()["peak_memory_bytes"].get<double>(), 1e6);
}

// St. Venant-Kirchhoff, mu = lambda = 1: the fourth corner of a tetrahedron pushed in by 0.6, free sideways.
// By symmetry the corner may stay centred. d2W/dd1^2 = ((2 mu + lambda) E33 + mu) / 6 = (3 (0.16 - 1)/2 + 1)
// / 6 < 0, so this equilibrium is unstable.
TEST_F(Solve, AnUnstableEquilibriumIsSaid) {
  const std::string tetrahedron =
      "*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n3, 0, 1, 0\n4, 0, 0, 1\n*ELEMENT, TYPE=C3D4, ELSET=E\n9, 1, 2, 3, 4\n"
      "*MATERIAL, NAME=M\n*ELASTIC\n2.5, 0.25\n*SOLID SECTION, ELSET=E, MATERIAL=M\n*BOUNDARY\n1, 1, 3\n2, "
      "1, "
      "3\n3, 1, 3\n";
  for (const char* solver : {"cholesky", "cg"}) {
    const ProgramRun run = solve(tetrahedron + step("*BOUNDARY\n4, 3, 3, -0.6\n"), {"--solver", solver});
    ASSERT_EQ(run.exit_code, 0) << run.error;
    const nlohmann::json one = summary()["steps"][0];
    if (std::string(solver) == "cholesky") {
      EXPECT_EQ(one["positive_definite"], false);
      EXPECT_NE(run.out.find("step 1: this equilibrium is unstable"), std::string::npos) << run.out;
    } else {
      EXPECT_TRUE(one["positive_definite"].is_null()) << "conjugate gradients do not tell";
    }
    EXPECT_EQ(row_of(read_csv(folder() / "step1.csv"), 4).u, (std::array<double, 3>{0, 0, -0.6}));
  }
}

// The supports' reactions carry all weight but the share of their own nodes, a quarter of each tetrahedron a
// corner.
TEST_F(Solve, SupportsCarryTheWeight) {
  std::string block = block_inp(2);
  block.insert(block.find("*HYPERELASTIC"), "*DENSITY\n3\n");
  const ProgramRun run = solve(block + step("*DLOAD\nE, GRAV, 0.5, 0, 0, -1\n"));
  ASSERT_EQ(run.exit_code, 0) << run.error;
  double carried = 0;
  for (const CsvRow& row : read_csv(folder() / "step1.csv")) {
    if (row.node <= 9) carried += row.f[2];
  }
  double hanging = 0;
  const Model model = read_inp(dir_.path() / "model.inp", "/");
  for (const Tetrahedron& element : model.elements) {
    for (const int node : element.corners()) {
      if (model.labels[static_cast<size_t>(node)] > 9) hanging += 3 * 0.5 * signed_volume(model, element) / 4;
    }
  }
  EXPECT_NEAR(carried, hanging, 1e-9 * hanging) << "converged to 1e-10";
}

TEST_F(Solve, ABodyHeldEverywhereIsAnswered) {
  const ProgramRun run = solve(block_inp(1) + step("*BOUNDARY\nEVERY, 1, 3\n"));
  ASSERT_EQ(run.exit_code, 0) << run.error;
  EXPECT_EQ(summary()["equations"], 0);
}

// The second step continues the first. Its end depends only on its final loads, which are conservative.
TEST_F(Solve, StepsFollowOneAnother) {
  ASSERT_EQ(
      solve("*INCLUDE, INPUT=" + kCylinder + "\n" + step("*CLOAD\nP1, 3, -4\n") + step("*CLOAD\nP1, 3, -8\n"))
          .exit_code,
      0);
  const std::vector<CsvRow> first = read_csv(folder() / "step1.csv");
  const std::vector<CsvRow> second = read_csv(folder() / "step2.csv");
  run_cleanly({"solve", kCylinderPush, "-o", (dir_.path() / "at_once").string()});
  const std::vector<CsvRow> at_once = read_csv(dir_.path() / "at_once" / "step1.csv");
  EXPECT_NEAR(row_of(first, 6).f[2], -4, 1e-8);
  EXPECT_NEAR(row_of(second, 6).f[2], -8, 1e-8);
  for (const CsvRow& row : at_once) {
    for (size_t axis = 0; axis < 3; ++axis) EXPECT_NEAR(row_of(second, row.node).u[axis], row.u[axis], 1e-8);
  }
}

TEST_F(Solve, ResultOpensAsVtu) {
  run_cleanly({"solve", kCylinderPush, "-o", folder().string()});
  const std::string text = file_text(folder() / "result.vtu");
  EXPECT_NE(text.find("<VTKFile type=\"UnstructuredGrid\""), std::string::npos);
  EXPECT_NE(text.find("NumberOfPoints=\"195\""), std::string::npos);
  EXPECT_NE(text.find("NumberOfCells=\"586\""), std::string::npos);
  for (const char* name : {"displacement", "force", "node", "element", "material"})
    EXPECT_NE(text.find("Name=\"" + std::string(name) + "\""), std::string::npos) << name;
  EXPECT_TRUE(text.ends_with("</VTKFile>\n"));
}

TEST_F(Solve, JsonIsAllThatStandardOutputHolds) {
  const ProgramRun run = run_cleanly({"solve", kCylinderPush, "-o", folder().string(), "--json"});
  EXPECT_EQ(run.json(), summary());
}

// Two steps; the second pushes the top through the fixed base, which is impossible.
std::string impossible() {
  return "*INCLUDE, INPUT=" + kCylinder + "\n" + step("*BOUNDARY\nP1, 3, 3, -4\n") +
         step("*BOUNDARY\nP1, 3, 3, -40\n", ", INC=6");
}

TEST_F(Solve, FailureLeavesTheLastEquilibriumAndSaysWhere) {
  const ProgramRun run = solve(impossible());
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_EQ(names_in(folder()),
            (std::vector<std::string>{"partial.csv", "result.vtu", "step1.csv", "summary.json"}));
  const nlohmann::json failed = summary()["steps"][1];
  EXPECT_EQ(failed["converged"], false);
  const double load_factor = failed["load_factor"].get<double>();
  EXPECT_GT(load_factor, 0);
  EXPECT_LT(load_factor, 1);
  EXPECT_GT(failed["min_J"].get<double>(), 0);

  const std::string last_line = run.error.substr(run.error.rfind('\n', run.error.size() - 2) + 1);
  char factor_text[32];
  std::snprintf(factor_text, sizeof factor_text, "load factor %.6f", load_factor);
  EXPECT_NE(last_line.find("step 2 did not converge"), std::string::npos) << run.error;
  EXPECT_NE(last_line.find(factor_text), std::string::npos) << run.error;
  EXPECT_NE(last_line.find("element " + std::to_string(failed["min_J_element"].get<int>())),
            std::string::npos)
      << run.error;
  EXPECT_NE(run.error.find("residual"), std::string::npos);  // the residual table

  const std::vector<CsvRow> rows = read_csv(folder() / "partial.csv");
  const CsvRow& pushed = row_of(rows, 6);
  EXPECT_NEAR(pushed.u[2], -4 + load_factor * (-40 + 4), 1e-9);
  // Equilibrium: only the pushed node and the base have a force.
  const double scale = std::abs(pushed.f[2]);
  for (const CsvRow& row : rows) {
    if (row.node == 6 || row.x[2] == 0) continue;
    EXPECT_LT(std::hypot(row.f[0], row.f[1], row.f[2]), 1e-7 * scale) << row.node;
  }
}

TEST_F(Solve, ResultsOfAnEarlierRunDoNotStayBehind) {
  ASSERT_EQ(solve(impossible()).exit_code, 2);
  dir_.write("results/step12.csv", "old");
  dir_.write("results/stepwise.csv", "mine");
  dir_.write("results/notes.txt", "mine");
  run_cleanly({"solve", kCylinderPush, "-o", folder().string()});
  EXPECT_EQ(names_in(folder()), (std::vector<std::string>{"notes.txt", "result.vtu", "step1.csv",
                                                          "stepwise.csv", "summary.json"}));
  // A failure also removes old results of the steps that it did not reach.
  dir_.write("results/step2.csv", "old");
  ASSERT_EQ(solve(impossible()).exit_code, 2);
  EXPECT_FALSE(std::filesystem::exists(folder() / "step2.csv"));
}

TEST_F(Solve, InputsAreNoResults) {
  const std::string model = dir_.write("step1.csv", impossible()).string();
  const std::string folder = dir_.path().string();
  EXPECT_EQ(refusal_of({"solve", "--allow-outside", model, "-o", folder}),
            folder + "/step1.csv: is an input of this command; name another place with -o");
  EXPECT_EQ(file_text(model), impossible());
}

TEST_F(Solve, RefusedModelTouchesNoEarlierResult) {
  run_cleanly({"solve", kCylinderPush, "-o", folder().string()});
  EXPECT_NE(refusal_of({"solve", "nothing.inp", "-o", folder().string()}).find("nothing.inp"),
            std::string::npos);
  EXPECT_TRUE(std::filesystem::exists(folder() / "step1.csv"));
}

TEST_F(Solve, FolderThatCannotBeMadeIsSaidBeforeSolving) {
  const std::string file = dir_.write("file", "").string();
  EXPECT_EQ(refusal_of({"solve", kCylinderPush, "-o", file}),
            file + ": this folder cannot be made (Not a directory); name another with -o");
  EXPECT_NE(refusal_of({"solve", kCylinderPush, "-o", "/proc/palpate"}).find("/proc/palpate: "),
            std::string::npos);
}

TEST_F(Solve, ModelWithoutAStepIsRefused) {
  EXPECT_NE(refusal_of({"solve", kCylinder, "-o", folder().string()}).find("no *STEP"), std::string::npos);
}

}  // namespace cli_solve_test
}  // namespace palpate::test
