// Builds a small pack and runs `palpate eval` on it.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "tests/support/nodal_csv.hpp"
#include "tests/support/scene_files.hpp"

namespace palpate::test::cli_eval_fixture {

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

  // Runs a full solve that moves the patches of these sites, and returns the path of its table.
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

inline std::array<double, 3> vector_of(const nlohmann::json& json) {
  return {json[0].get<double>(), json[1].get<double>(), json[2].get<double>()};
}

inline double distance(const std::array<double, 3>& a, const std::array<double, 3>& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

}  // namespace palpate::test::cli_eval_fixture
