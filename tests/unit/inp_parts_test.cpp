// The .inp reader: parts, instances and assemblies become one flat model.
#include <gtest/gtest.h>

#include "tests/support/inp_reader_fixture.hpp"

namespace palpate::inp_reader_fixture {
namespace inp_parts_test {

const std::string kPart =
    "*PART, NAME=Organ\n"                               // 1
    "*NODE\n"                                           // 2
    "1, 0, 0, 0\n2, 1, 0, 0\n3, 0, 1, 0\n4, 0, 0, 1\n"  // 3 to 6
    "*ELEMENT, TYPE=C3D4\n"                             // 7
    "1, 1, 2, 3, 4\n"                                   // 8
    "*NSET, NSET=Low, GENERATE\n1, 3\n"                 // 9, 10
    "*ELSET, ELSET=All\n1\n"                            // 11, 12
    "*SURFACE, NAME=Skin\nAll, S2\n1, S3\n"             // 13 to 15
    "*SOLID SECTION, ELSET=All, MATERIAL=Tissue\n,\n"   // 16, 17
    "*END PART\n";                                      // 18
const std::string kTissue = "*MATERIAL, NAME=Tissue\n*HYPERELASTIC, NEO HOOKE\n1, 0.5\n";

std::string assembly(const std::string& inside) {
  return kPart + "*ASSEMBLY, NAME=A\n" + inside + "*END ASSEMBLY\n" + kTissue;
}
std::string instance(const std::string& name, const std::string& pose = "") {
  return "*INSTANCE, NAME=" + name + ", PART=Organ\n" + pose + "*END INSTANCE\n";
}

TEST_F(InpReader, AnInstanceAtRestIsItsPart) {
  const std::string steps =
      "*BOUNDARY\nBase, ENCASTRE\n*STEP, NLGEOM\n*STATIC\n*BOUNDARY\n4, 3, 3, -0.1\n*END STEP\n";
  const Model parts = read(assembly(instance("One") + "*NSET, NSET=Base, INSTANCE=One\n1, 2, 3\n") + steps);
  std::string text = kPart.substr(kPart.find('\n') + 1);
  text.erase(text.find("*END PART"));
  const Model flat = read(text + "*NSET, NSET=Base\n1, 2, 3\n" + kTissue + steps);
  EXPECT_EQ(parts.labels, flat.labels);
  EXPECT_EQ(parts.positions, flat.positions);
  ASSERT_EQ(parts.elements.size(), 1U);
  EXPECT_EQ(parts.elements[0].label, 1);
  EXPECT_TRUE(std::ranges::equal(parts.elements[0].nodes(), flat.elements[0].nodes()));
  EXPECT_EQ(parts.fixed.size(), flat.fixed.size());
  EXPECT_EQ(parts.steps[0].prescribed.size(), flat.steps[0].prescribed.size());
  EXPECT_EQ(parts.node_sets.at("ONE.LOW"), flat.node_sets.at("LOW"));
  for (const auto& [name, members] : flat.node_sets) EXPECT_EQ(parts.node_sets.at(name), members) << name;
  for (const auto& [name, members] : flat.element_sets)
    EXPECT_EQ(parts.element_sets.at(name), members) << name;
  EXPECT_TRUE(parts.warnings.empty());
}

TEST_F(InpReader, InstancesAreShiftedThenTurned) {
  const Model model =
      read(assembly(instance("One") + instance("Two", "1, 0, 5\n0, 0, 0, 0, 0, 2, 90\n") +
                    instance("Three", "20\n10, 0, 0, 10, 0, 7, 180\n")) +
           "*BOUNDARY\nOne.Low, 1, 3\nTwo.Low, 1, 3\nThree.1, 1, 3\nThree.2, 1, 3\nThree.3, 3\n");
  EXPECT_EQ(model.labels, (std::vector<int>{1, 2, 3, 4, 11, 12, 13, 14, 21, 22, 23, 24}));
  // (x, y, z) -> (x + 1, y, z + 5) -> (-y, x + 1, z + 5)
  EXPECT_LT((model.positions[4] - Eigen::Vector3d(0, 1, 5)).norm(), 1e-14);
  EXPECT_LT((model.positions[5] - Eigen::Vector3d(0, 2, 5)).norm(), 1e-14);
  EXPECT_LT((model.positions[6] - Eigen::Vector3d(-1, 1, 5)).norm(), 1e-14);
  EXPECT_LT((model.positions[7] - Eigen::Vector3d(0, 1, 6)).norm(), 1e-14);
  // (x, y, z) -> (x + 20, y, z) -> (-x, -y, z) about the axis through x = 10
  EXPECT_LT((model.positions[9] - Eigen::Vector3d(-1, 0, 0)).norm(), 1e-14);
  EXPECT_EQ(model.elements[2].label, 21);
  EXPECT_EQ(model.elements[2].nodes()[3], 11);
  EXPECT_EQ(model.node_sets.count("LOW"), 0U) << "three instances have it";
  EXPECT_EQ(model.node_sets.at("TWO.LOW"), (std::vector<int>{4, 5, 6}));
  EXPECT_EQ(model.fixed.size(), 25U);
  ASSERT_EQ(model.warnings.size(), 1U);
  EXPECT_EQ(
      without_folder(model.warnings[0]),
      "organ.inp: labels of instances after the first are shifted, as they must differ: TWO by 10, THREE "
      "by 20");
}

TEST_F(InpReader, SetsAndSurfacesBelongToTheirInstance) {
  const Model model = read(
      assembly(instance("One") + instance("Two", "0, 0, 5\n") +
               "*NSET, NSET=Held, INSTANCE=One, INTERNAL\nLow\n*NSET, NSET=Held, INSTANCE=Two\n1, 2, 3\n"
               "*NSET, NSET=Low, INSTANCE=Two, GENERATE\n1, 2\n*ELSET, ELSET=Faces, INSTANCE=Two\n1\n"
               "*SURFACE, NAME=Top, TYPE=ELEMENT, INTERNAL\nFaces, S4\n") +
      "*BOUNDARY\nHeld, PINNED\n*STEP, NLGEOM\n*STATIC\n*DSLOAD\nOne.Skin, P, 1\nTop, P, 2\n*END STEP\n");
  EXPECT_EQ(model.node_sets.at("HELD"), (std::vector<int>{0, 1, 2, 4, 5, 6}));
  EXPECT_EQ(model.node_sets.at("LOW"), (std::vector<int>{4, 5})) << "the assembly's own";
  const std::vector<FacePressure>& pressures = model.steps[0].pressures;
  ASSERT_EQ(pressures.size(), 3U);
  EXPECT_EQ(pressures[0].face, (FaceId{0, 1}));
  EXPECT_EQ(pressures[1].face, (FaceId{0, 2}));
  EXPECT_EQ(pressures[2].face, (FaceId{1, 3}));
  EXPECT_EQ(pressures[2].value, 2);
}

// Abaqus writes the mesh of an independent instance into the instance.
TEST_F(InpReader, AnInstanceMayHaveItsOwnMesh) {
  std::string text = kPart;
  const std::string mesh = text.substr(text.find('\n') + 1, text.find("*END PART") - text.find('\n') - 1);
  text = "*PART, NAME=Organ\n*END PART\n*ASSEMBLY\n*INSTANCE, NAME=One, PART=Organ\n" + mesh +
         "*END INSTANCE\n*END ASSEMBLY\n" + kTissue + "*BOUNDARY\nOne.Low, 1, 3\n";
  const Model model = read(text);
  EXPECT_EQ(model.labels, (std::vector<int>{1, 2, 3, 4}));
  EXPECT_EQ(model.fixed.size(), 9U);
}

TEST_F(InpReader, RefusesBrokenAssemblies) {
  const std::string held = "*BOUNDARY\nOne.Low, 1, 3\n";
  EXPECT_EQ(refusal(assembly(instance("One")) + held), "accepted");
  EXPECT_EQ(refusal(kPart + kPart),
            "organ.inp:19: part ORGAN is already defined; give this one another name");
  EXPECT_EQ(refusal(assembly("*INSTANCE, NAME=One, PART=Orgn\n*END INSTANCE\n") + held),
            "organ.inp:20: part ORGN is not defined above this line; did you mean ORGAN?");
  EXPECT_EQ(refusal(assembly(instance("One") + instance("One")) + held),
            "organ.inp:22: instance ONE is already defined; give this one another name");
  EXPECT_EQ(refusal(assembly(instance("One", "1, 2, 3\n0, 0, 0, 0, 0, 0, 90\n")) + held),
            "organ.inp:22: the two points of the axis are the same; correct one of them");
  EXPECT_EQ(refusal(assembly(instance("One", "1, 2, 3\n0, 0, 1\n")) + held),
            "organ.inp:22: expected two points of the axis and the angle in degrees, found 3 fields; correct "
            "the line");
  EXPECT_EQ(refusal(assembly(instance("One") + "*NSET, NSET=Base\n1\n") + held),
            "organ.inp:23: a label in an assembly belongs to no instance; add INSTANCE= to the keyword");
  EXPECT_EQ(
      refusal(assembly(instance("One") + "*NODE\n1, 0, 0, 0\n") + held),
      "organ.inp:22: a node of an assembly, outside of its instances, is a reference point of rigid bodies "
      "or couplings, which are not supported; prescribe displacements of the instances' nodes instead");
  EXPECT_EQ(refusal(kPart + instance("One") + kTissue + held),
            "organ.inp:19: *INSTANCE stands outside of an assembly; move it between *ASSEMBLY and *END "
            "ASSEMBLY");
  EXPECT_EQ(refusal(kPart + "*ASSEMBLY\n" + instance("One") + kTissue + held),
            "organ.inp:20: the file ends inside this *ASSEMBLY; add *END ASSEMBLY");
  // The second *ASSEMBLY cuts the second instance short; surfaces of the first stay.
  EXPECT_EQ(refusal(kPart + "*ASSEMBLY\n" + instance("One") +
                    "*INSTANCE, NAME=Two, PART=No\n*ASSEMBLY\n*INSTANCE, NAME=Three, PART=No\n*END INSTANCE\n"
                    "*END ASSEMBLY\n"),
            "organ.inp:22: part NO is not defined above this line; define it with *PART");
  EXPECT_EQ(refusal(kPart + "*ASSEMBLY\n*INSTANCE, NAME=Two, PART=Organ\n*ASSEMBLY\n*END ASSEMBLY\n"),
            "organ.inp:21: *ASSEMBLY inside the *INSTANCE of line 20; end that one with *END INSTANCE");
  EXPECT_EQ(refusal(kPart + "*END PART\n"),
            "organ.inp:19: *END PART ends nothing, as no such keyword is open; remove it");
  EXPECT_EQ(
      refusal(kPart + "*ASSEMBLY\n*INSTANCE, NAME=One, PART=Organ\n*END ASSEMBLY\n"),
      "organ.inp:21: *END ASSEMBLY inside the *INSTANCE of line 20; end that one with *END INSTANCE first");
}

// Reading any bytes ends in a Model or in an InputError, each line of which names its place.
TEST_F(InpReader, SurvivesChangedBytesOfAssemblies) {
  const std::string good =
      assembly(instance("One") + instance("Two", "1, 0, 5\n0, 0, 0, 0, 0, 2, 90\n") +
               "*NSET, NSET=Held, INSTANCE=One, INTERNAL\nLow\n*NSET, NSET=Held, INSTANCE=Two\n1, 2, 3\n"
               "*SURFACE, NAME=S, TYPE=NODE\nOne.1\nTwo.Low\n") +
      "*TIE, NAME=T\nOne.Skin, Two.Skin\n*BOUNDARY\nHeld, XSYMM\nHeld, 2, 6\n" + kStep +
      "*BOUNDARY, FIXED\nHeld, 1\n*DSLOAD\nOne.Skin, P, 1\n" + kEnd;
  EXPECT_NE(refusal(good).find("*TIE: surface TWO.SKIN has no node at the place"), std::string::npos);
  std::mt19937 random(20050824);
  const auto below = [&](std::size_t n) { return static_cast<std::size_t>(random()) % n; };
  int accepted = 0;
  constexpr int kRounds = 2000;
  for (int round = 0; round < kRounds; ++round) {
    std::string text = good;
    // Lines go, come twice or change their places; letters change.
    const auto line = [&] {
      const std::size_t begin = text.rfind('\n', below(text.size()));
      return begin == std::string::npos ? 0 : begin + 1;
    };
    if (round % 2 == 0)
      text.erase(text.find("*TIE"), std::string("*TIE, NAME=T\nOne.Skin, Two.Skin\n").size());
    for (std::size_t i = below(4); i > 0; --i) {
      const std::size_t begin = line();
      const std::size_t end = std::min(text.find('\n', begin), text.size() - 1) + 1;
      const std::string taken = text.substr(begin, end - begin);
      if (below(2) == 0) text.erase(begin, end - begin);
      if (below(2) == 0 && !text.empty()) text.insert(line(), taken);
      if (below(4) == 0 && !text.empty()) text[below(text.size())] = static_cast<char>(below(256));
    }
    const std::string message = refusal(text);
    accepted += message == "accepted";
    std::istringstream lines(message);
    for (std::string one; message != "accepted" && std::getline(lines, one);)
      EXPECT_TRUE(one.starts_with("organ.inp")) << message;
  }
  EXPECT_GT(accepted, kRounds / 10);
  EXPECT_LT(accepted, kRounds * 9 / 10);
}

// A short file may not fill the memory.
TEST_F(InpReader, BoundsTheSizeOfAllInstances) {
  std::string text = "*PART, NAME=Organ\n*NODE\n";
  for (int i = 1; i <= 1000; ++i) text += std::to_string(i) + "\n";
  text += "*END PART\n*ASSEMBLY\n";
  for (int i = 0; i < 5001; ++i) text += instance("I" + std::to_string(i));
  EXPECT_EQ(
      refusal(text + "*END ASSEMBLY\n"),
      "organ.inp:11005: the instances have together more than 5000000 nodes and elements, the limit; leave "
      "some of them out");
}

TEST_F(InpReader, LabelsOfInstancesStayIntegers) {
  std::string text = assembly(instance("One") + instance("Two", "0, 0, 5\n"));
  const std::string far = "2000000000, 9, 9, 9\n";
  text.insert(text.find("*ELEMENT"), far);
  EXPECT_EQ(
      refusal(text),
      "organ.inp:25: the labels of instance TWO do not fit behind 2000000000, the largest label before; "
      "number the nodes and elements of its part from 1");
  std::string in_set = assembly(instance("One") + instance("Two", "0, 0, 5\n"));
  in_set.insert(in_set.find("*SURFACE"), "*NSET, NSET=Far\n2147483647\n");
  EXPECT_EQ(
      refusal(in_set),
      "organ.inp:14: node set ONE.FAR names node 2147483647, which is not defined; define it with *NODE");
}

}  // namespace inp_parts_test
}  // namespace palpate::inp_reader_fixture
