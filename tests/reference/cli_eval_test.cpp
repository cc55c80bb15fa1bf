// `palpate eval` as a user meets it: its JSON, its table, and its force beside a full solve of the same push.
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "tests/support/nodal_csv.hpp"
#include "tests/support/scene_files.hpp"

namespace palpate::test {
namespace {

using Words = std::vector<std::string>;

class Eval : public ::testing::Test {
 protected:
  explicit Eval(const std::string& contact = kContact) : files_(contact) {}
  void SetUp() override { ASSERT_EQ(files_.build().exit_code, 0); }

  ProgramRun eval(const Words& more) const {
    Words arguments = {"eval", files_.pack.string()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_program(arguments);
  }
  nlohmann::json answer(Words more) const {
    more.push_back("--json");
    const ProgramRun run = eval(more);
    EXPECT_EQ(run.exit_code, 0) << run.error;
    EXPECT_EQ(run.error, "");
    return run.json();
  }
  std::string refusal(const Words& more) const {
    Words arguments = {"eval", files_.pack.string()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return refusal_of(arguments);
  }

  // The table of a full solve that moves the patches of these sites.
  std::filesystem::path solve(const std::vector<std::pair<int, std::array<double, 3>>>& pushes) const {
    const nlohmann::json info = run_cleanly({"info", files_.pack.string(), "--json"}).json();
    std::string text = "*INCLUDE, INPUT=" + files_.inp.string() + "\n*STEP, NLGEOM=YES\n*STATIC\n*BOUNDARY\n";
    for (const auto& [node, d] : pushes) {
      for (const nlohmann::json& site : info["sites"]) {
        if (site["node"] != node) continue;
        for (const nlohmann::json& member : site["patch"]) {
          for (size_t axis = 0; axis < 3; ++axis) {
            const std::string dof = std::to_string(axis + 1);
            char value[40];
            std::snprintf(value, sizeof value, "%.17g", d[axis]);
            text += member.dump() + ", " + dof + ", " + dof + ", " + value + "\n";
          }
        }
      }
    }
    const std::filesystem::path folder = files_.dir.path() / "solved";
    run_cleanly(
        {"solve", files_.dir.write("push.inp", text + "*END STEP\n").string(), "-o", folder.string()});
    return folder / "step1.csv";
  }

  SceneFiles files_;
};

std::array<double, 3> vector_of(const nlohmann::json& json) {
  return {json[0].get<double>(), json[1].get<double>(), json[2].get<double>()};
}

double distance(const std::array<double, 3>& a, const std::array<double, 3>& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

// The middle node of the top alone is a corner of four triangles, each half a cell, and bears a third of each.
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

TEST_F(Eval, JsonIsAsTheContractSays) {
  const nlohmann::json json = answer({"--contact", "23=0.001,0,-0.02"});
  EXPECT_EQ(json.size(), 2u);
  EXPECT_EQ(json["flags"], nlohmann::json::array());
  ASSERT_EQ(json["contacts"].size(), 1u);
  const nlohmann::json& contact = json["contacts"][0];
  std::vector<std::string> keys;
  for (const auto& [key, value] : contact.items()) keys.push_back(key);
  EXPECT_EQ(keys, (std::vector<std::string>{"displacement", "error_estimate", "flags", "force", "model",
                                            "node", "pressure", "stiffness"}));
  EXPECT_EQ(contact["node"], 23);
  EXPECT_EQ(contact["displacement"], nlohmann::json({0.001, 0.0, -0.02}));
  EXPECT_EQ(contact["model"], "polynomial");
  EXPECT_EQ(contact["flags"], nlohmann::json::array());
  EXPECT_LT(contact["force"][2].get<double>(), 0) << "the outside pushes where the tissue goes";
  EXPECT_EQ(contact["error_estimate"].size(), 2u);
  for (const char* kind : {"displacement", "force"}) {
    EXPECT_GT(contact["error_estimate"][kind].get<double>(), 0);
    EXPECT_LT(contact["error_estimate"][kind].get<double>(), 0.1);
  }
  ASSERT_EQ(contact["stiffness"].size(), 3u);
  for (size_t i = 0; i < 3; ++i) {
    ASSERT_EQ(contact["stiffness"][i].size(), 3u);
    EXPECT_GT(contact["stiffness"][i][i].get<double>(), 0);
    for (size_t j = 0; j < 3; ++j) EXPECT_EQ(contact["stiffness"][i][j], contact["stiffness"][j][i]);
  }
}

TEST_F(Eval, RepeatsToTheBit) {
  const Words push = {"--contact", "23=0.003,-0.002,-0.02", "--json"};
  EXPECT_EQ(eval(push).out, eval(push).out);
}

TEST_F(Eval, ContactMayFollowAnEqualsSign) {
  EXPECT_EQ(eval({"--contact=23=0,0,-0.02", "--json"}).out,
            eval({"--contact", "23=0,0,-0.02", "--json"}).out);
  EXPECT_EQ(eval({"--contact", "23=+0,0.0,-2e-2", "--json"}).out,
            eval({"--contact", "23=0,0,-0.02", "--json"}).out);
}

TEST_F(Eval, TableHoldsThePackedNodesWithoutForces) {
  const std::filesystem::path table = files_.dir.path() / "field.csv";
  ASSERT_EQ(eval({"--contact", "23=0,0,-0.02", "-o", table.string()}).exit_code, 0);
  const std::vector<CsvRow> rows = read_csv(table);
  EXPECT_EQ(rows.size(), 26u) << "the surface: all but the node in the middle of the block";
  for (const CsvRow& row : rows) {
    EXPECT_EQ(row.fields[7] + row.fields[8] + row.fields[9], "");
    if (row.node > 9) continue;
    EXPECT_EQ(row.u, (std::array<double, 3>{})) << "held node " << row.node;
  }
  EXPECT_NEAR(row_of(rows, 23).u[2], -0.02, 1e-7);
}

// Against the full solve: within twice what the survey found at worst (it has few samples).
TEST_F(Eval, ForceAndFieldAreThoseOfAFullSolve) {
  const std::array<double, 3> d = {0.004, 0.002, -0.02};
  const std::filesystem::path table = solve({{23, d}});
  const nlohmann::json json = answer({"--contact", "23=0.004,0.002,-0.02", "--reference", table.string()});
  const nlohmann::json survey =
      run_cleanly({"info", files_.pack.string(), "--json"}).json()["errors"]["polynomial_dd"]["overall"];
  const nlohmann::json& reference = json["contacts"][0]["reference"];
  EXPECT_LT(reference["force_error"].get<double>(), 2 * survey["force"]["max"].get<double>());
  EXPECT_LT(json["reference"]["displacement_error"].get<double>(),
            2 * survey["displacement"]["max"].get<double>());
  // The comparison itself, done anew from the table.
  std::array<double, 3> truth{};
  for (const CsvRow& row : read_csv(table)) {
    if (distance(row.u, d) > 1e-12) continue;
    for (size_t axis = 0; axis < 3; ++axis) truth[axis] += row.f[axis];
  }
  EXPECT_LT(distance(vector_of(reference["force"]), truth), 1e-9);
  const double size = distance(truth, {});
  EXPECT_NEAR(reference["force_error"].get<double>(),
              distance(vector_of(json["contacts"][0]["force"]), truth) / size, 1e-9);
}

class EvalBetweenSites : public Eval {
 protected:
  EvalBetweenSites()
      : Eval("[contact]\nsites = [22, 23, 25, 26]\nmax_displacement = 0.02\ntip_radius = 0.13\n") {}
};

// The truth between sites is by definition the blend of the full solves at the three corners.
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

// The same organ in ten-node elements, all the way from the file to the runtime's answer.
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

TEST_F(Eval, ReferenceThatIsNoneIsRefused) {
  const std::vector<std::string> push = {"eval", files_.pack.string(), "--contact", "23=0,0,-0.02"};
  const auto refusal = [&](const std::filesystem::path& table) {
    std::vector<std::string> arguments = push;
    arguments.insert(arguments.end(), {"--reference", table.string()});
    return refusal_of(arguments);
  };
  const std::filesystem::path own = files_.dir.path() / "own.csv";
  ASSERT_EQ(eval({"--contact", "23=0,0,-0.02", "-o", own.string()}).exit_code, 0);
  EXPECT_NE(refusal(own).find("has no force; give a stepN.csv of `solve`"), std::string::npos)
      << refusal(own);
  const std::string header = "node,x,y,z,ux,uy,uz,fx,fy,fz\n";
  const std::vector<std::pair<std::string, std::string>> wrong = {
      {"nan,0,0,0,0,0,0,0,0,0", "a field is not a number"},
      {"1.5,0,0,0,0,0,0,0,0,0", "a field is not a number"},
      {"1,0,0,0,0,0,inf,0,0,0", "a field is not a number"},
      {"1,0,0,0,0,0,0,0,0,0x", "a field is not a number"},
      {"1,0,0,0,0,0,0,0,,0", "a field is not a number"},
      {"1,0,0,0,0,0,0,0,0", "there must be 10 fields"},
      {"1,0,0,0,0,0,0,0,0,0,0", "there must be 10 fields"}};
  for (const auto& [row, reason] : wrong) {
    const std::filesystem::path table = files_.dir.write("wrong.csv", header + row + "\n");
    EXPECT_EQ(refusal(table), table.string() + ":2: " + reason) << row;
  }
}

TEST_F(Eval, LinearModelIsTheFullSolveOfATinyPush) {
  const std::array<double, 3> d = {2e-6, -1e-6, -3e-6};
  const std::filesystem::path table = solve({{23, d}});
  for (const char* model : {"linear", "polynomial"}) {
    const nlohmann::json json =
        answer({"--contact", "23=2e-6,-1e-6,-3e-6", "--model", model, "--reference", table.string()});
    EXPECT_EQ(json["contacts"][0]["model"], model);
    // What is left is second order in |d| / edge (3e-5), and float32 in the field.
    EXPECT_LT(json["contacts"][0]["reference"]["force_error"].get<double>(), 2e-4) << model;
    EXPECT_LT(json["reference"]["displacement_error"].get<double>(), 2e-4) << model;
  }
}

TEST_F(Eval, SeveralContactsAreAnsweredByAZone) {
  const nlohmann::json json = answer({"--contact", "22=0,0,-0.01", "--contact", "23=0,0,-0.01"});
  ASSERT_EQ(json["contacts"].size(), 2u);
  for (const nlohmann::json& contact : json["contacts"]) {
    EXPECT_EQ(contact["model"], "zone");
    EXPECT_NE(contact["flags"].dump().find("overlapping"), std::string::npos) << "their patches share nodes";
  }
}

TEST_F(Eval, WhatNoNonlinearModelAnswersIsLinearAndSaysSo) {
  std::vector<std::string> nine;  // one more than zones answer
  for (int i = 0; i < 9; ++i) {
    nine.push_back("--contact");
    nine.push_back(i % 2 == 0 ? "22=0,0,-0.01" : "23=0,0,-0.01");
  }
  const nlohmann::json json = answer(nine);
  ASSERT_EQ(json["contacts"].size(), 9u);
  for (const nlohmann::json& contact : json["contacts"]) {
    EXPECT_EQ(contact["model"], "linear");
    EXPECT_NE(contact["flags"].dump().find("linear_fallback"), std::string::npos);
    EXPECT_NE(contact["flags"].dump().find("overlapping"), std::string::npos) << "their patches share nodes";
  }
}

TEST_F(Eval, FixHoldsANodeAtZero) {
  const std::filesystem::path table = files_.dir.path() / "field.csv";
  for (const std::string model : {"linear", "zone"}) {
    const nlohmann::json json = answer(
        {"--contact", "23=0,0,-0.01", "--fix", "19", "--fix", "22", "-o", table.string(), "--model", model});
    const std::vector<CsvRow> rows = read_csv(table);
    constexpr double kFloatSum = 1e-7 * 0.01;  // the field is a float32 sum of responses of the push's size
    EXPECT_LT(distance(row_of(rows, 22).u, {}), 10 * kFloatSum);
    EXPECT_NEAR(row_of(rows, 23).u[2], -0.01, 1e-7);
    const nlohmann::json free = answer({"--contact", "23=0,0,-0.01", "--model", model});
    EXPECT_NE(json["contacts"][0]["force"], free["contacts"][0]["force"]);
  }
}

TEST_F(Eval, AForceInPlaceOfADisplacement) {
  const nlohmann::json by_zone = answer({"--contact", "23=0.001,0,f-0.02"})["contacts"][0];
  EXPECT_EQ(by_zone["model"], "zone");
  EXPECT_NEAR(by_zone["force"][2].get<double>(), -0.02, 2e-5);
  const nlohmann::json pushed =
      answer({"--contact", "23=0.001,0,f-0.02", "--model", "linear"})["contacts"][0];
  EXPECT_NEAR(pushed["force"][2].get<double>(), -0.02, 1e-12);
  EXPECT_EQ(pushed["displacement"][0], 0.001);
  char moved[60];
  std::snprintf(moved, sizeof moved, "23=0.001,0,%.17g", pushed["displacement"][2].get<double>());
  const nlohmann::json again = answer({"--contact", moved, "--model", "linear"})["contacts"][0];
  EXPECT_LT(distance(vector_of(again["force"]), vector_of(pushed["force"])), 1e-12);
  EXPECT_NE(eval({"--contact", "23=0,0,f-0.02"}).out.find("moved by (0, 0, -"), std::string::npos);
}

TEST_F(Eval, NoContactIsRest) {
  EXPECT_EQ(answer({}), nlohmann::json::parse(R"({"contacts": [], "flags": []})"));
  EXPECT_NE(eval({}).out.find("at rest"), std::string::npos);
}

TEST_F(Eval, NoPushTakesNoForce) {
  const std::filesystem::path table = solve({{23, {0, 0, 0}}});
  for (const char* model : {"auto", "linear", "polynomial"}) {
    const nlohmann::json json =
        answer({"--contact", "23=0,0,0", "--model", model, "--reference", table.string()});
    EXPECT_EQ(vector_of(json["contacts"][0]["force"]), (std::array<double, 3>{}));
    EXPECT_EQ(json["contacts"][0]["reference"]["force_error"], 0.0);
    EXPECT_EQ(json["reference"]["displacement_error"], 0.0);
  }
}

TEST_F(Eval, BeyondWhatWasSampledIsFlagged) {
  EXPECT_EQ(answer({"--contact", "23=0,0,-0.06"})["contacts"][0]["flags"],
            nlohmann::json::array({"extrapolated"}));
  EXPECT_NE(answer({"--contact", "23=0,0,-3"})["contacts"][0]["flags"].dump().find("clamped"),
            std::string::npos);
}

TEST_F(Eval, MalformedContactsAreRefusedWithAnExample) {
  for (const char* contact : {"23", "23=", "23=0,0", "23=0,0,0,0", "=0,0,1", "x=0,0,1", "23=a,b,c",
                              "23=0,0,nan", "23=0,0,inf", "23=0,0,1e999", "23=0,0,f", "23=0,0,fnan",
                              "2.5=0,0,1", "99999999999=0,0,1", "23=0, 0, 1", "23=0;0;1"}) {
    EXPECT_EQ(
        refusal({"--contact", contact}),
        "--contact " + std::string(contact) +
            ": expected NODE=dx,dy,dz, for example 7=0,0,-5, or with a force in place of a displacement "
            "7=0,0,f-300");
  }
}

TEST_F(Eval, NodesThatAreNoSitesAreRefused) {
  EXPECT_EQ(refusal({"--contact", "5=0,0,1"}),
            "--contact 5=0,0,1: node 5 is not a contact site of this pack; `palpate info` lists them, "
            "and --at takes any place");
  EXPECT_EQ(
      refusal({"--at", "1,2=0,0,1"}),
      "--at 1,2=0,0,1: expected x,y,z=dx,dy,dz, for example 10,20,30=0,0,-5, or with a force in place of a "
      "displacement 10,20,30=0,0,f-300");
  EXPECT_NE(refusal({"--fix", "5"}).find("--fix 5: only nodes of contact patches"), std::string::npos);
  EXPECT_NE(refusal({"--fix", "x"}).find("--fix"), std::string::npos);
  EXPECT_NE(refusal({"--model", "cubic"}).find("cubic"), std::string::npos);
  EXPECT_NE(refusal({"--model", "polynomial", "--contact", "22=0,0,1", "--contact", "23=0,0,1"})
                .find("use auto, zone or linear"),
            std::string::npos);
  Words many;
  for (int i = 0; i < 65; ++i) many.insert(many.end(), {"--contact", "23=0,0,0"});
  EXPECT_EQ(refusal(many), "65 contacts are given; the runtime holds at most 64");
}

TEST_F(Eval, ReferenceOfAnotherPushIsRefused) {
  const std::filesystem::path table = solve({{23, {0, 0, -0.01}}});
  EXPECT_NE(refusal({"--contact", "23=0,0,-0.02", "--reference", table.string()}).find("not the same push"),
            std::string::npos);
  EXPECT_NE(refusal({"--contact", "23=0,0,-0.02", "--reference", "nothing.csv"}).find("nothing.csv"),
            std::string::npos);
}

// Units change what the runtime is told, not what the command line shows.
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

}  // namespace
}  // namespace palpate::test
