// `palpate convert`, `check` and `new`: a mesh of any format becomes a pack that answers.
#include <gtest/gtest.h>

#include <fstream>
#include <regex>
#include <sstream>

#include "offline/io/tissue_table.hpp"
#include "offline/mesh/inp_reader.hpp"
#include "tests/support/block_mesh.hpp"
#include "tests/support/run_program.hpp"
#include "tests/support/temp_dir.hpp"

namespace palpate::test {
namespace cli_new_test {

class NewOrgan : public ::testing::Test {
 protected:
  std::string path(const std::string& name) const { return (dir_.path() / name).string(); }
  std::string block() const { return dir_.write("block.inp", block_inp(3)).string(); }
  TempDir dir_;
};

// Nodes, elements and sets survive each format there and back.
TEST_F(NewOrgan, ConvertsThereAndBack) {
  const std::string original = block();
  const Model before = read_inp_mesh(original);
  for (const std::string ending : {"vtk", "vtu", "msh", "msh2", "msh1", "mesh", "node"}) {
    SCOPED_TRACE(ending);
    run_cleanly({"convert", original, path("organ." + ending)});
    run_cleanly({"convert", path("organ." + ending), path(ending + ".inp")});
    const Model after = read_inp_mesh(path(ending + ".inp"));
    ASSERT_EQ(after.num_nodes(), before.num_nodes());
    ASSERT_EQ(after.elements.size(), before.elements.size());
    for (int node = 0; node < before.num_nodes(); ++node)
      EXPECT_EQ(after.positions[static_cast<size_t>(node)], before.positions[static_cast<size_t>(node)]);
    for (const auto& [name, members] : before.node_sets) {
      ASSERT_TRUE(after.node_sets.contains(name)) << name;
      EXPECT_EQ(after.node_sets.at(name), members) << name;
    }
  }
}

TEST_F(NewOrgan, ChecksSizeAndShape) {
  const nlohmann::json check = run_cleanly({"check", block(), "--scale", "2", "--json"}).json();
  EXPECT_EQ(check["nodes"], 64);
  EXPECT_EQ(check["elements"], 135);
  EXPECT_EQ(check["parts"], 1);
  EXPECT_EQ(check["open_edges"], 0);
  EXPECT_NEAR(check["volume"].get<double>(), 0.75 * 0.75 * 0.75, 1e-12);
  EXPECT_NEAR(check["size"][2].get<double>(), 0.75, 1e-12);
  // A cube is a regular tetrahedron and four corners, whose angles are acos(1/sqrt(3)) and 90 degrees.
  EXPECT_NEAR(check["least_angle"].get<double>(), 54.735610317245346, 1e-6);
  EXPECT_NEAR(check["largest_angle"].get<double>(), 90, 1e-6);
}

// The two commands that `new` prints make a pack, and the pack's tissue is that of the table.
TEST_F(NewOrgan, BecomesAPackInTwoCommands) {
  run_cleanly({"convert", block(), path("organ.vtk")});
  const ProgramRun made = run_cleanly({"new", path("organ.vtk"), "-o", path("made"), "--tissue", "kidney",
                                       "--unit", "cm", "--probe", "z>90%"});
  EXPECT_NE(made.out.find("palpate build " + path("made/organ.toml")), std::string::npos) << made.out;
  const ProgramRun built =
      run_program({"build", path("made/organ.toml"), "-o", path("made/organ.pack"), "--survey", "none"});
  EXPECT_EQ(built.exit_code, 0) << built.error;
  const nlohmann::json info = run_cleanly({"info", path("made/organ.pack"), "--json"}).json();
  EXPECT_EQ(info["sites"].size(), 16U);  // the top, which is free
  const Model model = read_inp(path("made/organ.inp"));
  const auto& law = std::get<CompressibleNeoHookean>(model.materials.front().law);
  EXPECT_DOUBLE_EQ(law.mu, 0.49);  // 4.9 kPa in N / cm^2
  EXPECT_NEAR(law.lambda / law.mu, 2 * kTissueRatio / (1 - 2 * kTissueRatio), 1e-4);
}

TEST_F(NewOrgan, RefusesWithARemedy) {
  const std::string organ = block();
  const auto says = [&](const std::vector<std::string>& arguments, const char* words) {
    const std::string message = refusal_of(arguments);
    EXPECT_NE(message.find(words), std::string::npos) << message;
  };
  says({"new", organ, "-o", path("a"), "--fix", "z<-50"}, "holds no node");
  says({"new", organ, "-o", path("a"), "--fix", "box 1,2,3"}, "give 6");
  says({"new", organ, "-o", path("a"), "--fix", "TOPP"}, "is no node set");
  says({"new", organ, "-o", path("a"), "--tissue", "cheese"}, "liver");
  says({"convert", organ, path("organ.xyz")}, "no mesh is written with this ending");
  says({"check", path("none.vtk")}, "none.vtk");
  dir_.write("surface.stl",
             "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
             "endloop\nendfacet\nendsolid s\n");
  says({"new", path("surface.stl"), "-o", path("a")}, "is a surface without tetrahedra");
  run_cleanly({"new", organ, "-o", path("a")});
  says({"new", organ, "-o", path("a")}, "exists already");
}

// docs/tissues.md and the program have the same numbers.
TEST(Tissues, AreThoseOfTheirPage) {
  std::ifstream page(std::string(PALPATE_SOURCE_DIR) + "/docs/tissues.md");
  std::stringstream text;
  text << page.rdbuf();
  const std::string all = text.str();
  const std::regex row(R"(\n\| ([a-z-]+) \| ([0-9.]+) \|)");
  size_t next = 0;
  for (std::sregex_iterator found(all.begin(), all.end(), row), end; found != end; ++found, ++next) {
    ASSERT_LT(next, kTissues.size());
    EXPECT_EQ((*found)[1].str(), kTissues[next].name);
    EXPECT_DOUBLE_EQ(std::stod((*found)[2].str()), kTissues[next].shear_modulus);
  }
  EXPECT_EQ(next, kTissues.size());
}

}  // namespace cli_new_test
}  // namespace palpate::test
