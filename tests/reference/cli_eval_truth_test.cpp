// `palpate eval` compared with full solves, in any units and with any labels.
#include <gtest/gtest.h>

#include "tests/support/cli_eval_fixture.hpp"

namespace palpate::test::cli_eval_fixture {
namespace cli_eval_truth_test {

// The middle node of the top is a corner of four triangles, each half a cell, and bears a third of each.
TEST(EvalPressure, IsTheForceIntoTheSurfaceOverItsArea) {
  const SceneFiles files("[contact]\nsites = [23]\nmax_displacement = 0.01\n");
  ASSERT_EQ(files.build().exit_code, 0);
  const double area = 4 * (0.125 * 0.125 / 2) / 3;
  for (const char* push : {"23=0,0,-0.008", "23=0.003,0,0.005"}) {
    const nlohmann::json contact =
        run_cleanly({"eval", files.pack.string(), "--contact", push, "--json"}).json()["contacts"][0];
    EXPECT_NEAR(contact["pressure"].get<double>(), -contact["force"][2].get<double>() / area,
                1e-9 * std::abs(contact["pressure"].get<double>()))
        << push;
  }
  EXPECT_NE(
      run_cleanly({"eval", files.pack.string(), "--contact", "23=0,0,-0.008"}).out.find("mean pressure"),
      std::string::npos);
}

class EvalBetweenSites : public Eval {
 protected:
  EvalBetweenSites()
      : Eval("[contact]\nsites = [22, 23, 25, 26]\nmax_displacement = 0.02\ntip_radius = 0.13\n") {}
};

// Between sites the reference is the blend of the full solves at the three corners.
TEST_F(EvalBetweenSites, ForceAndFieldAreTheBlendOfFullSolves) {
  const std::array<double, 3> d = {0.004, 0.002, -0.012};
  const std::filesystem::path table = files_.dir.path() / "field.csv";
  const nlohmann::json contact =
      answer({"--at", "0.05,0.16,0.4=0.004,0.002,-0.012", "-o", table.string()})["contacts"][0];
  EXPECT_EQ(contact["model"], "polynomial");
  EXPECT_EQ(contact["flags"], nlohmann::json::array({"off_surface"})) << "the place given is above it";
  EXPECT_EQ(vector_of(contact["at"])[2], 0.25) << "the nearest point of the top";
  EXPECT_NEAR(contact["distance"].get<double>(), 0.15, 1e-12);
  ASSERT_EQ(contact["corners"].size(), 3u);
  std::array<double, 3> force{};
  std::map<int, std::array<double, 3>> field;
  for (const nlohmann::json& corner : contact["corners"]) {
    const double weight = corner["weight"].get<double>();
    EXPECT_GT(weight, 0.1);
    for (const CsvRow& row : read_csv(solve({{corner["node"].get<int>(), d}}))) {
      const bool held = distance(row.u, d) < 1e-12;
      for (size_t axis = 0; axis < 3; ++axis) {
        if (held) force[axis] += weight * row.f[axis];
        field[row.node][axis] += weight * row.u[axis];
      }
    }
  }
  EXPECT_LT(distance(vector_of(contact["force"]), force), 0.01 * distance(force, {}));
  for (const CsvRow& row : read_csv(table))
    EXPECT_LT(distance(row.u, field.at(row.node)), 0.01 * distance(d, {})) << row.node;
}

// The same organ with ten-node elements, from the file to the runtime's response.
TEST(EvalTenNodes, ForceAndFieldAreThoseOfAFullSolve) {
  const SceneFiles files(kContact, block_inp(2, true));
  ASSERT_EQ(files.build().exit_code, 0);
  const nlohmann::json info = run_cleanly({"info", files.pack.string(), "--json"}).json();
  EXPECT_EQ(info["packed_nodes"], 98) << "9 and 16 on each of six faces, edges and corners shared";
  EXPECT_EQ(info["triangles"], 6 * 4 * 2 * 4) << "four for each face of six nodes";
  EXPECT_NEAR(info["mean_surface_edge"].get<double>(), 0.125 * (2 + std::sqrt(2.0)) / 3, 1e-9);
  std::string text = "*INCLUDE, INPUT=" + files.inp.string() + "\n*STEP, NLGEOM\n*STATIC\n*BOUNDARY\n";
  for (const nlohmann::json& site : info["sites"]) {
    if (site["node"] != 23) continue;
    EXPECT_GE(site["patch"].size(), 9u) << "the middle nodes around it too";
    for (const nlohmann::json& node : site["patch"]) {
      const std::string label = std::to_string(node.get<int>());
      text += label + ", 1, 1, 0.004\n" + label + ", 2, 2, 0.002\n" + label + ", 3, 3, -0.02\n";
    }
  }
  const std::filesystem::path out = files.dir.path() / "solve";
  run_cleanly({"solve", files.dir.write("push.inp", text + "*END STEP\n").string(), "-o", out.string()});
  const nlohmann::json answer = run_cleanly({"eval", files.pack.string(), "--contact", "23=0.004,0.002,-0.02",
                                             "--reference", (out / "step1.csv").string(), "--json"})
                                    .json();
  const nlohmann::json& survey = info["errors"]["polynomial_dd"]["overall"];
  EXPECT_LT(answer["contacts"][0]["reference"]["force_error"].get<double>(),
            2 * survey["force"]["max"].get<double>());
  EXPECT_LT(answer["reference"]["displacement_error"].get<double>(),
            2 * survey["displacement"]["max"].get<double>());
  EXPECT_LT(survey["displacement"]["max"].get<double>(), 0.05);
}

// Units change the pack's numbers, not the command line's.
TEST(EvalUnits, MillimetresAndMillinewtonsPrintTheSameNumbers) {
  const SceneFiles plain;
  const SceneFiles scaled("[units]\nlength = \"mm\"\nforce = \"mN\"\n" + kContact);
  ASSERT_EQ(plain.build().exit_code, 0);
  ASSERT_EQ(scaled.build().exit_code, 0);
  for (const char* model : {"linear", "polynomial"}) {
    const auto contact = [&](const SceneFiles& files) {
      return run_cleanly({"eval", files.pack.string(), "--contact", "23=0.001,0.002,-0.02", "--model", model,
                          "--json"})
          .json()["contacts"][0];
    };
    const nlohmann::json a = contact(plain);
    const nlohmann::json b = contact(scaled);
    EXPECT_EQ(a["displacement"], b["displacement"]);
    const std::array<double, 3> force = vector_of(a["force"]);
    EXPECT_LT(distance(force, vector_of(b["force"])), 1e-12 * distance(force, {}));
    for (size_t i = 0; i < 3; ++i) {
      const std::array<double, 3> row = vector_of(a["stiffness"][i]);
      EXPECT_LT(distance(row, vector_of(b["stiffness"][i])), 1e-12 * distance(row, {}));
    }
  }
  const std::string text = run_cleanly({"eval", scaled.pack.string(), "--contact", "23=0,0,-0.02"}).out;
  EXPECT_NE(text.find(") mN, size"), std::string::npos) << text;
}

TEST(EvalLabels, AreThoseOfTheModelHoweverSparse) {
  std::string model = block_inp(2);
  const size_t top = model.find("\n23, ");
  model.replace(top, 4, "\n5000,");
  for (size_t at = model.find("*ELEMENT"); (at = model.find(", 23", at)) != std::string::npos;) {
    if (model[at + 4] == ',' || model[at + 4] == '\n') model.replace(at, 4, ", 5000");
    ++at;
  }
  const SceneFiles sparse("[contact]\nsites = [22, 5000]\nmax_displacement = 0.03\ntip_radius = 0.13\n",
                          model);
  ASSERT_EQ(sparse.build().exit_code, 0);
  const SceneFiles dense;
  ASSERT_EQ(dense.build().exit_code, 0);
  const auto force = [](const SceneFiles& files, const std::string& contact) {
    return vector_of(run_cleanly({"eval", files.pack.string(), "--contact", contact, "--json"})
                         .json()["contacts"][0]["force"]);
  };
  const std::array<double, 3> expected = force(dense, "23=0,0,-0.02");
  EXPECT_LT(distance(force(sparse, "5000=0,0,-0.02"), expected), 1e-9 * distance(expected, {}));
}

}  // namespace cli_eval_truth_test
}  // namespace palpate::test::cli_eval_fixture
