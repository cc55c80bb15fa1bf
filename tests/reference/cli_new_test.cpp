// `palpate convert`, `check` and `new`: a mesh of any format becomes a pack that answers.
#include <gtest/gtest.h>

#include <fstream>
#include <regex>
#include <sstream>

#include "offline/io/inp_format.hpp"
#include "offline/io/mesh_formats.hpp"
#include "offline/io/model_from_mesh.hpp"
#include "offline/io/tissue_table.hpp"
#include "offline/mesh/inp_reader.hpp"
#include "offline/precompute/scene.hpp"
#include "tests/support/block_mesh.hpp"
#include "tests/support/run_program.hpp"
#include "tests/support/stacked_blocks.hpp"
#include "tests/support/temp_dir.hpp"

namespace palpate::test {
namespace cli_new_test {

class NewOrgan : public ::testing::Test {
 protected:
  std::string path(const std::string& name) const { return (dir_.path() / name).string(); }
  std::string block() const { return dir_.write("block.inp", block_inp(3)).string(); }
  // The block as a mesh without laws and supports.
  std::string bare_block() const {
    write_mesh(mesh_from_model(read_inp_mesh(block())), {}, path("bare.vtu"));
    return path("bare.vtu");
  }
  // Two blocks with their own nodes, far from each other, as a bare mesh. The second one is smaller.
  std::string two_parts() const {
    const Model model =
        with_part(block_at({0, 0, 0}, {3, 3, 3}, {3, 3, 3}), block_at({5, 0, 1}, {2, 2, 2}, {2, 2, 2}));
    write_mesh(mesh_from_model(model), {}, path("two.vtu"));
    return path("two.vtu");
  }
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
  EXPECT_EQ(check["parts"].size(), 1U);
  EXPECT_EQ(check["open_edges"], 0);
  EXPECT_EQ(check["shared_nodes"], 0);
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
  const std::string other = dir_.write("report.pdf", "%PDF").string();
  EXPECT_NE(refusal_of({"build", path("made/organ.toml"), "-o", other}).find("exists, and is not a pack"),
            std::string::npos);
  EXPECT_EQ(file_text(other), "%PDF");
  EXPECT_NE(refusal_of({"picture", path("made/organ.pack"), "-o", path("a.jpg")}).find("ends in .png"),
            std::string::npos);
  const Model model = read_inp(path("made/organ.inp"));
  const auto& law = std::get<CompressibleNeoHookean>(model.materials.front().law);
  EXPECT_DOUBLE_EQ(law.mu, 0.49);  // 4.9 kPa in N / cm^2
  EXPECT_NEAR(law.lambda / law.mu, 2 * kTissueRatio / (1 - 2 * kTissueRatio), 1e-4);
}

// A deck and its bare mesh have the same facts but for laws and supports, and --fix gives the supports.
TEST_F(NewOrgan, ChecksADeckAndAMeshAlike) {
  nlohmann::json deck = run_cleanly({"check", block(), "--json", "--unit", "cm"}).json();
  nlohmann::json mesh = run_cleanly({"check", bare_block(), "--json", "--unit", "cm", "--fix", "z<0"}).json();
  EXPECT_EQ(deck["held_by"], "*BOUNDARY");
  EXPECT_EQ(mesh["held_by"], "--fix z<0");
  EXPECT_EQ(deck["laws"][0]["elements"], 135);
  EXPECT_NEAR(deck["laws"][0]["poisson_ratio"].get<double>(), 0.4, 1e-12);  // mu = 1, lambda = 4
  EXPECT_TRUE(mesh["laws"].empty());
  EXPECT_EQ(mesh["fix"]["nodes"], 16);
  EXPECT_EQ(mesh["fix"]["touchable"], 0);
  EXPECT_EQ(mesh["fix"]["box"][1][2], 0);
  for (nlohmann::json* one : {&deck, &mesh}) {
    EXPECT_GT((*one)["cost"]["solve_seconds"].get<double>(), 0);
    EXPECT_EQ((*one)["cost"]["sites"], 40);  // of 56 nodes on the surface
    EXPECT_TRUE((*one)["parts"][0]["free_motions"].empty());
    for (const char* own : {"file", "cost", "laws", "held_by", "fix"}) one->erase(own);
  }
  EXPECT_EQ(deck, mesh);
}

TEST_F(NewOrgan, ChecksPlacesUnitsAndSupports) {
  const std::string organ = bare_block();
  const std::string text = run_cleanly({"check", organ, "--unit", "mm", "--probe", "box 0,0,0.3,1,1,1"}).out;
  const auto says = [&](const char* words) {
    EXPECT_NE(text.find(words), std::string::npos) << words << " in\n" << text;
  };
  says("0.375 x 0.375 x 0.375 mm: 0.0375 cm long");
  says("--probe    16 nodes, 16 of them free on the surface: x 0 .. 0.375, y 0 .. 0.375, z 0.375 .. 0.375");
  says("held       0 nodes by nothing");
  says("can move along x, move along y, move along z, turn about an axis along x");
  says("take a tip radius of at least 0.14");
  says("a solve of one push about");
  EXPECT_EQ(text.find(" if cm"), std::string::npos) << text;
  const std::string all = run_cleanly({"check", organ}).out;
  EXPECT_NE(all.find("0.0375 cm long if mm, 0.375 cm if cm, 37.5 cm if m"), std::string::npos) << all;
}

// Parts that lie on each other are named, and one part after --merge.
TEST_F(NewOrgan, ChecksWhatMergingJoins) {
  write_mesh(mesh_from_model(stacked_blocks()), {}, path("stack.vtu"));
  const ProgramRun refused_check = run_program({"check", path("stack.vtu"), "--json"});
  EXPECT_EQ(refused_check.exit_code, 1);
  EXPECT_EQ(refused_check.error,
            path("stack.vtu") + ": a build refuses it: see 2 lines \"refused\", with remedies\n");
  const nlohmann::json apart = refused_check.json();
  EXPECT_EQ(apart["parts"].size(), 2U);
  EXPECT_EQ(apart["refused"].size(), 2U);
  EXPECT_TRUE(apart.contains("no_cost"));
  const ProgramRun run = run_program({"check", path("stack.vtu"), "--json", "--merge", "1e-6"});
  EXPECT_NE(run.error.find("merged 16 nodes into others closer than 1e-06"), std::string::npos) << run.error;
  EXPECT_EQ(run.json()["parts"].size(), 1U);
  EXPECT_TRUE(run.json()["refused"].empty());
  const ProgramRun refused = run_program({"new", path("stack.vtu"), "-o", path("a")});
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_NE(refused.error.find("16 nodes lie at the place of another node"), std::string::npos)
      << refused.error;
  EXPECT_EQ(run_program({"new", path("stack.vtu"), "-o", path("a"), "--merge", "1e-6"}).exit_code, 0);
  EXPECT_EQ(read_inp(path("a/stack.inp")).num_nodes(), 80);
}

// `check`, `new` and `build` refuse the same meshes with the same words.
TEST_F(NewOrgan, RefusesPartsThatHangByACorner) {
  // Two blocks with node 8 in common.
  Model model =
      with_part(block_at({0, 0, 0}, {1, 1, 1}, {1, 1, 1}), block_at({1, 1, 1}, {1, 1, 1}, {1, 1, 1}));
  for (Tetrahedron& element : model.elements) {
    for (int& node : element.nodes()) node = node == 8 ? 7 : node;
  }
  write_mesh(mesh_from_model(model), {}, path("hung.vtu"));
  const std::string words = "hang on the rest by a corner or an edge and can turn";
  const std::string made = run_program({"new", path("hung.vtu"), "-o", path("a")}).error;
  EXPECT_NE(made.find(words), std::string::npos) << made;
  for (const std::vector<std::string>& fix : {std::vector<std::string>{}, {"--fix", "z<10%"}}) {
    std::vector<std::string> arguments = {"check", path("hung.vtu"), "--json"};
    arguments.insert(arguments.end(), fix.begin(), fix.end());
    const ProgramRun checked = run_program(arguments);
    EXPECT_EQ(checked.exit_code, 1);
    ASSERT_EQ(checked.json()["refused"].size(), 1U) << checked.out;
    const auto fault = checked.json()["refused"][0].get<std::string>();
    EXPECT_NE(made.find(fault), std::string::npos) << fault << made;
  }
  const std::string deck =
      dir_.write("hung.inp", inp_mesh_text(mesh_from_model(model)) +
                                 "*MATERIAL, NAME=SOFT\n*HYPERELASTIC, COMPRESSIBLE NEO "
                                 "HOOKE\n1, 4\n*SOLID SECTION, ELSET=ALL, MATERIAL=SOFT\n"
                                 "*BOUNDARY\n1, 1, 3\n2, 1, 3\n3, 1, 3\n")
          .string();
  dir_.write("hung.toml", "model = \"hung.inp\"\n[contact]\nsites = \"surface\"\nmax_displacement = 0.1\n");
  EXPECT_NE(refusal_of({"build", path("hung.toml"), "-o", path("hung.pack")}).find(words), std::string::npos);
  EXPECT_NE(run_program({"new", deck, "-o", path("b")}).error.find(words), std::string::npos);
}

TEST_F(NewOrgan, WarnsOfArraysItCannotTake) {
  MeshData mesh = mesh_from_model(read_inp_mesh(block()));
  const auto run_with = [&](std::vector<MeshArray> of_cells, std::vector<MeshArray> of_points) {
    mesh.cell_arrays = std::move(of_cells);
    mesh.point_arrays = std::move(of_points);
    write_mesh(mesh, {}, path("organ.vtu"));
    return run_program({"check", path("organ.vtu")});
  };
  const size_t cells = mesh.cells.size(), points = mesh.positions.size();
  const auto says = [](const std::string& text, const std::string& words) {
    EXPECT_NE(text.find(words), std::string::npos) << text;
  };
  says(run_with({{"E", 3, std::vector<double>(3 * cells, 1)}}, {}).error,
       "the array E has 3 components and is ignored");
  says(run_with({{"E", 1, std::vector<double>(cells, 1)}}, {{"E", 1, std::vector<double>(points, 2)}}).error,
       "cells and points have an array E, and that of the cells counts");
  says(run_with({{"E", 1, std::vector<double>(cells, 3000)}}, {}).out,
       "goes from 3000 to 3000, which in kPa, the unit with lengths in mm, no soft tissue has; if it is in "
       "Pa, multiply "
       "it by 0.001");
}

// Each part must be held, or the smaller ones are dropped on request.
TEST_F(NewOrgan, HoldsOrDropsSmallerParts) {
  const std::string organ = two_parts();
  const std::string message = refusal_of({"new", organ, "-o", path("a")});
  EXPECT_NE(
      message.find("the part with node 65 (27 nodes) can still move along x; hold more of it with --fix, or "
                   "drop the smaller parts with --keep largest"),
      std::string::npos)
      << message;
  EXPECT_EQ(run_program({"new", organ, "-o", path("held"), "--fix", "z<34%"}).exit_code, 0);
  EXPECT_EQ(read_inp(path("held/two.inp")).num_nodes(), 64 + 27);
  const ProgramRun kept = run_program({"new", organ, "-o", path("kept"), "--keep", "largest"});
  EXPECT_NE(kept.error.find("dropped 27 nodes and 48 elements"), std::string::npos) << kept.error;
  EXPECT_EQ(read_inp(path("kept/two.inp")).num_nodes(), 64);
}

// Two halves of 1 and 10 kPa come through a VTU file into the model of a build, in each unit.
TEST_F(NewOrgan, KeepsTheModuliOfArrays) {
  MeshData mesh = mesh_from_model(read_inp_mesh(block()));
  MeshArray young = {"E", 1, {}};
  for (size_t i = 0; i < mesh.cells.size(); ++i) young.values.push_back(i < 60 ? 1 : 10);
  mesh.cell_arrays = {young};
  write_mesh(mesh, {}, path("organ.vtu"));
  const ProgramRun checked = run_cleanly({"check", path("organ.vtu")});
  EXPECT_NE(checked.out.find("of this mesh as its array E says"), std::string::npos) << checked.out;
  const ProgramRun made = run_cleanly({"new", path("organ.vtu"), "-o", path("made")});
  EXPECT_NE(made.out.find("2 materials from the array E"), std::string::npos) << made.out;
  EXPECT_NE(made.out.find("E from 1 to 10, taken as kPa"), std::string::npos) << made.out;
  const LoadedScene scene = read_scene(path("made/organ.toml"));
  ASSERT_EQ(scene.model.materials.size(), 2U);
  for (size_t i = 0; i < mesh.cells.size(); ++i) {
    const Law& law = scene.model.materials[static_cast<size_t>(scene.model.elements[i].material)].law;
    const SmallStrainModuli moduli = small_strain_moduli(law);
    const double nu = moduli.poisson_ratio();
    EXPECT_NEAR(2 * moduli.shear * (1 + nu), i < 60 ? 1 : 10, 1e-4);
    EXPECT_NEAR(nu, 0.49, 1e-5);
    EXPECT_GE(scene.model.elements[i].volume_patch, 0);
  }
  const ProgramRun built =
      run_program({"build", path("made/organ.toml"), "-o", path("made/organ.pack"), "--survey", "none"});
  EXPECT_EQ(built.exit_code, 0) << built.error;
}

TEST_F(NewOrgan, DropsTheModuliOfDroppedParts) {
  MeshData mesh = read_mesh(two_parts());
  MeshArray young = {"E", 1, {}};
  const size_t num_dropped = 48;  // of the second part
  for (size_t i = 0; i < mesh.cells.size(); ++i)
    young.values.push_back(i + num_dropped < mesh.cells.size() ? 10 : 1);
  mesh.cell_arrays = {young};
  write_mesh(mesh, {}, path("soft.vtu"));
  EXPECT_EQ(run_program({"new", path("soft.vtu"), "-o", path("kept"), "--keep", "largest"}).exit_code, 0);
  const Model model = read_scene(path("kept/soft.toml")).model;
  ASSERT_EQ(model.materials.size(), 1U);
  const SmallStrainModuli moduli = small_strain_moduli(model.materials[0].law);
  EXPECT_NEAR(2 * moduli.shear * (1 + moduli.poisson_ratio()), 10, 1e-4);
}

TEST_F(NewOrgan, NamesSetsOfOneLaw) {
  MeshData mesh = mesh_from_model(read_inp_mesh(block()));
  mesh.element_sets.clear();
  MeshArray label = {"Region", 1, {}};
  for (size_t i = 0; i < mesh.cells.size(); ++i) label.values.push_back(i < 60 ? 3 : 5);
  mesh.cell_arrays = {label};
  write_mesh(mesh, {}, path("organ.vtu"));
  const ProgramRun made = run_cleanly({"new", path("organ.vtu"), "-o", path("made")});
  EXPECT_NE(made.out.find("one law for all element sets: REGION_3 (60), REGION_5 (75)"), std::string::npos)
      << made.out;
  EXPECT_EQ(read_inp(path("made/organ.inp")).element_sets.at("REGION_3").size(), 60U);
}

// A file with laws and supports keeps them: the scene names it.
TEST_F(NewOrgan, LeavesADeckAsItIs) {
  const std::string deck = block();
  const std::string before = file_text(deck);
  run_cleanly({"new", deck, "-o", path("made"), "--probe", "z>90%"});
  EXPECT_EQ(names_in(path("made")), std::vector<std::string>{"block.toml"});
  EXPECT_EQ(file_text(deck), before);
  const LoadedScene scene = read_scene(path("made/block.toml"));
  EXPECT_EQ(scene.scene.sites.size(), 16U);
  EXPECT_EQ(std::get<CompressibleNeoHookean>(scene.model.materials.front().law).lambda, 4);
  EXPECT_NE(refusal_of({"new", deck, "-o", path("b"), "--tissue", "liver"}).find("leave --tissue out"),
            std::string::npos);
}

TEST_F(NewOrgan, RefusesWithARemedy) {
  const std::string organ = bare_block();
  const auto says = [&](const std::vector<std::string>& arguments, const std::string& words) {
    const std::string message = refusal_of(arguments);
    EXPECT_NE(message.find(words), std::string::npos) << message;
  };
  says({"new", organ, "-o", path("a"), "--fix", "z<-50"}, "holds no node");
  says({"new", organ, "-o", path("a"), "--fix", "box 1,2,3"}, "give 6");
  says({"new", organ, "-o", path("a"), "--fix", "TOPP"}, "is no node set");
  says({"new", organ, "-o", path("a"), "--tissue", "cheese"}, "liver");
  says({"new", organ, "-o", path("a"), "--fix", "nearest 0,0,0,-1"}, "has a radius below 0");
  says({"check", organ, "--scale", "0"}, "--scale: must be above 0, not '0'");
  says({"check", organ, "--merge", "-1"}, "--merge: must be above 0, not '-1'");
  says({"check", block(), "--fix", "z<10%"}, "leave --fix out");
  dir_.write("notes.vtk", "minutes of a meeting\n");
  says({"convert", organ, path("notes.vtk")}, "exists, and cannot be read as VTK; remove it");
  run_cleanly({"convert", organ, path("own.vtk")});
  run_cleanly({"convert", organ, path("own.vtk")});
  for (const char* place : {"z <10%", "Z<10%", "Z < 10 %"})
    EXPECT_EQ(run_program({"check", organ, "--json", "--fix", place}).json()["fix"]["nodes"], 16) << place;
  says({"convert", organ, path("organ.xyz")}, "no mesh is written with this ending");
  says({"check", path("none.vtk")}, "none.vtk");
  dir_.write("surface.stl",
             "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
             "endloop\nendfacet\nendsolid s\n");
  says({"new", path("surface.stl"), "-o", path("a")}, "holds a surface alone: run `palpate mesh " +
                                                          path("surface.stl") + " --size 0.04 -o " +
                                                          path("surface.vtu") + "` first");
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
