// The .inp reader: lines that pre-processors write along, lists of refusals, and other names of laws.
#include <gtest/gtest.h>

#include "tests/support/inp_reader_fixture.hpp"

namespace palpate::inp_reader_fixture {
namespace inp_decks_test {

TEST_F(InpReader, ThrowsAllRefusalsTogether) {
  // Line 12 loses the material and line 10 the node set; neither is refused again where the file uses it.
  std::string text = with_line(2, "1, 0, zero, 0", with_line(10, "*NSET, NSET=BASE, ALL", kBody));
  text = with_line(12, "*MATERIAL, NAME=TISSUE, TYPE=SOFT", text);
  EXPECT_EQ(
      refusal(text + "*STEP, NLGEOM, INC=no\n*STATIC\n*CLOAD\n4, 4, 1\n*COUPLING\n1\n*END STEP\n"),
      "organ.inp:2: 'zero' is not a finite number; correct it\n"
      "organ.inp:10: *NSET, ALL is not supported; remove it only where the result stays the same without "
      "it\n"
      "organ.inp:12: *MATERIAL, TYPE is not supported; remove it only where the result stays the same "
      "without it\n"
      "organ.inp:18: INC=no is no number of increments; write 1 or more\n"
      "organ.inp:21: degree of freedom 4 does not exist in a solid; write 1 (x), 2 (y) or 3 (z)\n"
      "organ.inp:22: *COUPLING is not supported; without it the body is soft there; prescribe the motion "
      "of its nodes with *BOUNDARY");
}

TEST_F(InpReader, CountsTheRefusalsThatItDoesNotShow) {
  std::string text = kBody;
  for (int i = 0; i < 23; ++i) text += "*MPC\n";
  const std::string message = refusal(text);
  EXPECT_EQ(std::count(message.begin(), message.end(), '\n'), 20);
  EXPECT_TRUE(message.ends_with("\nand 3 more")) << message;
  for (int i = 0; i < 2000; ++i) text += "*MPC\n";
  EXPECT_TRUE(refusal(text).ends_with("\nand 980 more, where the reading ended"));
}

// A refused keyword of a step or a material takes its place, so that its followers are no refusals.
TEST_F(InpReader, AFaultIsRefusedOnce) {
  const auto lines = [&](const std::string& text) {
    const std::string message = refusal(text);
    return 1 + std::count(message.begin(), message.end(), '\n');
  };
  for (const char* step : {"*STEP, NLGEOM, X=1\n", "*STPE, NLGEOM\n", "*STEP, NLGEOM=MAYBE\n"})
    EXPECT_EQ(lines(kBody + step + "*STATIC\n*CLOAD\n4, 1, 1\n*END STEP\n"), 1) << step;
  for (const char* procedure : {"*STATIC, X\n", "*DYNAMIC\n", "*STATIC\n-1\n"})
    EXPECT_EQ(lines(kBody + "*STEP, NLGEOM\n" + procedure + "*CLOAD\n4, 1, 1\n*END STEP\n"), 1) << procedure;
  EXPECT_EQ(lines(with_line(12, "*MATERIEL, NAME=TISSUE")), 1);
  EXPECT_EQ(lines(with_line(12, "*MATERIAL, NAME=TISSUE\n*EXPANSION\n1e-5\n*DENSITY\n1")), 1);
  EXPECT_EQ(lines(with_line(7, "*ELEMENT, TYPE=C3D8, ELSET=BODY")), 1);
  EXPECT_EQ(lines("*INCLUDE, INPUT=none.inc\n" + kBody + "9, 9\n*X\n"), 1) << "most would be undefined";
}

TEST_F(InpReader, PassesOverWhatChangesNoResult) {
  const Model plain = read(kBody + "*STEP, NLGEOM\n*STATIC\n0.5, 1\n*CLOAD\n4, 1, 1\n*END STEP\n");
  const Model model =
      read("*PREPRINT, ECHO=NO\n" +
           with_line(10, "*NSET, NSET=BASE, INTERNAL, UNSORTED", with_line(17, "BASE, 1, 6\n4, 5, 5, 0.")) +
           "*PHYSICAL CONSTANTS, ABSOLUTE ZERO=0\n"
           "*INITIAL CONDITIONS, TYPE=STRESS\nBODY, 0., 0., 0.\n"
           "*INITIAL CONDITIONS, TYPE=TEMPERATURE\nALL, 293.15\n"
           "*STEP, NLGEOM, EXTRAPOLATION=NO\n*STATIC, DIRECT, SOLVER=SPOOLES\n0.5, 1\n"
           "*CONTROLS, PARAMETERS=FIELD\n0.005\n"
           "*CLOAD\n4, 1, 1\n"
           "*RESTART, WRITE, FREQUENCY=0\n*OUTPUT, FIELD\n*NODE OUTPUT\nU, RF\n"
           "*ELEMENT OUTPUT, DIRECTIONS=YES\nS\n*OUTPUT, HISTORY\n*ENERGY OUTPUT\n"
           "*CONTACT OUTPUT\n*EL PRINT, ELSET=BODY\nS\n*CONTACT FILE\n*CONTACT PRINT\n"
           "*SECTION PRINT, SURFACE=S\n*MONITOR, DOF=1\n*END STEP\n");
  ASSERT_EQ(model.warnings.size(), 1U);
  EXPECT_EQ(
      without_folder(model.warnings[0]),
      "organ.inp: passed over, as they change no result: *PREPRINT, INTERNAL of *NSET, UNSORTED of *NSET, "
      "rotations of *BOUNDARY (2), *PHYSICAL CONSTANTS, *INITIAL CONDITIONS (2), EXTRAPOLATION of *STEP, "
      "DIRECT of *STATIC, SOLVER of *STATIC, *CONTROLS, *RESTART, *OUTPUT (2), *NODE OUTPUT, *ELEMENT "
      "OUTPUT, *ENERGY OUTPUT, *CONTACT OUTPUT, *EL PRINT, *CONTACT FILE, *CONTACT PRINT, *SECTION PRINT, "
      "*MONITOR");
  EXPECT_EQ(model.fixed.size(), plain.fixed.size());
  ASSERT_EQ(model.steps.size(), 1U);
  EXPECT_EQ(model.steps[0].first_increment, plain.steps[0].first_increment);
  EXPECT_EQ(model.steps[0].prescribed.size(), plain.steps[0].prescribed.size());
}

TEST_F(InpReader, TheFirstKeywordOfAStepRemovesForAll) {
  const Model model = read(kBody + kStep +
                           "*BOUNDARY, OP=NEW\n*BOUNDARY\nBASE, 1, 3\n*BOUNDARY\n4, 3, 3, -0.3\n"
                           "*CLOAD, OP=NEW\n*DLOAD, OP=NEW\n" +
                           kEnd);
  ASSERT_EQ(model.steps[0].prescribed.size(), 10U);
  EXPECT_EQ(model.steps[0].prescribed[9].value, -0.3);
}

TEST_F(InpReader, DropsElementsThatCarryNothing) {
  const std::string surfaces =
      "*ELEMENT, TYPE=T3D2, ELSET=LINE1\n11, 1, 2\n"
      "*ELEMENT, TYPE=CPS6, ELSET=SKIN\n12, 1, 2, 3, 4,\n5, 1\n13, 1, 2, 3, 4, 5, 2\n"
      "*ELSET, ELSET=MIXED\n2, 13\n";
  const auto with = [&](const std::string& more) {
    return with_line(10, surfaces + more + "*NSET, NSET=BASE");
  };
  const Model model = read(with(""));
  EXPECT_EQ(model.elements.size(), 2U);
  EXPECT_TRUE(model.element_sets.at("SKIN").empty());
  EXPECT_TRUE(model.element_sets.at("LINE1").empty());
  EXPECT_EQ(model.element_sets.at("MIXED"), (std::vector<int>{1}));
  ASSERT_EQ(model.warnings.size(), 1U);
  EXPECT_EQ(
      without_folder(model.warnings[0]),
      "organ.inp: dropped elements, as they are no solids and no section, surface or load refers to them: "
      "2 of type CPS6, 1 of type T3D2");
  const auto refers = [](int line, const std::string& keyword) {
    return "organ.inp:" + std::to_string(line) + ": " + keyword +
           " refers to element 13 of type CPS6, which is no tetrahedron; take it out, and mesh the body with "
           "tetrahedra";
  };
  EXPECT_EQ(refusal(with("*SOLID SECTION, ELSET=SKIN, MATERIAL=TISSUE\n")), refers(18, "*SOLID SECTION"));
  EXPECT_EQ(refusal(with("*SURFACE, NAME=S\n1, S1\nMIXED, S1\n")), refers(20, "*SURFACE"));
  EXPECT_EQ(refusal(with("") + kStep + "*DLOAD\n13, P1, 1\n" + kEnd), refers(29, "*DLOAD"));
  EXPECT_EQ(refusal(with("*ELEMENT, TYPE=S3\n2, 1, 2, 3\n")),
            "organ.inp:19: element 2 is already defined at organ.inp:9; give one of them another label");
  EXPECT_EQ(refusal(with("*ELSET, ELSET=X\n13, 14\n")),
            "organ.inp:19: element set X names element 14, which is not defined; define it with *ELEMENT");
}

TEST_F(InpReader, ASurfaceIsNoBody) {
  EXPECT_EQ(refusal("*NODE\n1\n2, 1\n3, 1, 1\n*ELEMENT, TYPE=S3\n1, 1, 2, 3\n"),
            "organ.inp:6: the model has elements of lines and surfaces alone (1 of type S3); mesh its inside "
            "with tetrahedra, TYPE=C3D4");
}

TEST_F(InpReader, ReadsModifiedElementsAsTheirPlainOnes) {
  std::string text = test::block_inp(1, true);
  const Model plain = read(text);
  text.replace(text.find("C3D10"), 5, "C3D10M");
  const Model modified = read(text);
  ASSERT_EQ(modified.elements.size(), plain.elements.size());
  EXPECT_TRUE(std::ranges::equal(modified.elements[0].nodes(), plain.elements[0].nodes()));
  EXPECT_EQ(modified.elements[0].volume_patch, -1);
  ASSERT_EQ(modified.warnings.size(), plain.warnings.size() + 1);
  EXPECT_NE(modified.warnings[0].find("C3D10M are read as C3D10"), std::string::npos);
}

TEST_F(InpReader, AbsentCoordinatesAreZero) {
  const Model model = read(with_line(2, "1", with_line(3, "2, 1.", with_line(4, "3, 0, 1"))));
  EXPECT_EQ(model.positions[0], Eigen::Vector3d(0, 0, 0));
  EXPECT_EQ(model.positions[1], Eigen::Vector3d(1, 0, 0));
  EXPECT_EQ(model.positions[2], Eigen::Vector3d(0, 1, 0));
  ASSERT_EQ(model.warnings.size(), 1U);
  EXPECT_EQ(without_folder(model.warnings[0]),
            "organ.inp: 3 nodes have fewer than three coordinates; the absent ones are 0");
}

TEST_F(InpReader, SymmetryHoldsTheNormal) {
  const Model model = read(kBody + "4, XSYMM\n4, ZSYMM\n5, YSYMM\n*BOUNDARY, TYPE=DISPLACEMENT\n5, 3\n");
  std::vector<std::pair<int, int>> held;
  for (const PrescribedDisplacement& fixed : model.fixed) {
    if (fixed.node > 2) held.emplace_back(fixed.node, fixed.axis);
  }
  EXPECT_EQ(held, (std::vector<std::pair<int, int>>{{3, 0}, {3, 2}, {4, 1}, {4, 2}}));
}

TEST_F(InpReader, FixedKeepsTheValueOfTheStepBefore) {
  const Model model = read(
      kBody + "*AMPLITUDE, NAME=HALF\n0, 0, 1, 0.5\n*AMPLITUDE, NAME=TOTAL, TIME=TOTAL TIME\n0, 0, 10, 1\n" +
      kStep +
      "*BOUNDARY\n4, 3, 3, -0.3\n5, 3, 3, 0.1\n*BOUNDARY, AMPLITUDE=HALF\n4, 2, 2, 0.4\n"
      "*BOUNDARY, AMPLITUDE=TOTAL\n4, 1, 1, 7\n" +
      kEnd + "*STEP\n*STATIC\n*BOUNDARY, OP=NEW, FIXED\nBASE, 1, 3\n4, 1, 3, 99\n" + kEnd);
  ASSERT_EQ(model.steps[1].prescribed.size(), 12U);
  const auto& kept = model.steps[1].prescribed;
  EXPECT_EQ(kept[0].value, 0);
  EXPECT_NEAR(kept[9].value, 0.7, 1e-15);
  EXPECT_NEAR(kept[10].value, 0.2, 1e-15);
  EXPECT_EQ(kept[11].value, -0.3);
  EXPECT_EQ(kept[9].amplitude, kRamp);
}

// Two bodies touch in a face, each with its own nodes.
TEST_F(InpReader, TiedSurfacesGetCommonNodes) {
  const std::string apart =
      with_line(6, "5, 1, 1, 1\n12, 1, 0, 1e-7\n13, 0, 1, 0\n14, 0, 0, 1", with_line(9, "2, 12, 5, 13, 14"));
  const std::string faces = "*SURFACE, NAME=UP\n2, S4\n*SURFACE, NAME=DOWN\n1, S3\n";
  const std::string nodes =
      "*NSET, NSET=X\n12, 13\n*SURFACE, NAME=UP, TYPE=NODE\nX\n14, 0.5\n*SURFACE, NAME=DOWN\n1\n";
  const auto tied = [&](const std::string& surfaces, const std::string& names) {
    return apart + surfaces + "*TIE, NAME=T, POSITION TOLERANCE=0.1\n" + names + "\n" + kStep +
           "*CLOAD\n14, 1, 1\n" + kEnd;
  };
  const Model joined = read(kBody);
  for (const std::string& surfaces : {faces, nodes}) {
    const Model model = read(tied(surfaces, "UP, DOWN"));
    EXPECT_EQ(model.labels, joined.labels);
    EXPECT_EQ(model.positions, joined.positions);
    EXPECT_TRUE(std::ranges::equal(model.elements[1].nodes(), joined.elements[1].nodes()));
    EXPECT_EQ(model.find_node(14), 3);
    EXPECT_EQ(model.steps[0].forces[0].node, 3);
    ASSERT_EQ(model.warnings.size(), 1U);
    EXPECT_NE(model.warnings[0].find("*TIE: 3 nodes of surface UP become the nodes of DOWN at their places"),
              std::string::npos)
        << model.warnings[0];
  }
  EXPECT_EQ(read(tied(nodes, "UP, DOWN")).node_sets.at("X"), (std::vector<int>{1, 2}));
  EXPECT_EQ(refusal(tied(faces, "UP, UP")),
            "organ.inp:26: *TIE joins a surface to itself; name the surfaces of the two bodies");
  EXPECT_EQ(refusal(tied(faces, "UP, DWN")),
            "organ.inp:26: surface DWN is not defined above this line; did you mean DOWN?");
  const auto partners = [](const std::string& number) {
    return "organ.inp:26: *TIE: surface DOWN has " + number +
           " at the place of node 12 of surface UP; only surfaces with nodes at the same places, one to one, "
           "are joined: mesh both bodies together";
  };
  EXPECT_EQ(
      refusal(tied("*SURFACE, NAME=UP\n2, S4\n*SURFACE, NAME=DOWN\n1, S1\n", "UP, DOWN")),
      "organ.inp:26: *TIE: surface DOWN has no node at the place of node 14 of surface UP; only surfaces "
      "with nodes at the same places, one to one, are joined: mesh both bodies together");
  EXPECT_EQ(refusal(tied("*SURFACE, NAME=UP\n2, S4\n*SURFACE, NAME=DOWN\nBODY\n", "UP, DOWN")),
            partners("several nodes"));
}

TEST_F(InpReader, KnowsLawsByTheirOtherNames) {
  const auto law = [&](const std::string& keyword_and_data) {
    return std::get<InvariantLaw>(read(with_line(13, keyword_and_data, with_line(14, ""))).materials[0].law);
  };
  const auto expect_same = [&](const std::string& one, const std::string& other) {
    const InvariantLaw a = law("*HYPERELASTIC, " + one);
    const InvariantLaw b = law("*HYPERELASTIC, " + other);
    EXPECT_EQ(std::tuple(a.c10, a.c01, a.c20, a.c30), std::tuple(b.c10, b.c01, b.c20, b.c30)) << one;
    EXPECT_EQ(a.volumetric.inverse_d, b.volumetric.inverse_d) << one;
  };
  expect_same("POLYNOMIAL\n1, 0.5, 2", "MOONEY-RIVLIN\n1, 0.5, 2");
  expect_same("N=1, POLYNOMIAL, MODULI=LONG TERM\n1, 0.5, 2", "MOONEY-RIVLIN\n1, 0.5, 2");
  expect_same("REDUCED POLYNOMIAL\n1, 2", "NEO HOOKE, MODULI=INSTANTANEOUS\n1, 2");
  expect_same("REDUCED POLYNOMIAL, N=2\n1, 0.5, 2, 4", "YEOH\n1, 0.5, 0, 2, 4");
  expect_same("REDUCED POLYNOMIAL, N=3\n1, 0.5, 0.25, 2, 4, 8", "YEOH\n1, 0.5, 0.25, 2, 4, 8");
}

}  // namespace inp_decks_test
}  // namespace palpate::inp_reader_fixture
