// `palpate report` as a user meets it.
#include <gtest/gtest.h>
#include <stdlib.h>

#include <string>
#include <vector>

#include "tests/support/forged_pack.hpp"
#include "tests/support/scene_files.hpp"

namespace palpate::test {
namespace {

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

// A model and a scene that are not Palpate's own.
TEST(Report, AStrangersSceneGivesAWholePage) {
  const SceneFiles files(
      "[contact]\nsites = [19, 23, 27]\nmax_displacement = 0.03\nmax_contacts = 2\n"
      "[models]\nzone = true\nzone_rings = 1\n");
  const std::filesystem::path folder = files.dir.path() / "report";
  const ProgramRun run = report(files.scene, folder);
  ASSERT_EQ(run.exit_code, 0) << run.error << run.out;
  const nlohmann::json json = run.json();
  EXPECT_EQ(json["kept"], true);
  for (const char* model : {"linear_dd", "polynomial_dd", "nonlinear_zone"})
    EXPECT_EQ(json["organs"][0]["models"][model]["kept"], true) << model;
  const std::string page = file_text(folder / "index.html");
  EXPECT_NE(page.find("<b>Kept.</b>"), std::string::npos);
  // Speed against error of field and force, two contacts, three of distributions, coverage, frames; and the error map.
  EXPECT_EQ(count_of(page, "data:image/svg+xml;base64,"), 8u);
  EXPECT_EQ(count_of(page, "data:image/png;base64,"), 1u);
  EXPECT_EQ(page.find("src=\"http"), std::string::npos);  // nothing from elsewhere
  EXPECT_EQ(count_of(page, "href=\"block_methods.csv\""), 4u);
  const std::string methods = file_text(folder / "block_methods.csv");
  for (const char* method :
       {"\"linear_dd\",1,1,", "\"polynomial_dd, degree 2, ", "\"nonlinear_zone, 1 ring\",1,1,",
        "\"nonlinear_zone, 2 rings\",0,1,", "\"linear, back-solve\",0,1,", "\"full Newton, warm\",0,1,",
        "\"linear_dd\",1,2,"})
    EXPECT_NE(methods.find(method), std::string::npos) << method;
}

TEST(Report, ASecondRunGivesTheSameErrorsToTheDigit) {
  const SceneFiles files;
  ASSERT_EQ(files.build().exit_code, 0);
  const auto errors = [&](const std::string& name, const std::vector<std::string>& more) {
    const std::filesystem::path folder = files.dir.path() / name;
    EXPECT_EQ(report(files.pack, folder, more).exit_code, 0);
    return file_text(folder / "block_pushes.csv");
  };
  const std::string first = errors("first", {"--jobs", "1"});
  EXPECT_GT(count_of(first, "\n"), 100u);
  EXPECT_EQ(errors("second", {"--jobs", "2"}), first);
  EXPECT_NE(errors("third", {"--seed", "2"}), first);
}

// As a fit or a kernel that is broken would: forces that are 5 % too large.
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

TEST(Report, SaysWhatIsMissing) {
  const SceneFiles files;
  const std::string folder = (files.dir.path() / "report").string();
  EXPECT_EQ(refusal_of({"report", "/nowhere/organ.pack", "-o", folder}), "/nowhere/organ.pack: no such file");
  const std::string path = getenv("PATH");
  setenv("PATH", "/nowhere", 1);
  const std::string refusal = refusal_of({"report", files.scene.string(), "-o", folder});
  setenv("PATH", path.c_str(), 1);
  EXPECT_NE(refusal.find("gnuplot-nox"), std::string::npos) << refusal;
}

}  // namespace
}  // namespace palpate::test
