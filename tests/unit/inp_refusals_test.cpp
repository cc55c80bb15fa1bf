// The .inp reader refuses every mistake in a model file with a message that names the line.
#include <gtest/gtest.h>

#include "tests/support/inp_refusals_fixture.hpp"

namespace palpate::inp_refusals_fixture {
namespace inp_refusals_test {

struct BadLine {
  int line;
  const char* replacement;
  const char* message;
};

void PrintTo(const BadLine& bad, std::ostream* out) {
  *out << bad.line << ": " << bad.replacement;
}

class BadBody : public InpRefusals, public ::testing::WithParamInterface<BadLine> {};

TEST_P(BadBody, IsRefusedByLine) {
  EXPECT_EQ(refusal(with_line(GetParam().line, GetParam().replacement)), GetParam().message);
}

INSTANTIATE_TEST_SUITE_P(
    InpRefusals, BadBody,
    ::testing::Values(
        BadLine{1, "*NOED", "organ.inp:1: *NOED is not supported; did you mean *NODE?"},
        BadLine{1, "*FREQUENCY",
                "organ.inp:1: *FREQUENCY is not supported; Palpate finds equilibria, without inertia and "
                "rates; write *STATIC"},
        BadLine{1, "*VOLUMETRIC TEST DATA",
                "organ.inp:1: *VOLUMETRIC TEST DATA is not supported; remove it only where the result stays "
                "the same without it"},
        BadLine{1, "*Part, name=liver\n*NODE, NSET=ALL",
                "organ.inp:13: *MATERIAL stands inside the *PART of line 1; move it behind *END PART"},
        BadLine{1, "*NODE, SYSTEM=C",
                "organ.inp:1: *NODE, SYSTEM is not supported; cylindrical or spherical coordinates would be "
                "read as x, y, z; write the coordinates x, y, z"},
        BadLine{1, "*NODE, NSET=A, NSET=B", "organ.inp:1: *NODE, NSET is given twice; keep one"},
        BadLine{1, "*NODE, NSET", "organ.inp:1: *NODE needs NSET=...; add it"},
        BadLine{1, "1, 2",
                "organ.inp:1: data before the first keyword: '1, 2'; an .inp file begins with a keyword "
                "such as *NODE"},
        BadLine{2, "1, 0, 0, 0, 0",
                "organ.inp:2: expected a node label and three coordinates, found 5 fields; correct the line"},
        BadLine{2, "1, 0, 0, zero", "organ.inp:2: 'zero' is not a finite number; correct it"},
        BadLine{2, "1, 0, 0, 1 2", "organ.inp:2: '1 2' is not a finite number; correct it"},
        BadLine{2, "1, 0, 0, nan", "organ.inp:2: 'nan' is not a finite number; correct it"},
        BadLine{2, "1, 0, 0, -inf", "organ.inp:2: '-inf' is not a finite number; correct it"},
        BadLine{2, "1, 0, 0, 1e999", "organ.inp:2: '1e999' is not a finite number; correct it"},
        BadLine{2, "1.5, 0, 0, 0", "organ.inp:2: '1.5' is not a node label; write a whole number"},
        BadLine{2, ", 0, 0, 0", "organ.inp:2: '' is not a node label; write a whole number"},
        BadLine{2, "0, 0, 0, 0", "organ.inp:2: 0 is not a node label; labels begin at 1"},
        BadLine{2, "99999999999, 0, 0, 0",
                "organ.inp:2: '99999999999' is not a node label; write a whole number"},
        BadLine{3, "1, 1, 0, 0",
                "organ.inp:3: node 1 is already defined at organ.inp:2; give one of them another label"},
        BadLine{7, "*ELEMENT, ELSET=BODY", "organ.inp:7: *ELEMENT needs TYPE=...; add it"},
        BadLine{7, "*ELEMENT, TYPE=C3D4T, ELSET=BODY",
                "organ.inp:7: elements of type C3D4T are not supported; mesh the body with tetrahedra, "
                "TYPE=C3D4, C3D10 or C3D10H"},
        BadLine{7, "*ELEMENT, TYPE=C3D4H, ELSET=BODY",
                "organ.inp:7: elements of type C3D4H are not supported; write TYPE=C3D4, and MEAN DILATATION "
                "in its *SOLID SECTION, which keeps nearly incompressible tissue from locking"},
        BadLine{7, "*ELEMENT, TYPE=C3D8R, ELSET=BODY",
                "organ.inp:7: elements of type C3D8R are not supported; these hexahedra become tetrahedra by "
                "palpate convert --split"},
        BadLine{7, "*ELEMENT, TYPE=C3D15, ELSET=BODY",
                "organ.inp:7: elements of type C3D15 are not supported; these wedges become tetrahedra by "
                "palpate convert --split"},
        BadLine{
            7, "*ELEMENT, TYPE=C3D10M, ELSET=BODY",
            "organ.inp:8: expected an element label and ten node labels, found 5 fields; correct the line"},
        BadLine{
            7, "*ELEMENT, TYPE=C3D10H, ELSET=BODY",
            "organ.inp:8: expected an element label and ten node labels, found 5 fields; correct the line"},
        BadLine{
            7, "*ELEMENT, TYPE=C3D10, ELSET=BODY",
            "organ.inp:8: expected an element label and ten node labels, found 5 fields; correct the line"},
        BadLine{
            8, "1, 1, 2, 3",
            "organ.inp:8: expected an element label and four node labels, found 4 fields; correct the line"},
        BadLine{8, "1, 1, 2, 3,",
                "organ.inp:9: expected the rest of an element, found 5 fields; correct the line"},
        BadLine{9, "2, 2, 5, 3,",
                "organ.inp:9: expected an element label and four node labels, the element is cut short; add "
                "its nodes"},
        BadLine{
            8, "1, 1, 2, 3, 4, 5",
            "organ.inp:8: expected an element label and four node labels, found 6 fields; correct the line"},
        BadLine{8, "1, 1, 2, 3, 44",
                "organ.inp:8: element 1 names node 44, which is not defined; define it with *NODE"},
        BadLine{8, "1, 1, 2, 3, -4", "organ.inp:8: -4 is not a node label; labels begin at 1"},
        BadLine{9, "1, 2, 5, 3, 4",
                "organ.inp:9: element 1 is already defined at organ.inp:8; give one of them another label"},
        BadLine{8, "1, 1, 3, 2, 4", "organ.inp:8: element 1 is inverted (volume -0.167); reorder its nodes"},
        BadLine{8, "1, 1, 2, 3, 3", "organ.inp:8: element 1 names node 3 twice; correct it"},
        BadLine{6, "5, 0.5, 0.5, 1e-13",
                "organ.inp:9: element 2 is flat (volume 1.67e-14, longest edge 1.41); remesh there"},
        BadLine{6, "5, 1, -1, 1",
                "organ.inp:9: element 2 is flat (volume 0, longest edge 2.45); remesh there"},
        BadLine{
            8, "1, 1, 2, 3, 4\n3, 1, 2, 3, 4",
            "organ.inp:9: elements 1 and 3 overlap: both lie on the same side of the face of nodes 1, 2, 3; "
            "remove one of them"},
        BadLine{
            8, "1, 1, 2, 3, 4\n3, 1, 2, 3, 5",
            "organ.inp:9: elements 1 and 3 overlap: both lie on the same side of the face of nodes 1, 2, 3; "
            "remove one of them"},
        BadLine{6, "5, 1, 1, 1\n6, 2, 2, 2\n*ELEMENT, TYPE=C3D4, ELSET=BODY\n7, 2, 6, 3, 4",
                "organ.inp:12: non-manifold mesh: elements 7, 1 and 2 share the face of nodes 2, 3, 4; "
                "remove one of "
                "them"},
        BadLine{10, "*NSET", "organ.inp:10: *NSET needs NSET=...; add it"},
        BadLine{10, "*NSET, NSET=BASE, INTERNEL",
                "organ.inp:10: *NSET, INTERNEL is not supported; did you mean INTERNAL?"},
        BadLine{10, "*NSET, NSET=BASE, INSTANCE=LIVER-1",
                "organ.inp:10: instance LIVER-1 is not defined above this line; define it with *INSTANCE"},
        BadLine{11, "1, 2, 7",
                "organ.inp:11: node set BASE names node 7, which is not defined; define it with *NODE"},
        BadLine{11, "1, BASE", "organ.inp:11: node set BASE lists itself; remove it"},
        BadLine{17, "NONE, 1, 3\n*NSET, NSET=LATER",
                "organ.inp:17: node set NONE is not defined above this line"},
        BadLine{11, "1, 2, 3\n*NSET, NSET=NONE\n*BOUNDARY\nNONE, 1, 3",
                "organ.inp:14: *BOUNDARY acts on node set NONE, which is empty; add nodes to it"},
        BadLine{11, "1, 2x", "organ.inp:11: '2x' is not a label; write a whole number"},
        BadLine{11, "1, ALLL",
                "organ.inp:11: node set ALLL is not defined above this line; did you mean ALL?"},
        BadLine{10, "*NSET, NSET=BASE, GENERATE",
                "organ.inp:11: labels from 1 by steps of 3 do not arrive at 2; "
                "correct first, last or step"},
        BadLine{10, "*NSET, NSET=X, GENERATE\n1, 2000000000, 1\n*NSET, NSET=BASE",
                "organ.inp:11: node set X names node 6, which is not defined; define it with *NODE"},
        BadLine{10, "*NSET, NSET=X, GENERATE\n3\n*NSET, NSET=BASE",
                "organ.inp:11: expected first label, last label, step, found 1 field; correct the line"},
        BadLine{10, "*ELSET, ELSET=E\n1, 3\n*NSET, NSET=BASE",
                "organ.inp:11: element set E names element 3, which is not defined; define it with *ELEMENT"},
        BadLine{12, "*MATERIAL", "organ.inp:12: *MATERIAL needs NAME=...; add it"},
        BadLine{12, "*MATERIAL, NAME=BONE\n*MATERIAL, NAME=TISSUE",
                "organ.inp:12: material BONE has no law; add *HYPERELASTIC or *ELASTIC below it"},
        BadLine{
            12, "*MATERIAL, NAME=TISSUE\n*MATERIAL, NAME=TISSUE",
            "organ.inp:13: material TISSUE is already defined at organ.inp:12; give this one another name"},
        BadLine{12, "", "organ.inp:12: *HYPERELASTIC belongs to no material; move it below *MATERIAL"},
        BadLine{12, "*MATERIAL, NAME=TISSUE\n1, 2",
                "organ.inp:13: unexpected data after *MATERIAL: '1, 2'; remove it"},
        BadLine{13, "*HYPERELASTIC, ARRUDA-BOYCE",
                "organ.inp:13: *HYPERELASTIC, ARRUDA-BOYCE is not supported; write one of COMPRESSIBLE NEO "
                "HOOKE, NEO HOOKE, MOONEY-RIVLIN, YEOH, OGDEN, POLYNOMIAL or REDUCED POLYNOMIAL"},
        BadLine{13, "*HYPERELASTIC",
                "organ.inp:13: *HYPERELASTIC names no law; write one of COMPRESSIBLE NEO HOOKE, NEO HOOKE, "
                "MOONEY-RIVLIN, YEOH, OGDEN, POLYNOMIAL or REDUCED POLYNOMIAL"},
        BadLine{13, "*HYPERELASTIC, YEOH, OGDEN", "organ.inp:13: *HYPERELASTIC names two laws; keep one"},
        BadLine{13, "*HYPERELASTIC, YEOH, N=2",
                "organ.inp:13: *HYPERELASTIC, N is not supported; write one of COMPRESSIBLE NEO HOOKE, NEO "
                "HOOKE, MOONEY-RIVLIN, YEOH, OGDEN, POLYNOMIAL or REDUCED POLYNOMIAL"},
        BadLine{13, "*HYPERELASTIC, POLYNOMIAL, N=2",
                "organ.inp:13: POLYNOMIAL, N=2 is not supported; write N=1"},
        BadLine{13, "*HYPERELASTIC, NEO HOOKE, MODULI=SHORT",
                "organ.inp:13: MODULI=SHORT is neither LONG TERM nor INSTANTANEOUS; correct it"},
        BadLine{13, "*HYPERELASTIC, TEST DATA INPUT, N=1, POLYNOMIAL",
                "organ.inp:13: *HYPERELASTIC, TEST DATA INPUT is not supported; fit the constants of a law "
                "first, and write them in the data line"},
        BadLine{13, "*HYPERELASTIC, OGDEN, N=4",
                "organ.inp:13: OGDEN, N=4 is not supported; write N=1, 2 or 3"},
        BadLine{13, "*HYPERELASTIC, NEO HOOKE\n1, 0\n** ",
                "organ.inp:14: D1 = 0 asks for an incompressible material, which these elements cannot be; "
                "write D1 = 2 "
                "/ bulk modulus"},
        BadLine{13, "*HYPERELASTIC, NEO HOOKE\n-1, 1\n** ",
                "organ.inp:14: the shear modulus at rest, 2 C10 = -2, must be above 0; correct it"},
        BadLine{13, "*HYPERELASTIC, NEO HOOKE\n1\n** ",
                "organ.inp:14: expected C10, D1, found 1 field; correct the line"},
        BadLine{13, "*HYPERELASTIC, MOONEY-RIVLIN\n1, -1, 1\n** ",
                "organ.inp:14: the shear modulus at rest, 2 (C10 + C01) = 0, must be above 0; correct it"},
        BadLine{13, "*HYPERELASTIC, YEOH\n1, 0, 0, 1, -1\n** ",
                "organ.inp:14: D2 is below 0: the body would gain volume under pressure; correct it"},
        BadLine{13, "*HYPERELASTIC, YEOH\n1, 0, 0\n** ",
                "organ.inp:14: expected C10, C20, C30, D1, D2, D3, found 3 fields; correct the line"},
        BadLine{13, "*HYPERELASTIC, OGDEN\n1, 0, 1\n** ",
                "organ.inp:14: alpha1 is 0, which no term can have; correct it"},
        BadLine{13, "*HYPERELASTIC, OGDEN, N=2\n1, 2, -1, 2, 1, 1\n** ",
                "organ.inp:14: the shear modulus at rest, the sum of mu_i = 0, must be above 0; correct it"},
        BadLine{13, "*ELASTIC\n0, 0.3\n** ", "organ.inp:14: Young's modulus must be above 0; correct it"},
        BadLine{13, "*ELASTIC\n1, 0.5\n** ",
                "organ.inp:14: Poisson's ratio must lie above -1 and below 0.5; correct it"},
        BadLine{13, "*ELASTIC, TYPE=ENGINEERING CONSTANTS",
                "organ.inp:13: *ELASTIC, TYPE=ENGINEERINGCONSTANTS is not supported; write TYPE=ISOTROPIC"},
        BadLine{14, "", "organ.inp:13: *HYPERELASTIC needs a data line mu, lambda; add it"},
        BadLine{14, "1", "organ.inp:14: expected mu, lambda, found 1 field; correct the line"},
        BadLine{14, "1, 2, 3", "organ.inp:14: expected mu, lambda, found 3 fields; correct the line"},
        BadLine{14, "0, 1", "organ.inp:14: the shear modulus mu must be above 0; correct it"},
        BadLine{14, "nan, 1", "organ.inp:14: 'nan' is not a finite number; correct it"},
        BadLine{14, "3, -2",
                "organ.inp:14: lambda must be above -2/3 mu, or the body gains volume under pressure; "
                "correct it"},
        BadLine{14, "1, 2\n1, 2", "organ.inp:15: unexpected data after *HYPERELASTIC: '1, 2'; remove it"},
        BadLine{14, "1, 2\n*HYPERELASTIC, COMPRESSIBLE NEO HOOKE\n1, 2",
                "organ.inp:15: material TISSUE already has a law; keep one"},
        BadLine{
            15, "",
            "organ.inp:8: element 1 has no material; add *SOLID SECTION for an element set that holds it"},
        BadLine{15, "*SOLID SECTION, ELSET=BODY", "organ.inp:15: *SOLID SECTION needs MATERIAL=...; add it"},
        BadLine{15, "*SOLID SECTION, ELSET=BODY, MATERIAL=TISUE",
                "organ.inp:15: material TISUE is not defined; did you mean TISSUE?"},
        BadLine{15, "*SOLID SECTION, ELSET=BODY, MATERIAL=X",
                "organ.inp:15: material X is not defined; define it with *MATERIAL"},
        BadLine{15, "*SOLID SECTION, ELSET=ORGAN, MATERIAL=TISSUE",
                "organ.inp:15: element set ORGAN is not defined above this line"},
        BadLine{15, "*SOLID SECTION, ELSET=BODY, MATERIAL=TISSUE, MEAN DILATATION=YES",
                "organ.inp:15: MEAN DILATATION takes no value; write *SOLID SECTION, ..., MEAN DILATATION"},
        BadLine{15, "*SOLID SECTION, ELSET=BODY, MATERIAL=TISSUE, MEAN DILATION",
                "organ.inp:15: *SOLID SECTION, MEAN DILATION is not supported; did you mean MEANDILATATION?"},
        BadLine{15, "*SOLID SECTION, ELSET=BODY, MATERIAL=TISSUE\n2.5",
                "organ.inp:16: section attribute 2.5 is not supported; remove the line"},
        BadLine{
            15,
            "*SOLID SECTION, ELSET=BODY, MATERIAL=TISSUE\n*ELSET, ELSET=TWO\n2\n*SOLID SECTION, ELSET=TWO, "
            "MATERIAL=TISSUE",
            "organ.inp:18: element 2 is already in the section of organ.inp:15; take it out of one of them"},
        BadLine{16, "*BOUNDARY, OP=NEW",
                "organ.inp:16: *BOUNDARY, OP=NEW before the first *STEP removes nothing; take it out"},
        BadLine{12, "*MATERIAL, NAME=TISSUE\n*DENSITY\n1\n*DENSITY\n2",
                "organ.inp:15: *DENSITY is given twice in this material; keep one"},
        BadLine{16, "*BOUNDARY, OP=OLD",
                "organ.inp:16: *BOUNDARY, OP=OLD is neither MOD nor NEW; correct it"},
        BadLine{12, "*MATERIAL, NAME=TISSUE\n*DENSITY\n0",
                "organ.inp:14: the density must be above 0; correct it"},
        BadLine{12, "*MATERIAL, NAME=TISSUE\n*DENSITY",
                "organ.inp:13: *DENSITY needs a data line density; add it"},
        BadLine{12, "*DENSITY\n1", "organ.inp:12: *DENSITY belongs to no material; move it below *MATERIAL"},
        BadLine{10, "*SURFACE, NAME=S\n1, 2, 3\n*NSET, NSET=BASE",
                "organ.inp:11: expected an element or set, S1 to S4 or nothing for every outer face, found 3 "
                "fields; correct the line"},
        BadLine{10, "*SURFACE, NAME=S\nBODY, S5\n*NSET, NSET=BASE",
                "organ.inp:11: face S5 does not exist in a tetrahedron; write S1, S2, S3 or S4"},
        BadLine{10, "*SURFACE, NAME=S\nBDY, S1\n*NSET, NSET=BASE",
                "organ.inp:11: element set BDY is not defined above this line; did you mean BODY?"},
        BadLine{
            10, "*SURFACE, NAME=S, TYPE=CYLINDER\n*NSET, NSET=BASE",
            "organ.inp:10: *SURFACE, TYPE=CYLINDER is not supported; name faces of elements, TYPE=ELEMENT"},
        BadLine{10, "*SURFACE, NAME=S, TYPE=NODE\n*NSET, NSET=BASE",
                "organ.inp:10: surface S has no nodes; add lines such as SKIN"},
        BadLine{10, "*SURFACE, NAME=S\n*NSET, NSET=BASE",
                "organ.inp:10: surface S has no faces; add lines such as SKIN, S1"},
        BadLine{10, "*AMPLITUDE, NAME=A\n0, 0, 0, 1\n*NSET, NSET=BASE",
                "organ.inp:11: the times of an amplitude must grow; correct them"},
        BadLine{10, "*AMPLITUDE, NAME=A\n0, 0, 1\n*NSET, NSET=BASE",
                "organ.inp:11: a time or a factor is missing; write pairs of time and factor"},
        BadLine{10, "*AMPLITUDE, NAME=A\n*NSET, NSET=BASE",
                "organ.inp:10: amplitude A has no points; add pairs of time and factor"},
        BadLine{10, "*AMPLITUDE, NAME=A, DEFINITION=PERIODIC\n*NSET, NSET=BASE",
                "organ.inp:10: *AMPLITUDE, DEFINITION=PERIODIC is not supported; write a table of times and "
                "factors, DEFINITION=TABULAR"},
        BadLine{10, "*AMPLITUDE, NAME=A, TIME=NOW\n*NSET, NSET=BASE",
                "organ.inp:10: TIME=NOW is neither STEP TIME nor TOTAL TIME; correct it"},
        BadLine{16, "*BOUNDARY, AMPLITUDE=A",
                "organ.inp:16: *BOUNDARY, AMPLITUDE is not supported; remove it only where the result stays "
                "the same without it"},
        BadLine{16, "*BOUNDARY, TYPE=VELOCITY",
                "organ.inp:16: *BOUNDARY, TYPE=VELOCITY is not supported; a velocity or acceleration would "
                "be read as a displacement; write the displacement at the step's end"},
        BadLine{17, "BASE",
                "organ.inp:17: expected node or set, first dof, last dof, value, found 1 field; correct the "
                "line"},
        BadLine{17, "BSE, 1, 3",
                "organ.inp:17: node set BSE is not defined above this line; did you mean BASE?"},
        BadLine{17, "9, 1, 3",
                "organ.inp:17: *BOUNDARY names node 9, which is not defined; define it with *NODE"},
        BadLine{17, "BASE, 1, 6, 0.5",
                "organ.inp:17: degree of freedom 6 does not exist in a solid; write 1 (x), 2 (y) or 3 (z)"},
        BadLine{17, "BASE, 1, 7",
                "organ.inp:17: degree of freedom 7 does not exist in a solid; write 1 (x), 2 (y) or 3 (z)"},
        BadLine{17, "BASE, 3, 1",
                "organ.inp:17: the last degree of freedom is before the first; exchange them"},
        BadLine{17, "BASE, YASYMM",
                "organ.inp:17: boundary type YASYMM is not supported; write the degrees of freedom, such as "
                "1, 3"},
        BadLine{17, "BASE, PINNED, 3", "organ.inp:17: nothing may follow PINNED; remove it"},
        BadLine{17, "BASE, 1, 3, 0.5",
                "organ.inp:17: a displacement other than 0 before the first *STEP; move it into a step"},
        BadLine{17, "BASE, 1, 3\n*STATIC",
                "organ.inp:18: *STATIC stands outside a step; move it between *STEP and *END STEP"},
        BadLine{17, "BASE, 1, 3\n*END STEP",
                "organ.inp:18: *END STEP stands outside a step; move it between *STEP and *END STEP"},
        BadLine{
            17, "BASE, 1, 3\n*\n",
            "organ.inp:18: * is not supported; remove it only where the result stays the same without it"}));

TEST_F(InpRefusals, MeanDilatationIsOfFourNodes) {
  std::string text = test::block_inp(1, true);
  const size_t at = text.find("*SOLID SECTION, ELSET=E") + std::string("*SOLID SECTION, ELSET=E").size();
  const auto line = std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n') + 1;
  text.insert(at, ", MEAN DILATATION");
  EXPECT_EQ(refusal(text),
            "organ.inp:" + std::to_string(line) +
                ": MEAN DILATATION is for elements of four nodes, and element 1 has ten; give its *ELEMENT "
                "TYPE=C3D10H and leave MEAN DILATATION out");
}

}  // namespace inp_refusals_test
}  // namespace palpate::inp_refusals_fixture
