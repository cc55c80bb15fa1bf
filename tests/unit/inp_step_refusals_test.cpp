// The .inp reader refuses every mistake in the steps of a file with a message that names the line.
#include <gtest/gtest.h>

#include "tests/support/inp_refusals_fixture.hpp"

namespace palpate::inp_refusals_fixture {
namespace inp_step_refusals_test {

using test::kBody;
using test::kEnd;
using test::kStep;

struct BadStep {
  const char* text;
  const char* message;
};

void PrintTo(const BadStep& bad, std::ostream* out) {
  *out << bad.text;
}

class BadSteps : public InpRefusals, public ::testing::WithParamInterface<BadStep> {};

TEST_P(BadSteps, IsRefusedByLine) {
  EXPECT_EQ(refusal(kBody + GetParam().text), GetParam().message);
}

INSTANTIATE_TEST_SUITE_P(
    InpRefusals, BadSteps,
    ::testing::Values(
        BadStep{"*STEP\n*STATIC\n*END STEP\n",
                "organ.inp:18: *STEP without NLGEOM asks for small strain, which the hyperelastic material "
                "TISSUE does not "
                "know; write *STEP, NLGEOM"},
        BadStep{"*STEP, NLGEOM=NO\n*STATIC\n*END STEP\n",
                "organ.inp:18: *STEP without NLGEOM asks for small strain, which the hyperelastic material "
                "TISSUE does not "
                "know; write *STEP, NLGEOM"},
        BadStep{"*STEP, NLGEOM, PERTURBATION\n",
                "organ.inp:18: *STEP, PERTURBATION is not supported; it asks for a linear answer about the "
                "state so far; write *STEP without NLGEOM in a file of its own"},
        BadStep{"*STEP, NLGEOM, INC=many\n",
                "organ.inp:18: INC=many is no number of increments; write 1 or more"},
        BadStep{"*STEP, NLGEOM, INC=0\n", "organ.inp:18: INC=0 is no number of increments; write 1 or more"},
        BadStep{"*STEP, NLGEOM\n*STATIC\n", "organ.inp:18: the file ends inside this step; add *END STEP"},
        BadStep{"*STEP, NLGEOM\n*STEP, NLGEOM\n",
                "organ.inp:19: *STEP inside the step of line 18; end that one with *END STEP"},
        BadStep{"*STEP, NLGEOM\n*END STEP\n",
                "organ.inp:19: the step of line 18 has no procedure; write *STATIC after *STEP"},
        BadStep{
            "*STEP, NLGEOM\n*STATIC, STABILIZE\n",
            "organ.inp:19: *STATIC, STABILIZE is not supported; write *STATIC, which steps automatically"},
        BadStep{"*STEP, NLGEOM\n*STATIC, RIKS\n*END STEP\n",
                "organ.inp:19: *STATIC, RIKS has no path to follow, as its step changes no load and moves "
                "nothing; add *CLOAD, *DLOAD, *DSLOAD or *BOUNDARY"},
        BadStep{"*STEP, NLGEOM\n*STATIC, RIKS\n*CLOAD\n4, 3, 1\n*END STEP\n*STEP, NLGEOM\n",
                "organ.inp:23: a step follows the *STATIC, RIKS of line 19, whose loads end at a factor that "
                "only "
                "the solve finds; make that step the last"},
        BadStep{"*STEP, NLGEOM\n*STATIC, RIKS\n-1\n",
                "organ.inp:20: arc lengths cannot be negative; correct them"},
        BadStep{"*STEP, NLGEOM\n*STATIC, RIKS\n2, 1\n",
                "organ.inp:20: the initial increment is longer than the total arc length; shorten it"},
        BadStep{"*STEP, NLGEOM\n*STATIC, RIKS\n1, 1, , , -2\n",
                "organ.inp:20: the largest load factor is not above 0; leave it out, or turn the load round"},
        BadStep{
            "*STEP, NLGEOM\n*STATIC, RIKS\n1, 1, , , , , 3, 1\n",
            "organ.inp:20: the node of the monitored displacement is missing; write it in the sixth field"},
        BadStep{
            "*STEP, NLGEOM\n*STATIC, RIKS\n1, 1, , , , 4, , 1\n",
            "organ.inp:20: the degree of freedom of the monitored node is missing; write 1 (x), 2 (y) or 3 "
            "(z) behind it"},
        BadStep{"*STEP, NLGEOM\n*STATIC, RIKS\n1, 1, , , , 9, 3, 1\n*CLOAD\n4, 3, 1\n*END STEP\n",
                "organ.inp:20: *STATIC, RIKS names node 9, which is not defined; define it with *NODE"},
        BadStep{"*AMPLITUDE, NAME=A\n0, 0, 1, 1\n*STEP, NLGEOM\n*STATIC, RIKS\n*CLOAD, AMPLITUDE=A\n4, 3, "
                "1\n*END STEP\n",
                "organ.inp:23: *STATIC, RIKS finds the factor of its loads itself; remove AMPLITUDE"},
        BadStep{
            "*AMPLITUDE, NAME=A, TIME=TOTAL TIME\n0, 0, 1, 1\n*STEP, NLGEOM\n*STATIC\n*CLOAD, "
            "AMPLITUDE=A\n4, 3, 1\n*END STEP\n*STEP, NLGEOM\n*STATIC, RIKS\n*CLOAD\n5, 3, 1\n*END STEP\n",
            "organ.inp:26: a load of an earlier step goes on in total time by amplitude A, but *STATIC, RIKS "
            "has no time; write that amplitude in step time"},
        BadStep{"*STEP, NLGEOM\n*STATIC\n*STATIC\n",
                "organ.inp:20: *STATIC is given twice in this step; keep one"},
        BadStep{"*STEP, NLGEOM\n*STATIC\n2, 1\n",
                "organ.inp:20: the initial increment is longer than the period; shorten it"},
        BadStep{"*STEP, NLGEOM\n*STATIC\n-1, 1\n",
                "organ.inp:20: increments and periods cannot be negative; correct them"},
        BadStep{"*STEP, NLGEOM\n*STATIC\n0.1, 1, 0.2\n",
                "organ.inp:20: the smallest increment is longer than the initial one; shorten it"},
        BadStep{"*STEP, NLGEOM\n*STATIC\n0.1, 1, 0.1, 0.05\n",
                "organ.inp:20: the largest increment is shorter than the smallest; lengthen it"},
        BadStep{"*STEP, NLGEOM\n*STATIC\n1,1,1,1,1\n",
                "organ.inp:20: expected initial increment, period, smallest, largest increment, found 5 "
                "fields; correct the line"},
        BadStep{"*STEP, NLGEOM\n*DYNAMIC\n", "organ.inp:19: *DYNAMIC is not supported; write *STATIC"},
        BadStep{"*STEP, NLGEOM\n*NODE\n",
                "organ.inp:19: *NODE stands after *STEP; move it before the first step"},
        BadStep{"*STEP, NLGEOM\n*STATIC\n*BOUNDARY\n4, 1, 1, 1\n4, 1, 1, 2\n*END STEP\n",
                "organ.inp:22: conflicting displacements of node 4 along x in one step; keep one"},
        BadStep{"*STEP, NLGEOM\n*STATIC\n*CLOAD\n4, 4, 1\n",
                "organ.inp:21: degree of freedom 4 does not exist in a solid; write 1 (x), 2 (y) or 3 (z)"},
        BadStep{"*STEP, NLGEOM\n*STATIC\n*CLOAD\n9, 3, 1\n*END STEP\n",
                "organ.inp:21: *CLOAD names node 9, which is not defined; define it with *NODE"},
        BadStep{"*STEP, NLGEOM\n*STATIC\n*CLOAD, FOLLOWER\n4, 3, 1\n",
                "organ.inp:20: *CLOAD, FOLLOWER is not supported; a force that turns with the body differs "
                "from one that does not; load its surface with *DSLOAD"},
        BadStep{"*STEP, NLGEOM\n*STATIC\n*CLOAD, OP=NEW\n4, 3, 1\n*CLOAD, OP=MOD\n4, 2, 1\n",
                "organ.inp:22: an earlier *CLOAD of this step has OP=NEW; write the same in all of them"},
        BadStep{"*STEP, NLGEOM\n*STATIC\n*CLOAD\n4, 3, 1\n*CLOAD, OP=NEW\n4, 2, 1\n",
                "organ.inp:22: an earlier *CLOAD of this step has OP=MOD; write the same in all of them"},
        BadStep{"*STEP, NLGEOM\n*STATIC\n*END STEP\n*STEP\n*STATIC\n*BOUNDARY, FIXED\n1, 1, 3\n4, 1, 3\n*END "
                "STEP\n",
                "organ.inp:25: *BOUNDARY, FIXED keeps node 4 along x where the step before leaves it, which "
                "only the solve finds; write the displacement, without FIXED"},
        BadStep{"*STEP, NLGEOM, AMPLITUDE=STEP\n",
                "organ.inp:18: *STEP, AMPLITUDE is not supported: loads grow over the step, as with "
                "AMPLITUDE=RAMP; name an *AMPLITUDE in the loads instead"},
        BadStep{"*RESTART, READ, STEP=2\n",
                "organ.inp:18: *RESTART, READ goes on from another run; write the model and all its steps in "
                "this file"},
        BadStep{"*INITIAL CONDITIONS, TYPE=STRESS\nBODY, 0, 0, 1.5\n",
                "organ.inp:19: *INITIAL CONDITIONS, TYPE=STRESS with values other than 0 is not supported: "
                "the body begins at rest, free of stress; bring it into this state by a first *STEP"},
        BadStep{"*SURFACE, NAME=TOP, TYPE=NODE\nBASE\n*STEP, NLGEOM\n*STATIC\n*DSLOAD\nTOP, P, 1\n",
                "organ.inp:23: surface TOP has nodes only, which no pressure acts on; define it by faces of "
                "elements"},
        BadStep{"*STEP, NLGEOM\n*STATIC\n*CLOAD, AMPLITUDE=A\n4, 3, 1\n",
                "organ.inp:20: amplitude A is not defined above this line; define it with *AMPLITUDE"},
        BadStep{"*STEP, NLGEOM\n*STATIC\n*DLOAD\nBODY, GRAV, 9.81, 0, 0, -1\n*END STEP\n",
                "organ.inp:21: gravity pulls at element 1, whose material TISSUE has no mass; add *DENSITY "
                "below *MATERIAL"},
        BadStep{"*STEP, NLGEOM\n*STATIC\n*DLOAD\nBODY, GRAV, 9.81\n",
                "organ.inp:21: the direction is zero; write its three components behind the magnitude"},
        BadStep{"*STEP, NLGEOM\n*STATIC\n*DLOAD\nBODY, P5, 1\n",
                "organ.inp:21: distributed load P5 is not supported; write P1 to P4 for a pressure on a "
                "face, or GRAV"},
        BadStep{"*STEP, NLGEOM\n*STATIC\n*DLOAD\n1, P1, 1, 0, 0, 1\n",
                "organ.inp:21: a pressure has no direction; remove what follows its magnitude"},
        BadStep{"*STEP, NLGEOM\n*STATIC\n*DLOAD\n1, P1,\n",
                "organ.inp:21: the magnitude is missing; write it in the third field"},
        BadStep{"*SURFACE, NAME=TOP\n1, S1\n*STEP, NLGEOM\n*STATIC\n*DSLOAD\nTOP, P, 1, 0, 0, 1\n",
                "organ.inp:23: a pressure has no direction; remove what follows its magnitude"},
        BadStep{"*SURFACE, NAME=TOP\n1, S1\n*STEP, NLGEOM\n*STATIC\n*DSLOAD, FOLLOWER=NO\nTOP, P, 1\n",
                "organ.inp:22: a pressure follows its surface; remove FOLLOWER, or write TRVEC"},
        BadStep{"*STEP, NLGEOM\n*STATIC\n*DLOAD\n1, P3, 1\n*END STEP\n",
                "organ.inp:21: *DLOAD names face 3 of element 1, which another element shares; only outer "
                "faces can be loaded"},
        BadStep{"*STEP, NLGEOM\n*STATIC\n*DLOAD\n9, P3, 1\n*END STEP\n",
                "organ.inp:21: *DLOAD names element 9, which is not defined; define it with *ELEMENT"},
        BadStep{"*STEP, NLGEOM\n*STATIC\n*DLOAD\n1, P1, 1\n1, P1, 2\n*END STEP\n",
                "organ.inp:22: conflicting pressures on face 1 of element 1 in one step; keep one"},
        BadStep{"*STEP, NLGEOM\n*STATIC\n*DSLOAD\nTOP, P, 1\n",
                "organ.inp:21: surface TOP is not defined above this line; define it with *SURFACE"},
        BadStep{"*SURFACE, NAME=TOP\n1, S3\n*STEP, NLGEOM\n*STATIC\n*DSLOAD\nTOP, P, 1\n*END STEP\n",
                "organ.inp:19: *SURFACE names face 3 of element 1, which another element shares; only outer "
                "faces can be loaded"},
        BadStep{
            "*SURFACE, NAME=TOP\n1, S1\n*STEP, NLGEOM\n*STATIC\n*DSLOAD\nTOP, TRVEC, 1, 1, 0, 0\n*END STEP\n",
            "organ.inp:22: a traction that turns or grows with its surface is not supported; write "
            "FOLLOWER=NO, CONSTANT "
            "RESULTANT=YES, or use a pressure"},
        BadStep{
            "*SURFACE, NAME=TOP\n1, S1\n*STEP, NLGEOM\n*STATIC\n*DSLOAD\nTOP, TRSHR, 1, 1, 0, 0\n*END STEP\n",
            "organ.inp:23: surface load TRSHR is not supported; write P or TRVEC"},
        BadStep{
            "*STEP, NLGEOM\n*STATIC\n*END STEP\n*STEP\n*STATIC\n*BOUNDARY, OP=NEW\n1, PINNED\n*END STEP\n",
            "organ.inp:21: the part with node 1 can still turn about an axis along x; hold more of it with "
            "*BOUNDARY"},
        BadStep{"*STEP, NLGEOM\n*STATIC\n*NODE PRINT, NSET=BAS\nU\n",
                "organ.inp:20: node set BAS is not defined above this line; did you mean BASE?"},
        BadStep{
            "*STEP, NLGEOM\n*STATIC\n*END STEP\n*BOUNDARY\n4, 1\n",
            "organ.inp:21: *BOUNDARY stands between two steps; move it into a step or before the first"}));

TEST_F(InpRefusals, RefusesALoadOnANodeWithoutElements) {
  EXPECT_EQ(refusal(with_line(6, "5, 1, 1, 1\n9, 3, 3, 3") + kStep + "*CLOAD\n9, 1, 1\n" + kEnd),
            "organ.inp:22: *CLOAD acts on node 9, which belongs to no element; load another");
}

}  // namespace inp_step_refusals_test
}  // namespace palpate::inp_refusals_fixture
