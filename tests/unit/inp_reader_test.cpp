// What good model files mean, and that no file at all does worse than being refused.
#include "offline/mesh/inp_reader.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <limits>
#include <random>

#include "offline/mesh/element_faces.hpp"
#include "offline/mesh/input_error.hpp"
#include "tests/support/block_mesh.hpp"
#include "tests/support/inp_fixture.hpp"

namespace palpate {
namespace {

using test::kBody;
using test::kEnd;
using test::kStep;
using test::with_line;

class InpReader : public test::InpFile {};

TEST_F(InpReader, ReadsABody) {
  const Model model = read("*HEADING\nTwo tetrahedra\nmade by hand\n" + kBody);
  EXPECT_EQ(model.heading, "Two tetrahedra\nmade by hand");
  EXPECT_EQ(without_folder(model.file), "organ.inp");
  EXPECT_EQ(model.labels, (std::vector<int>{1, 2, 3, 4, 5}));
  EXPECT_EQ(model.positions[4], Eigen::Vector3d(1, 1, 1));
  ASSERT_EQ(model.elements.size(), 2U);
  EXPECT_EQ(model.elements[1].label, 2);
  EXPECT_TRUE(std::ranges::equal(model.elements[1].nodes(), std::array{1, 4, 2, 3}));
  ASSERT_EQ(model.materials.size(), 1U);
  EXPECT_EQ(model.materials[0].name, "TISSUE");
  const auto& law = std::get<CompressibleNeoHookean>(model.materials[0].law);
  EXPECT_EQ(law.mu, 0.48);
  EXPECT_EQ(law.lambda, 0.2);
  EXPECT_EQ(model.node_sets.at("BASE"), (std::vector<int>{0, 1, 2}));
  EXPECT_EQ(model.element_sets.at("BODY"), (std::vector<int>{0, 1}));
  ASSERT_EQ(model.fixed.size(), 9U);
  EXPECT_EQ(model.fixed[5].node, 1);
  EXPECT_EQ(model.fixed[5].axis, 2);
  EXPECT_TRUE(model.steps.empty());
  EXPECT_TRUE(model.warnings.empty());
  EXPECT_EQ(model.find_node(5), 4);
  EXPECT_EQ(model.find_node(6), -1);
}

TEST_F(InpReader, TakesAbaqusSpelling) {
  const Model model = read(
      "\xEF\xBB\xBF** made by a program\r\n"
      "*Heading\r\n"
      "*element,\r\n"
      "** between the parts of a keyword line\r\n"
      "   type = c3d4 , elset = Body\r\n"
      " 10, 1, 2,\r\n"
      "   3, 4\r\n"
      " 20,2,5,3,4,\r\n"
      "\r\n"
      "*Node , nset=\"All nodes\"\r\n"
      "1, , 0., -0.\r\n"
      "2, 1.0D0, 0\t, +0.0\r\n"
      "3, 0, 1e0, 0,\r\n"
      "4, 0,, +1.d+0\r\n"
      "5, 10.E-1, 1, 1\r\n"
      "*nset, nset=odd, generate\r\n"
      "1, 5, 2\r\n"
      "*NSET, NSET=Base\r\n"
      "odd, 2\r\n"
      "*NSET, NSET=base\r\n"
      "\"All nodes\",\r\n"
      "*elset, elset=first, generate\r\n"
      "10, 10\r\n"
      "*elset, elset=second\r\n"
      "20\r\n"
      "*SolidSection, elset=first, material=soft\r\n"
      "1.\r\n"
      "*solid  section, material=STIFF, elset=second\r\n"
      ",\r\n"
      "*material, name=Soft\r\n"
      "*hyperelastic, compressible neo hooke\r\n"
      "1, 4\r\n"
      "*material, name=Stiff\r\n"
      "*HYPERELASTIC, COMPRESSIBLE NEO HOOKE\r\n"
      "+2., -1.0E+0\r\n"
      "*boundary, op=mod\r\n"
      "odd, 1, 3, 0.\r\n"
      "2, pinned\r\n"
      "4, ENCASTRE\r\n"
      "4, 3\r\n"
      "4, 2,\r\n");
  EXPECT_EQ(model.positions[0], Eigen::Vector3d(0, 0, 0));
  EXPECT_EQ(model.positions[3], Eigen::Vector3d(0, 0, 1));
  EXPECT_EQ(model.positions[4], Eigen::Vector3d(1, 1, 1));
  EXPECT_EQ(model.node_sets.at("All nodes").size(), 5U);
  EXPECT_EQ(model.node_sets.at("ODD"), (std::vector<int>{0, 2, 4}));
  EXPECT_EQ(model.node_sets.at("BASE"), (std::vector<int>{0, 1, 2, 3, 4}));
  EXPECT_EQ(model.elements[0].label, 10);
  EXPECT_EQ(model.elements[0].material, 0);
  EXPECT_EQ(model.elements[1].material, 1);
  EXPECT_EQ(std::get<CompressibleNeoHookean>(model.materials[1].law).lambda, -1.0);
  EXPECT_EQ(model.fixed.size(), 15U);
}

TEST_F(InpReader, FollowsIncludes) {
  dir_.write("parts/nodes.inc", "3, 0, 1, 0\n4, 0, 0, 1\n*INCLUDE, INPUT=last.inc\n");
  dir_.write("parts/last.inc", "5, 1, 1, 1");
  const Model model =
      read(with_line(4, "*INCLUDE, INPUT=\"parts/nodes.inc\"", with_line(5, "", with_line(6, ""))));
  EXPECT_EQ(model.labels, (std::vector<int>{1, 2, 3, 4, 5}));
  EXPECT_EQ(model.node_sets.at("ALL").size(), 5U);
  EXPECT_EQ(model.files, (std::vector<std::string>{(dir_.path() / "organ.inp").string(),
                                                   (dir_.path() / "parts/nodes.inc").string(),
                                                   (dir_.path() / "parts/last.inc").string()}));

  EXPECT_EQ(refusal("*INCLUDE, INPUT=none.inc\n"),
            "organ.inp:1: *INCLUDE of none.inc: cannot be read (No such file or directory); check its name");
  EXPECT_EQ(refusal("*INCLUDE\n"), "organ.inp:1: *INCLUDE needs INPUT=...; add it");
  EXPECT_EQ(refusal("** me\n*INCLUDE, INPUT=organ.inp\n"),
            "organ.inp:2: *INCLUDE of organ.inp: the file includes itself; break the circle");
  dir_.write("bad.inc", "\n*PART\n1\n");
  EXPECT_EQ(refusal("*INCLUDE, INPUT=bad.inc\n"),
            "bad.inc:2: *PART is not supported; export the model as a flat input file, without parts and "
            "instances");
  for (int i = 0; i < 40; ++i) {
    dir_.write("deep" + std::to_string(i) + ".inc",
               "*INCLUDE, INPUT=deep" + std::to_string(i + 1) + ".inc\n");
  }
  EXPECT_EQ(refusal("*INCLUDE, INPUT=deep0.inc\n"),
            "deep30.inc:1: *INCLUDE of deep31.inc: files are nested more than 32 deep; flatten them");
}

TEST_F(InpReader, RefusesAFileThatIsNotThere) {
  const auto message = [&](const std::filesystem::path& file) {
    try {
      read_inp(file);
    } catch (const InputError& error) {
      return without_folder(error.what());
    }
    return std::string("accepted");
  };
  EXPECT_EQ(message(dir_.path() / "none.inp"),
            "none.inp: cannot be read (No such file or directory); check its name");
  EXPECT_EQ(message(dir_.path() / "."), ".: is a folder; name a file");
  EXPECT_EQ(refusal(""), "organ.inp: the model has no elements; add *ELEMENT, TYPE=C3D4");
}

TEST_F(InpReader, StepsCarryOver) {
  const Model model = read(kBody +
                           "*STEP, NLGEOM, INC=7\n"
                           "a title\n"
                           "*STATIC\n"
                           "0.5, 2., 1e-3, 0.8\n"
                           "*BOUNDARY\n"
                           "1, 3, 3, -0.1\n"  // moves a degree of freedom that is fixed before the steps
                           "4, 1, 1, 0.2\n"
                           "4, 1, 1, 0.2\n"
                           "*CLOAD\n"
                           "5, 2, 3.\n"
                           "4, 3, 1.\n"
                           "*CLOAD\n"
                           "5, 2, 4.\n"
                           "*NODE PRINT, NSET=ALL\n"
                           "U\n"
                           "*EL FILE\n"
                           "S, E\n"
                           "*END STEP\n"
                           "*STEP, NAME=second, NLGEOM=YES\n"
                           "*STATIC\n"
                           "*BOUNDARY, OP=MOD\n"
                           "4, 1\n"
                           "*CLOAD, OP=MOD\n"
                           "5, 2, -1.\n"
                           "*END STEP\n");
  ASSERT_EQ(model.steps.size(), 2U);
  const Step& first = model.steps[0];
  EXPECT_EQ(first.max_increments, 7);
  EXPECT_EQ(first.first_increment, 0.25);
  EXPECT_EQ(first.smallest_increment, 5e-4);
  EXPECT_EQ(first.largest_increment, 0.4);
  EXPECT_EQ(first.source.line, 18);
  ASSERT_EQ(first.prescribed.size(), 10U);
  EXPECT_EQ(first.prescribed[2].value, -0.1);
  EXPECT_EQ(first.prescribed[9].node, 3);
  EXPECT_EQ(first.prescribed[9].value, 0.2);
  ASSERT_EQ(first.forces.size(), 2U);
  EXPECT_EQ(first.forces[0].value, 1.0);
  EXPECT_EQ(first.forces[1].value, 7.0) << "forces of one step add up";
  const Step& second = model.steps[1];
  EXPECT_EQ(second.max_increments, 100);
  EXPECT_EQ(second.first_increment, 1.0);
  EXPECT_EQ(second.smallest_increment, 1e-5);
  EXPECT_EQ(second.largest_increment, 1.0);
  ASSERT_EQ(second.prescribed.size(), 10U);
  EXPECT_EQ(second.prescribed[2].value, -0.1) << "carried over";
  EXPECT_EQ(second.prescribed[9].value, 0.0);
  ASSERT_EQ(second.forces.size(), 2U);
  EXPECT_EQ(second.forces[0].value, 1.0) << "carried over";
  EXPECT_EQ(second.forces[1].value, -1.0) << "replaced";
  EXPECT_EQ(model.fixed.size(), 9U);
  ASSERT_EQ(model.warnings.size(), 2U);
  EXPECT_EQ(without_folder(model.warnings[0]),
            "organ.inp:31: *NODE PRINT is passed over: results are written for every node");
  EXPECT_EQ(without_folder(model.warnings[1]),
            "organ.inp:33: *EL FILE is passed over: results are written for every node");
}

TEST_F(InpReader, ReadsThePathThatRiksFollows) {
  const Model model = read(kBody +
                           "*STEP, NLGEOM\n*STATIC, RIKS\n0.5, 2., 1e-3, 4., 1.5, 5, 3, -0.25\n*CLOAD\n5, 3, "
                           "-1.\n*NODE PRINT, NSET=BASE\nU\n*NODE FILE, NSET=ALL\nU\n*END STEP\n");
  const Step& step = model.steps[0];
  EXPECT_EQ(step.period, 1);
  EXPECT_EQ(step.first_increment, 0.25);
  EXPECT_EQ(step.smallest_increment, 5e-4);
  EXPECT_EQ(step.largest_increment, 2);
  ASSERT_TRUE(step.riks.has_value());
  EXPECT_EQ(step.riks->end_load_factor, 1.5);
  EXPECT_EQ(step.riks->node, 4);
  EXPECT_EQ(step.riks->axis, 2);
  EXPECT_EQ(step.riks->end_displacement, -0.25);
  EXPECT_EQ(step.riks->watched, (std::vector<int>{0, 1, 2, 3, 4}));
  EXPECT_EQ(model.warnings.size(), 0U) << "the requests are heard";

  const Model plain = read(kBody + "*STEP, NLGEOM\n*STATIC, RIKS\n*CLOAD\n5, 3, 1\n*END STEP\n");
  const Step& defaults = plain.steps[0];
  EXPECT_EQ(defaults.first_increment, 1);
  EXPECT_EQ(defaults.smallest_increment, 1e-5);
  EXPECT_EQ(defaults.largest_increment, std::numeric_limits<double>::infinity());
  ASSERT_TRUE(defaults.riks.has_value());
  EXPECT_FALSE(defaults.riks->end_load_factor.has_value());
  EXPECT_EQ(defaults.riks->node, -1);
  EXPECT_FALSE(defaults.riks->end_displacement.has_value());
  EXPECT_FALSE(read(kBody + kStep + kEnd).steps[0].riks.has_value());
}

// The face of nodes 2, 3, 4 joins the two elements of kBody: face 3 of element 1, face 4 of element 2.
TEST_F(InpReader, ReadsDistributedLoads) {
  const std::string heavy = with_line(12, "*MATERIAL, NAME=TISSUE\n*DENSITY\n2.5");
  const Model model = read(heavy +
                           "*SURFACE, NAME=SKIN\n"
                           "BODY\n"
                           "*SURFACE, NAME=ONE, TYPE=ELEMENT\n"
                           "2, S1\n"
                           "2, S1\n" +
                           kStep +
                           "*DLOAD\n"
                           "BODY, GRAV, 9.81, 0, 0, -2\n"
                           "1, P2, 3.\n"
                           "*DSLOAD\n"
                           "SKIN, P, 0.5\n"
                           "*DSLOAD, FOLLOWER=NO, CONSTANT RESULTANT=YES\n"
                           "ONE, TRVEC, 2, 0, 3, 4\n" +
                           kEnd);
  EXPECT_EQ(model.materials[0].density, 2.5);
  const Step& step = model.steps[0];
  ASSERT_EQ(step.gravity.size(), 2U);
  EXPECT_EQ(step.gravity[1].element, 1);
  EXPECT_EQ(step.gravity[1].value, Eigen::Vector3d(0, 0, -9.81)) << "the direction is made a unit vector";
  ASSERT_EQ(step.pressures.size(), 7U) << "six outer faces, one of them pressed by both keywords";
  EXPECT_EQ(step.pressures[1].face, (FaceId{0, 1}));
  EXPECT_EQ(step.pressures[1].value + step.pressures[2].value, 3.5);
  EXPECT_EQ(step.pressures[2].face, (FaceId{0, 1}));
  EXPECT_EQ(step.pressures[3].face, (FaceId{0, 3})) << "the inner face is left out";
  ASSERT_EQ(step.tractions.size(), 1U);
  EXPECT_EQ(step.tractions[0].face, (FaceId{1, 0}));
  EXPECT_LE((step.tractions[0].value - Eigen::Vector3d(0, 1.2, 1.6)).norm(), 1e-15);

  const Model everywhere = read(heavy + kStep + "*DLOAD\n, GRAV, 9.81, 1, 0, 0\n" + kEnd);
  EXPECT_EQ(everywhere.steps[0].gravity.size(), 2U);
}

// Outward means: away from the corner that is not on the face, for P1 to P4 as Abaqus counts them.
TEST_F(InpReader, FacesAreThoseOfAbaqus) {
  const Model model = read(kBody);
  constexpr std::array<std::array<int, 3>, 4> kAbaqus = {{{1, 2, 3}, {1, 4, 2}, {2, 4, 3}, {3, 4, 1}}};
  const Tetrahedron& element = model.elements[0];
  for (int face = 0; face < 4; ++face) {
    const std::array<int, 6> nodes = outward_face(element, face);
    const auto at = [&](int i) {
      return model.positions[static_cast<std::size_t>(nodes[static_cast<std::size_t>(i)])];
    };
    std::array<int, 3> labels = {nodes[0] + 1, nodes[1] + 1, nodes[2] + 1};
    std::array<int, 3> expected = kAbaqus[static_cast<std::size_t>(face)];
    std::sort(labels.begin(), labels.end());
    std::sort(expected.begin(), expected.end());
    EXPECT_EQ(labels, expected);
    const Eigen::Vector3d centre(0.25, 0.25, 0.25);
    EXPECT_GT((at(1) - at(0)).cross(at(2) - at(0)).dot(at(0) - centre), 0);
  }
}

TEST_F(InpReader, AmplitudesAreTables) {
  const Model model = read(kBody +
                           "*AMPLITUDE, NAME=Up, TIME=TOTAL TIME\n"
                           "0, 0, 1, 2, 3, 2.5,\n"
                           "4, 0\n" +
                           kStep + "*CLOAD, AMPLITUDE=UP\n4, 3, 1\n" + kEnd);
  const Amplitude& amplitude = model.amplitudes[0];
  EXPECT_TRUE(amplitude.total_time);
  EXPECT_EQ(amplitude.at(-1), 0);
  EXPECT_EQ(amplitude.at(0.5), 1);
  EXPECT_EQ(amplitude.at(1), 2);
  EXPECT_EQ(amplitude.at(2), 2.25);
  EXPECT_EQ(amplitude.at(3.5), 1.25);
  EXPECT_EQ(amplitude.at(9), 0);
  EXPECT_EQ(model.steps[0].forces[0].amplitude, 0);
}

TEST_F(InpReader, StepsCarryOverReplaceAndRemove) {
  const std::string heavy = with_line(12, "*MATERIAL, NAME=TISSUE\n*DENSITY\n2.5");
  const Model model = read(
      heavy +
      "*AMPLITUDE, NAME=HERE\n0, 0, 2, 3\n*AMPLITUDE, NAME=ALWAYS, TIME=TOTAL TIME\n0, 0, 9, 9\n"
      "*STEP, NLGEOM\n*STATIC\n0.5, 2\n"
      "*CLOAD, AMPLITUDE=HERE\n4, 1, 1\n4, 2, 1\n"
      "*CLOAD, AMPLITUDE=ALWAYS\n4, 3, 1\n"
      "*DLOAD\nBODY, GRAV, 1, 1, 0, 0\n1, P1, 2\n" +
      kEnd + kStep + "*CLOAD\n4, 2, 5\n*DLOAD\n1, P1, 3\n" + kEnd + kStep +
      "*BOUNDARY, OP=NEW\n1, PINNED\n2, 2, 3\n5, 3\n*CLOAD, OP=NEW\n*DLOAD, OP=NEW\n2, GRAV, 4, 0, 1, 0\n" +
      kEnd);
  ASSERT_EQ(model.steps.size(), 3U);
  EXPECT_EQ(model.steps[1].start_time, 2);
  EXPECT_EQ(model.steps[2].start_time, 3);
  const std::vector<NodalForce>& carried = model.steps[1].forces;
  ASSERT_EQ(carried.size(), 3U);
  EXPECT_EQ(carried[0].value, 3) << "in step time a load stays at what it came to";
  EXPECT_EQ(carried[0].amplitude, kRamp);
  EXPECT_EQ(carried[1].value, 5) << "replaced";
  EXPECT_EQ(carried[2].value, 1);
  EXPECT_EQ(carried[2].amplitude, 1) << "total time goes on";
  EXPECT_EQ(model.steps[1].gravity.size(), 2U);
  ASSERT_EQ(model.steps[1].pressures.size(), 1U);
  EXPECT_EQ(model.steps[1].pressures[0].value, 3);
  const Step& last = model.steps[2];
  EXPECT_EQ(last.prescribed.size(), 6U);
  EXPECT_TRUE(last.forces.empty());
  EXPECT_TRUE(last.pressures.empty());
  ASSERT_EQ(last.gravity.size(), 1U);
  EXPECT_EQ(last.gravity[0].element, 1);
  EXPECT_EQ(model.fixed.size(), 9U) << "what is held before the first step does not change";
}

TEST_F(InpReader, WarnsOfMaterialsThatLock) {
  const auto warnings = [&](const std::string& lambda) {
    return read(with_line(14, "1, " + lambda)).warnings;
  };
  EXPECT_EQ(warnings("9").size(), 0U) << "nu = 0.45";
  ASSERT_EQ(warnings("49").size(), 1U);
  EXPECT_EQ(without_folder(warnings("49")[0]),
            "organ.inp: material TISSUE has a Poisson ratio of 0.49 at small strain; above 0.45 tetrahedra "
            "of four nodes lock, and forces come out too large; write MEAN DILATATION in its *SOLID SECTION, "
            "or mesh with C3D10H");
  const std::string sharing = "*SOLID SECTION, ELSET=BODY, MATERIAL=TISSUE, MEAN DILATATION";
  EXPECT_EQ(read(with_line(14, "1, 49", with_line(15, sharing))).warnings.size(), 0U);
}

TEST_F(InpReader, SharesVolumesWhereASectionAsksForIt) {
  for (const Tetrahedron& element : read(kBody).elements) EXPECT_EQ(element.volume_patch, -1);
  const Model all = read(with_line(15, "*Solid section, elset=BODY, material=TISSUE, mean dilatation"));
  EXPECT_EQ(all.elements[0].volume_patch, 0);
  EXPECT_EQ(all.elements[1].volume_patch, 0) << "two elements are one patch";
  const Model sections = read(
      with_line(15,
                "*ELSET, ELSET=ONE\n1\n*ELSET, ELSET=TWO\n2\n*SOLID SECTION, ELSET=ONE, MATERIAL=TISSUE\n"
                "*SOLID SECTION, ELSET=TWO, MATERIAL=TISSUE, MEAN DILATATION"));
  EXPECT_EQ(sections.elements[0].volume_patch, -1);
  EXPECT_EQ(sections.elements[1].volume_patch, 0);

  std::string text = test::block_inp(1, true);
  text.replace(text.find("C3D10"), 5, "C3D10H");
  const Model hybrid = read(text);
  for (size_t e = 0; e < hybrid.elements.size(); ++e)
    EXPECT_EQ(hybrid.elements[e].volume_patch, static_cast<int>(e));
}

TEST_F(InpReader, ReadsEveryLaw) {
  const auto law_of = [&](const std::string& keyword_and_data, const std::string& steps = "") {
    return read(with_line(13, keyword_and_data, with_line(14, "")) + steps).materials[0].law;
  };
  const auto invariant = [&](const std::string& text) { return std::get<InvariantLaw>(law_of(text)); };
  const InvariantLaw neo_hooke = invariant("*Hyperelastic, neo hooke\n0.24, 4");
  EXPECT_EQ(neo_hooke.c10, 0.24);
  EXPECT_EQ(neo_hooke.c01, 0);
  EXPECT_EQ(neo_hooke.volumetric.inverse_d, (std::array<double, 3>{0.25, 0, 0}));
  const InvariantLaw mooney = invariant("*HYPERELASTIC, MOONEY-RIVLIN\n0.24, 0.1, 2");
  EXPECT_EQ(mooney.c10, 0.24);
  EXPECT_EQ(mooney.c01, 0.1);
  EXPECT_EQ(mooney.volumetric.inverse_d, (std::array<double, 3>{0.5, 0, 0}));
  const InvariantLaw yeoh = invariant("*HYPERELASTIC, YEOH\n1, -0.1, 0.01, 2, 0, 8");
  EXPECT_EQ(yeoh.c10, 1);
  EXPECT_EQ(yeoh.c20, -0.1);
  EXPECT_EQ(yeoh.c30, 0.01);
  EXPECT_EQ(yeoh.volumetric.inverse_d, (std::array<double, 3>{0.5, 0, 0.125}));
  const Ogden ogden = std::get<Ogden>(law_of("*HYPERELASTIC, OGDEN, N=3\n1, 2, 3, 4, 5, -6, 2, 4\n8"));
  ASSERT_EQ(ogden.terms.size(), 3U);
  EXPECT_EQ(ogden.terms[2].mu, 5);
  EXPECT_EQ(ogden.terms[2].alpha, -6);
  EXPECT_EQ(ogden.volumetric.inverse_d, (std::array<double, 3>{0.5, 0.25, 0.125}));
  EXPECT_EQ(std::get<Ogden>(law_of("*HYPERELASTIC, OGDEN\n1, 2, 4")).terms.size(), 1U);

  const std::string elastic = "*ELASTIC, TYPE=ISO\n2.8, 0.4";
  EXPECT_NEAR(std::get<LinearElastic>(law_of(elastic)).mu, 1.0, 1e-15);
  EXPECT_NEAR(std::get<LinearElastic>(law_of(elastic, "*STEP\n*STATIC\n*END STEP\n")).lambda, 4.0, 1e-14);
  EXPECT_NEAR(std::get<StVenantKirchhoff>(law_of(elastic, kStep + kEnd)).lambda, 4.0, 1e-14);
  EXPECT_NEAR(std::get<StVenantKirchhoff>(law_of(elastic, kStep + kEnd + "*STEP\n*STATIC\n*END STEP\n")).mu,
              1.0, 1e-15)
      << "what follows a step with NLGEOM has it too";
}

TEST_F(InpReader, HoldsCountWhenEveryStepMakesThem) {
  const std::string loose = with_line(16, "", with_line(17, ""));
  EXPECT_EQ(refusal(loose),
            "organ.inp: the part with node 1 can still move along x; hold more of it with *BOUNDARY");
  EXPECT_EQ(refusal(loose + kStep + "*BOUNDARY\nBASE, 1, 3\n" + kEnd), "accepted");
  EXPECT_EQ(refusal(loose + kStep + kEnd + kStep + "*BOUNDARY\nBASE, 1, 3\n" + kEnd),
            "organ.inp: the part with node 1 can still move along x; hold more of it with *BOUNDARY");
}

TEST_F(InpReader, NamesTheMotionThatRemains) {
  const auto free = [](const std::string& motion) {
    return "organ.inp: the part with node 1 can still " + motion + "; hold more of it with *BOUNDARY";
  };
  EXPECT_EQ(refusal(with_line(17, "BASE, 2, 3")), free("move along x"));
  EXPECT_EQ(refusal(with_line(17, "BASE, 1, 2")), free("move along z"));
  EXPECT_EQ(refusal(with_line(17, "4, 1, 3")), free("turn about an axis along x"));
  EXPECT_EQ(refusal(with_line(17, "1, 1, 3\n4, 1, 3")), free("turn about an axis along z"));
  EXPECT_EQ(refusal(with_line(17, "1, 1, 3\n5, 1, 3")), free("move as a whole"));
  EXPECT_EQ(refusal(with_line(17, "1, 1, 3\n2, 2, 3\n3, 3")), "accepted");
}

TEST_F(InpReader, HoldsEachPart) {
  const std::string nodes = "5, 1, 1, 1\n6, 5, 0, 0\n7, 6, 0, 0\n8, 5, 1, 0\n9, 5, 0, 1";
  const std::string two_parts = with_line(6, nodes, with_line(8, "1, 1, 2, 3, 4\n3, 6, 7, 8, 9"));
  EXPECT_EQ(refusal(two_parts),
            "organ.inp: the part with node 6 can still move along x; hold more of it with *BOUNDARY");
  EXPECT_EQ(refusal(two_parts + "6, 1, 3\n7, 1, 3\n8, 3\n"), "accepted");
}

TEST_F(InpReader, WarnsOfPartsThatHangByACornerOrAnEdge) {
  const auto warning = [&](const std::string& nodes, const std::string& element) {
    const Model model = read(with_line(6, "5, 1, 1, 1\n" + nodes, with_line(9, "2, 2, 5, 3, 4\n" + element)));
    return model.warnings.empty() ? "none" : without_folder(model.warnings.front());
  };
  const auto hangs = [](const std::string& motion) {
    return "organ.inp: the elements at node 8 hang on the rest by a corner or an edge and can " + motion +
           "; join them face to face, or hold them with *BOUNDARY";
  };
  EXPECT_EQ(warning("6, 2, 1, 1\n7, 1, 2, 1\n8, 1, 1, 2", "3, 5, 6, 7, 8"),
            hangs("turn about an axis along x"));
  EXPECT_EQ(warning("6, 1, 1, 2\n7, 2, 1, 1.5", "3, 5, 6, 4, 7").substr(0, 20), "organ.inp: the eleme");
  // By a face it stands.
  EXPECT_EQ(warning("6, 2, 2, 1", "3, 2, 6, 3, 5"), "none");
}

TEST_F(InpReader, WarnsOfNodesWithoutElements) {
  const Model model = read(with_line(6, "5, 1, 1, 1\n99, 3, 3, 3\n98, 4, 4, 4"));
  ASSERT_EQ(model.warnings.size(), 1U);
  EXPECT_EQ(without_folder(model.warnings[0]),
            "organ.inp: 2 nodes belong to no element and stay where they are; the first is node 99");
}

// Whatever the bytes are, reading ends in a model or in an InputError of one line.
TEST_F(InpReader, SurvivesChangedBytes) {
  const std::string good = kBody + kStep + "0.1, 1.\n*BOUNDARY\n4, 1, 1, 0.2\n*CLOAD\n5, 2, 3.\n" + kEnd;
  std::mt19937 random(20050823);
  const auto below = [&](std::size_t n) { return static_cast<std::size_t>(random()) % n; };
  const std::string letters = "*,=\n\r\t \"-+.eED0123456789ABCNSTX";
  int refused = 0;
  constexpr int kRounds = 3000;
  for (int round = 0; round < kRounds; ++round) {
    std::string text = good;
    const std::size_t changes = 1 + below(6);
    for (std::size_t i = 0; i < changes; ++i) {
      const std::size_t at = below(text.size());
      switch (below(4)) {
        case 0:
          text[at] = static_cast<char>(below(256));
          break;
        case 1:
          text[at] = letters[below(letters.size())];
          break;
        case 2:
          text.erase(at, 1 + below(20));
          break;
        default:
          text.insert(at, text.substr(below(text.size()), below(40)));
          break;
      }
    }
    try {
      read(text);
    } catch (const InputError& error) {
      ++refused;
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
    }
  }
  EXPECT_GT(refused, kRounds / 2);
  EXPECT_LT(refused, kRounds);
}

}  // namespace
}  // namespace palpate
