// `palpate validate` as a user runs it.
#include <gtest/gtest.h>

#include <cstring>

#include "tests/support/forged_pack.hpp"
#include "tests/support/scene_files.hpp"

namespace palpate::test {
namespace cli_validate_test {

ProgramRun validate(const std::filesystem::path& pack, const std::string& samples, const std::string& seed) {
  return run_program({"validate", pack.string(), "--samples", samples, "--seed", seed, "--json"});
}

TEST(Validate, APackKeepsWhatItSays) {
  const SceneFiles files;
  ASSERT_EQ(files.build().exit_code, 0);
  // Only the pack is left: it contains its inputs.
  std::filesystem::remove(files.inp);
  std::filesystem::remove(files.scene);
  const ProgramRun run = validate(files.pack, "64", "3");
  ASSERT_EQ(run.exit_code, 0) << run.error << run.out;
  const nlohmann::json json = run.json();
  EXPECT_EQ(json["agrees"], true);
  EXPECT_EQ(json["pushes_without_equilibrium"], 0);
  for (const char* model : {"linear_dd", "polynomial_dd"}) {
    const nlohmann::json& validated = json["models"][model];
    EXPECT_EQ(validated["overall"]["samples"], 64);
    for (const nlohmann::json& bin : validated["bins"]) EXPECT_EQ(bin["samples"], 16);
    for (const char* what : {"displacement", "force"}) {
      EXPECT_GT(validated["overall"][what]["median"].get<double>(), 0);
      EXPECT_LE(validated["p95_ratio"][what].get<double>(), 1.5);
      EXPECT_GE(validated["within_estimate"][what].get<double>(), 0.95);
    }
  }
  // New errors, not the pack's: the same for the same seed, others for another seed.
  const nlohmann::json own = run_cleanly({"info", files.pack.string(), "--json"}).json()["errors"];
  EXPECT_NE(json["models"]["linear_dd"]["overall"]["displacement"]["median"],
            own["linear_dd"]["overall"]["displacement"]["median"]);
  EXPECT_EQ(validate(files.pack, "64", "3").json()["models"], json["models"]);
  EXPECT_NE(validate(files.pack, "64", "4").json()["models"], json["models"]);
  const ProgramRun text = run_cleanly({"validate", files.pack.string(), "--samples", "64"});
  EXPECT_NE(text.out.find("agrees"), std::string::npos) << text.out;
}

TEST(Validate, APackThatPromisesTooMuchIsFoundOut) {
  const SceneFiles files;
  ASSERT_EQ(files.build().exit_code, 0);
  forge(files.pack, [](pack::Pack& tables) {
    for (const pack::ErrorSurvey* survey : *tables.surveys()) {
      for (const pack::ErrorBin* bin : *survey->bins()) {
        auto* changed = const_cast<flatbuffers::Table*>(reinterpret_cast<const flatbuffers::Table*>(bin));
        ASSERT_TRUE(changed->SetField<double>(pack::ErrorBin::VT_FORCE_BOUND, bin->force_bound() / 10));
      }
    }
  });
  const ProgramRun run = validate(files.pack, "32", "1");
  EXPECT_EQ(run.exit_code, 2) << run.error;
  EXPECT_EQ(run.json()["agrees"], false);
  EXPECT_LT(run.json()["models"]["polynomial_dd"]["within_estimate"]["force"].get<double>(), 0.95);
}

// A false promise for several contacts, too.
TEST(Validate, APackThatPromisesTooMuchOfSeveralContactsIsFoundOut) {
  const SceneFiles files(
      "[contact]\nsites = [50, 52, 55, 57, 62, 64]\nmax_displacement = 0.02\ntip_radius = 0.07\n"
      "max_contacts = 2\n[models]\npolynomial = false\nzone = false\n",
      block_inp(3));
  ASSERT_EQ(files.build().exit_code, 0);
  forge(files.pack, [](pack::Pack& tables) {
    for (const pack::ErrorSurvey* survey : *tables.surveys()) {
      for (const pack::SetErrors* errors : *survey->sets()) {
        // The second of six figures, after six counts: the displacement's p95.
        constexpr size_t kP95 = 6 * sizeof(std::uint32_t) + sizeof(double);
        const double less = errors->displacement_p95() / 10;
        std::memcpy(reinterpret_cast<char*>(const_cast<pack::SetErrors*>(errors)) + kP95, &less, sizeof less);
      }
    }
  });
  const ProgramRun run = validate(files.pack, "32", "1");
  EXPECT_EQ(run.exit_code, 2) << run.out;
  const nlohmann::json model = run.json()["models"]["linear_dd"];
  EXPECT_EQ(model["agrees"], false);
  EXPECT_GT(model["several"][0]["p95_ratio"]["displacement"].get<double>(), 2);
  EXPECT_LE(model["p95_ratio"]["displacement"].get<double>(), 1.5)
      << "of single contacts it says what is true";
}

// A model in a folder beside the scene's, and an included file.
TEST(Validate, InputsInSeveralFoldersComeAlong) {
  const SceneFiles files;
  const std::string model = file_text(files.inp);
  const size_t steps = model.find("*ELEMENT");
  ASSERT_NE(steps, std::string::npos);
  files.dir.write("meshes/nodes/block_nodes.inp", model.substr(0, steps));
  files.dir.write("meshes/block.inp", "*INCLUDE, INPUT=nodes/block_nodes.inp\n" + model.substr(steps));
  const std::filesystem::path scene =
      files.dir.write("scenes/block.toml", "model = \"../meshes/block.inp\"\n" + kContact);
  const ProgramRun built = run_program({"build", scene.string(), "-o", files.pack.string(), "--jobs", "1"});
  ASSERT_EQ(built.exit_code, 0) << built.error;
  std::filesystem::remove_all(files.dir.path() / "meshes");
  std::filesystem::remove_all(files.dir.path() / "scenes");
  EXPECT_EQ(validate(files.pack, "64", "1").exit_code, 0);
}

TEST(Validate, APackWithoutItsInputsIsRefused) {
  const SceneFiles files;
  ASSERT_EQ(files.build().exit_code, 0);
  forge(files.pack, [](pack::Pack& tables) {
    auto* hash = const_cast<flatbuffers::String*>(tables.inputs()->Get(1)->xxh3_128());
    const_cast<char*>(hash->c_str())[0] ^= 1;
  });
  const ProgramRun run = validate(files.pack, "8", "1");
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_NE(run.error.find("block.inp in the pack is not what it was made from"), std::string::npos)
      << run.error;
  forge(files.pack, [](pack::Pack& tables) {
    auto* path = const_cast<flatbuffers::String*>(tables.inputs()->Get(1)->path());
    std::memcpy(const_cast<char*>(path->c_str()), "../", 3);  // a path outside the output folder
  });
  const ProgramRun escaped = validate(files.pack, "8", "1");
  EXPECT_EQ(escaped.exit_code, 1);
  EXPECT_NE(escaped.error.find("does not carry the files"), std::string::npos) << escaped.error;
}

}  // namespace cli_validate_test
}  // namespace palpate::test
