// `palpate eval` as a user runs it: its JSON, its table, and its force compared with a full solve.
#include <gtest/gtest.h>

#include "tests/support/cli_eval_fixture.hpp"

namespace palpate::test::cli_eval_fixture {
namespace cli_eval_test {

TEST_F(Eval, JsonIsAsTheContractSays) {
  const nlohmann::json json = answer({"--contact", "23=0.001,0,-0.02"});
  EXPECT_EQ(json.size(), 3u);
  EXPECT_EQ(json["flags"], nlohmann::json::array());
  EXPECT_EQ(json["tip_below_edge"], true) << "0.13 beside edges of 0.142";
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

// Within twice the survey's largest error; the survey has few samples.
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
  // The same comparison, computed from the table.
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
    // The remainder is of second order in |d| / edge (3e-5), and float32 rounding in the field.
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

TEST_F(Eval, FallsBackToTheLinearModelWithAFlag) {
  std::vector<std::string> nine;  // one more than a zone's capacity
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
    constexpr double kFloatSum = 1e-7 * 0.01;  // the field is a float32 sum of terms of the push's size
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
  EXPECT_NE(refusal({"--contact", "23=0,0,-0.02", "--reference", table.string()}).find("the same push"),
            std::string::npos);
  EXPECT_NE(refusal({"--contact", "23=0,0,-0.02", "--reference", "nothing.csv"}).find("nothing.csv"),
            std::string::npos);
}

}  // namespace cli_eval_test
}  // namespace palpate::test::cli_eval_fixture
