// The .inp reader: steps, loads and amplitudes.
#include <gtest/gtest.h>

#include "tests/support/inp_reader_fixture.hpp"

namespace palpate::inp_reader_fixture {
namespace inp_steps_test {

TEST_F(InpReader, StepsCarryOver) {
  const Model model = read(kBody +
                           "*STEP, NLGEOM, INC=7\n"
                           "a title\n"
                           "*STATIC\n"
                           "0.5, 2., 1e-3, 0.8\n"
                           "*BOUNDARY\n"
                           "1, 3, 3, -0.1\n"  // moves a dof that the model fixes
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

// The face of nodes 2, 3, 4 joins the elements of kBody: face 3 of element 1, face 4 of element 2.
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

// A face's normal points away from the corner that is not on the face. P1 to P4 follow Abaqus' numbering.
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

TEST_F(InpReader, HoldsCountWhenEveryStepMakesThem) {
  const std::string loose = with_line(16, "", with_line(17, ""));
  EXPECT_EQ(refusal(loose),
            "organ.inp: the part with node 1 can still move along x; hold more of it with *BOUNDARY");
  EXPECT_EQ(refusal(loose + kStep + "*BOUNDARY\nBASE, 1, 3\n" + kEnd), "accepted");
  EXPECT_EQ(refusal(loose + kStep + kEnd + kStep + "*BOUNDARY\nBASE, 1, 3\n" + kEnd),
            "organ.inp: the part with node 1 can still move along x; hold more of it with *BOUNDARY");
}

}  // namespace inp_steps_test
}  // namespace palpate::inp_reader_fixture
