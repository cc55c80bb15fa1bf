// Parts with their own nodes at a common place, as a user meets them: `solve` warns, `--merge` joins, `build`
// refuses unless the scene says that the parts are meant.
#include <gtest/gtest.h>

#include <map>

#include "tests/support/nodal_csv.hpp"
#include "tests/support/run_program.hpp"
#include "tests/support/stacked_blocks.hpp"
#include "tests/support/temp_dir.hpp"

namespace palpate::test {
namespace cli_merge_test {

std::string pressed(const Model& model) {
  std::string text = inp_of(model, nodes_on_plane(model, 2, 0)) + "*NSET, NSET=TOP\n";
  for (const int node : nodes_on_plane(model, 2, 4))
    text += fmt::format("{}\n", model.labels[static_cast<std::size_t>(node)]);
  return text + "*STEP, NLGEOM\n*STATIC\n*BOUNDARY\nTOP, 1, 2, 0.1\nTOP, 3, 3, -0.4\n*END STEP\n";
}

std::map<std::array<double, 3>, CsvRow> by_place(const std::filesystem::path& file) {
  std::map<std::array<double, 3>, CsvRow> rows;
  for (const CsvRow& row : read_csv(file)) rows[row.x] = row;
  return rows;
}

// The same body once as two parts and once as one mesh.
TEST(Merge, GivesTheForcesOfOneMesh) {
  const TempDir dir;
  const std::string apart = dir.write("apart.inp", pressed(stacked_blocks()));
  const std::string whole = dir.write("whole.inp", pressed(block_at({0, 0, 0}, {3, 3, 4}, {3, 3, 4})));
  run_cleanly({"solve", whole, "-o", (dir.path() / "whole").string()});
  const ProgramRun merged =
      run_program({"solve", apart, "-o", (dir.path() / "merged").string(), "--merge", "1e-6"});
  ASSERT_EQ(merged.exit_code, 0) << merged.error;
  EXPECT_NE(merged.error.find("merged 16 nodes into others closer than 1e-06"), std::string::npos);
  EXPECT_EQ(merged.error.find("at the place of another node"), std::string::npos) << merged.error;
  const auto expected = by_place(dir.path() / "whole/step1.csv");
  const auto found = by_place(dir.path() / "merged/step1.csv");
  ASSERT_EQ(found.size(), 80U);
  double largest = 0;
  for (const auto& [place, row] : expected) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(found.at(place).u[axis], row.u[axis], 1e-9);
      EXPECT_NEAR(found.at(place).f[axis], row.f[axis], 1e-9);
      largest = std::max(largest, std::abs(row.f[axis]));
    }
  }
  EXPECT_GT(largest, 0.1);
}

TEST(Merge, IsAdvisedWhereASolveNeedsIt) {
  const TempDir dir;
  const ProgramRun run =
      run_program({"solve", dir.write("apart.inp", pressed(stacked_blocks())), "-o", dir.path() / "out"});
  EXPECT_EQ(run.exit_code, 0) << run.error;
  EXPECT_EQ(std::count(run.error.begin(), run.error.end(), '\n'), 2) << run.error;
  EXPECT_NE(run.error.find("apart.inp: 16 nodes lie at the place of another node"), std::string::npos);
  EXPECT_NE(run.error.find("apart.inp: 36 outer faces lie on outer faces of other elements"),
            std::string::npos);
  EXPECT_NE(run.error.find("--merge 1e-6"), std::string::npos);
  for (const std::string length : {"0", "-1", "nan", "inf", "x"}) {
    const std::string refusal =
        refusal_of({"solve", dir.path() / "apart.inp", "-o", dir.path() / "out", "--merge=" + length});
    EXPECT_NE(refusal.find("--merge"), std::string::npos) << refusal;
  }
}

TEST(Merge, ABuildRefusesPartsUnlessTheyAreMeant) {
  const TempDir dir;
  const Model apart = stacked_blocks();
  std::vector<int> held = nodes_on_plane(apart, 2, 0);
  const std::vector<int> top = nodes_on_plane(apart, 2, 4);
  held.insert(held.end(), top.begin(), top.end());
  dir.write("apart.inp", inp_of(apart, held));
  const auto build = [&](const std::string& keys) {
    const std::string scene = dir.write(
        "scene.toml", "model = \"apart.inp\"\n" + keys +
                          "[contact]\nsites = [17]\nmax_displacement = 0.1\n[models]\npolynomial = false\n");
    return run_program({"build", scene, "-o", dir.path() / "a.pack", "--survey", "none", "--jobs", "1"});
  };
  const ProgramRun refused = build("");
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_EQ(refused.out, "");
  EXPECT_EQ(std::count(refused.error.begin(), refused.error.end(), '\n'), 3) << refused.error;
  EXPECT_FALSE(std::filesystem::exists(dir.path() / "a.pack"));
  const ProgramRun meant = build("separate_bodies = true\n");
  EXPECT_EQ(meant.exit_code, 0) << meant.error;
  EXPECT_NE(meant.out.find("bodies     not joined where they meet, as separate_bodies = true says: 16 nodes"),
            std::string::npos)
      << meant.out;
  const ProgramRun merged = build("merge = 1e-6\n");
  EXPECT_EQ(merged.exit_code, 0) << merged.error;
  EXPECT_EQ(merged.out.find("bodies "), std::string::npos);
  EXPECT_NE(merged.out.find(": 80 nodes, 216 elements"), std::string::npos) << merged.out;
}

}  // namespace cli_merge_test
}  // namespace palpate::test
