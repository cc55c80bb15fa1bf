// Legacy VTK files: read as VTK writes them, written, refused.
#include "offline/io/mesh_formats.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "offline/io/vtk_attributes.hpp"
#include "tests/support/mesh_files.hpp"

namespace palpate::test {
namespace vtk_format_test {

constexpr CursorReader kRead = read_vtk;

// VTK 9.1 has written this mesh of two tetrahedra, a polygon and a quadrilateral in four ways.
const std::string kPoints = R"(
vtk output
ASCII
DATASET UNSTRUCTURED_GRID
POINTS 5 double
0 0 0 1 0 0 0 1 0 
0 0 1 0.5 0.25 -1.5 
)";

const std::string kKindsAndArrays = R"(CELL_TYPES 4
10
10
7
9

CELL_DATA 4
FIELD FieldData 1
tissue%20label 1 4 short
7 -3 300 2 
POINT_DATA 5
FIELD FieldData 2
u 3 5 double
0 0.125 0.25 0.375 0.5 0.625 0.75 0.875 1 
1.125 1.25 1.375 1.5 1.625 1.75 
set:TOP 1 5 char
0 0 0 1 1 
)";

const std::string kText42 = R"(# vtk DataFile Version 4.2)" + kPoints + R"(CELLS 4 20
4 0 1 2 3 
4 0 2 1 4 
4 0 1 4 2 
4 0 1 4 2 

)" + kKindsAndArrays;

const std::string kText51 = R"(# vtk DataFile Version 5.1)" + kPoints + R"(CELLS 5 16
OFFSETS vtktypeint64
0 4 8 12 16 
CONNECTIVITY vtktypeint64
0 1 2 3 0 2 1 4 0 
1 4 2 0 1 4 2 
)" + kKindsAndArrays;

constexpr const char* kBinary42 =
    "IyB2dGsgRGF0YUZpbGUgVmVyc2lvbiA0LjIKdnRrIG91dHB1dApCSU5BUlkKREFUQVNFVCBVTlNUUlVDVFVSRURfR1JJRApQ"
    "T0lOVFMgNSBkb3VibGUKAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAP/AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA/"
    "8AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAD/wAAAAAAAAP+AAAAAAAAA/0AAAAAAAAL/4AAAAAAAACkNFTExTIDQg"
    "MjAKAAAABAAAAAAAAAABAAAAAgAAAAMAAAAEAAAAAAAAAAIAAAABAAAABAAAAAQAAAAAAAAAAQAAAAQAAAACAAAABAAAAAAA"
    "AAABAAAABAAAAAIKQ0VMTF9UWVBFUyA0CgAAAAoAAAAKAAAABwAAAAkKQ0VMTF9EQVRBIDQKRklFTEQgRmllbGREYXRhIDEK"
    "dGlzc3VlJTIwbGFiZWwgMSA0IHNob3J0CgAH//0BLAACClBPSU5UX0RBVEEgNQpGSUVMRCBGaWVsZERhdGEgMgp1IDMgNSBk"
    "b3VibGUKAAAAAAAAAAA/wAAAAAAAAD/QAAAAAAAAP9gAAAAAAAA/4AAAAAAAAD/kAAAAAAAAP+gAAAAAAAA/7AAAAAAAAD/w"
    "AAAAAAAAP/IAAAAAAAA/9AAAAAAAAD/2AAAAAAAAP/gAAAAAAAA/+gAAAAAAAD/8AAAAAAAACnNldDpUT1AgMSA1IGNoYXIK"
    "AAAAAQEK";

constexpr const char* kBinary51 =
    "IyB2dGsgRGF0YUZpbGUgVmVyc2lvbiA1LjEKdnRrIG91dHB1dApCSU5BUlkKREFUQVNFVCBVTlNUUlVDVFVSRURfR1JJRApQ"
    "T0lOVFMgNSBkb3VibGUKAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAP/AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA/"
    "8AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAD/wAAAAAAAAP+AAAAAAAAA/0AAAAAAAAL/4AAAAAAAACkNFTExTIDUg"
    "MTYKT0ZGU0VUUyB2dGt0eXBlaW50NjQKAAAAAAAAAAAAAAAAAAAABAAAAAAAAAAIAAAAAAAAAAwAAAAAAAAAEApDT05ORUNU"
    "SVZJVFkgdnRrdHlwZWludDY0CgAAAAAAAAAAAAAAAAAAAAEAAAAAAAAAAgAAAAAAAAADAAAAAAAAAAAAAAAAAAAAAgAAAAAA"
    "AAABAAAAAAAAAAQAAAAAAAAAAAAAAAAAAAABAAAAAAAAAAQAAAAAAAAAAgAAAAAAAAAAAAAAAAAAAAEAAAAAAAAABAAAAAAA"
    "AAACCkNFTExfVFlQRVMgNAoAAAAKAAAACgAAAAcAAAAJCkNFTExfREFUQSA0CkZJRUxEIEZpZWxkRGF0YSAxCnRpc3N1ZSUy"
    "MGxhYmVsIDEgNCBzaG9ydAoAB//9ASwAAgpQT0lOVF9EQVRBIDUKRklFTEQgRmllbGREYXRhIDIKdSAzIDUgZG91YmxlCgAA"
    "AAAAAAAAP8AAAAAAAAA/0AAAAAAAAD/YAAAAAAAAP+AAAAAAAAA/5AAAAAAAAD/oAAAAAAAAP+wAAAAAAAA/8AAAAAAAAD/y"
    "AAAAAAAAP/QAAAAAAAA/9gAAAAAAAD/4AAAAAAAAP/oAAAAAAAA//AAAAAAAAApzZXQ6VE9QIDEgNSBjaGFyCgAAAAEBCg==";

void expect_reference(const MeshData& mesh) {
  MeshData expected;
  expected.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0.5, 0.25, -1.5}};
  expected.cells = {{CellKind::tetrahedron, 1, 4, {0, 1, 2, 3}, 0},
                    {CellKind::tetrahedron, 2, 4, {0, 2, 1, 4}, 0},
                    {CellKind::triangle, 3, 3, {0, 1, 4}, 0},
                    {CellKind::triangle, 4, 3, {0, 4, 2}, 0},
                    {CellKind::quadrilateral, 5, 4, {0, 1, 4, 2}, 0}};
  expected.node_sets = {{"TOP", {3, 4}}};
  expected.point_arrays = {{"u", 3, {}}};
  for (int i = 0; i < 15; ++i) expected.point_arrays[0].values.push_back(i / 8.0);
  expected.cell_arrays = {{"tissue label", 1, {7, -3, 300, 300, 2}}};
  expect_equal_meshes(mesh, expected);
  EXPECT_EQ(mesh.node_labels, (std::vector<int>{1, 2, 3, 4, 5}));
  EXPECT_EQ(mesh.cells.back().label, 5);
  EXPECT_TRUE(mesh.notes.empty());
}

TEST(VtkFormat, ReadsAsVtkWrites) {
  expect_reference(read_bytes(kRead, kText42));
  expect_reference(read_bytes(kRead, kText51));
  expect_reference(read_bytes(kRead, from_base64(kBinary42)));
  expect_reference(read_bytes(kRead, from_base64(kBinary51)));
}

TEST(VtkFormat, LinesOfCellsStandInTextAlone) {
  EXPECT_EQ(read_bytes(kRead, kText42).cells[1].line, 10);
  EXPECT_EQ(read_bytes(kRead, kText51).cells[1].line, 12);
  EXPECT_EQ(read_bytes(kRead, from_base64(kBinary42)).cells[1].line, 0);
}

TEST(VtkFormat, WhatIsWrittenIsReadBack) {
  const MeshData mesh = mesh_with_odd_names();
  expect_equal_meshes(round_trip(mesh, write_vtk, kRead, true), mesh);
  expect_equal_meshes(round_trip(mesh, write_vtk, kRead, false), mesh);
  expect_equal_meshes(round_trip({}, write_vtk, kRead, true), {});
}

// Version 2.0, with a line end of Windows, a split attribute header and every kind of attribute.
constexpr const char* kAttributes =
    "# vtk DataFile Version 2.0\r\ntitle\r\nascii\r\ndataset unstructured_grid\r\n"
    "points 2 float\r\n0 0 0 1 0 0\r\ncells 1 3\r\n2 0 1\r\ncell_types 1\r\n3\r\npoint_data 2\r\n"
    "SCALARS a int 2\r\nLOOKUP_TABLE own\r\n1 2 3 4\r\nLOOKUP_TABLE own 1\r\n0 0 0 1\r\n"
    "VECTORS b double\r\n1 2 3 4 5 nan\r\nNORMALS c float\r\n0 0 1 0 0 1\r\nTEXTURE_COORDINATES d 2 "
    "float\r\n0 0 1 1\r\n"
    "TENSORS e float\r\n1 2 3 4 5 6 7 8 9\r\n1 2 3 4 5 6 7 8 9\r\nCOLOR_SCALARS f 1\r\n0.5 1\r\n"
    "GLOBAL_IDS g vtkIdType\r\n5 6\r\nMETADATA\r\nINFORMATION 0\r\n\r\n"
    "FIELD more 3\r\nh 1 2 int\r\n8 9\r\nnames 1 2 string\r\nleft side\r\nright\r\ni 1 2 unsigned_char\r\n3 "
    "4\r\n";

TEST(VtkFormat, ReadsEveryKindOfAttribute) {
  const MeshData mesh = read_bytes(kRead, kAttributes);
  std::string found;
  for (const MeshArray& array : mesh.point_arrays)
    found += array.name + std::to_string(array.num_components) + " ";
  EXPECT_EQ(found, "a2 b3 c3 d2 e9 f1 g1 h1 i1 ");
  EXPECT_EQ(mesh.point_arrays[0].values, (std::vector<double>{1, 2, 3, 4}));
  EXPECT_TRUE(std::isnan(mesh.point_arrays[1].values[5])) << "an array may hold NaN";
  EXPECT_EQ(mesh.point_arrays[8].values, (std::vector<double>{3, 4}));
}

TEST(VtkFormat, PassesBinaryStringsAndBits) {
  std::string bytes =
      "# vtk DataFile Version 4.2\nt\nBINARY\nDATASET POLYDATA\nFIELD FieldData 3\nnames 1 2 string\n";
  bytes += std::string(
               "\xc3"
               "abc\x80\x04"
               "defg",
               10) +
           "\nflags 1 9 bit\n\xff\x80\nt 1 1 int\n" + std::string("\0\0\0\1\n", 5) + "POINTS 1 float\n" +
           std::string(12, '\0') + "\n";
  EXPECT_EQ(read_bytes(kRead, bytes).positions.size(), 1U);
}

// Cells have their values in the order vertices, lines, polygons, strips.
TEST(VtkFormat, PolygonalDataBecomesTriangles) {
  const MeshData mesh = read_bytes(
      kRead,
      "# vtk DataFile Version 3.0\nt\nASCII\nDATASET POLYDATA\nPOINTS 5 float\n0 0 0 1 0 0 0 1 0 1 1 0 2 1 "
      "0\n"
      "TRIANGLE_STRIPS 1 5\n4 0 1 2 3\nPOLYGONS 1 5\n4 0 1 3 2\nLINES 1 4\n3 0 1 4\nVERTICES 1 2\n1 4\n"
      "CELL_DATA 4\nSCALARS s float\nLOOKUP_TABLE default\n1 2 3 4\n");
  MeshData expected;
  expected.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {2, 1, 0}};
  expected.cells = {{CellKind::point, 0, 1, {4}, 0},          {CellKind::line, 0, 2, {0, 1}, 0},
                    {CellKind::line, 0, 2, {1, 4}, 0},        {CellKind::triangle, 0, 3, {0, 1, 3}, 0},
                    {CellKind::triangle, 0, 3, {0, 3, 2}, 0}, {CellKind::triangle, 0, 3, {0, 1, 2}, 0},
                    {CellKind::triangle, 0, 3, {2, 1, 3}, 0}};
  expected.cell_arrays = {{"s", 1, {1, 2, 2, 3, 3, 4, 4}}};
  expect_equal_meshes(mesh, expected);
}

TEST(VtkFormat, RefusesToRepeatWideRowsForEachTriangle) {
  const auto polygon = [](int num_components) {
    std::string text =
        "# vtk DataFile Version 3.0\nt\nASCII\nDATASET POLYDATA\nPOINTS 4 float\n0 0 0 1 0 0 1 1 0 0 1 0\n"
        "POLYGONS 1 5\n4 0 1 2 3\nCELL_DATA 1\nFIELD f 1\nE " +
        std::to_string(num_components) + " 1 int\n";
    for (int i = 0; i < num_components; ++i) text += "7 ";
    return text + "\n";
  };
  EXPECT_EQ(read_bytes(kRead, polygon(200)).cell_arrays.at(0).values.size(), 400U);
  EXPECT_EQ(refusal_of_bytes(kRead, polygon(201)),
            "organ:10: array 'E' has too many values to repeat them for each part of a polygon or strip; "
            "split these into triangles before the export");
}

std::string grid_of(int num_points, const std::string& cells) {
  std::string text = "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS " +
                     std::to_string(num_points) + " float\n";
  for (int i = 0; i < num_points; ++i) text += std::to_string(i) + " 0 0\n";
  return text + cells;
}

TEST(VtkFormat, CellsThatAMeshLacksAreCounted) {
  const MeshData mesh =
      read_bytes(kRead, grid_of(20,
                                "CELLS 5 53\n3 0 1 2\n6 0 1 2 3 4 5\n20 0 1 2 3 4 5 6 7 8 9 10 "
                                "11 12 13 14 15 16 17 18 19\n8 0 1 2 3 4 5 6 7\n11 0 1 2 3 4 5 6 7 "
                                "8 9 10\nCELL_TYPES 5\n99 22 25 11 42\n"));
  EXPECT_EQ(mesh.notes, (std::vector<std::string>{"leaves out 1 cells of VTK's cell type 42",
                                                  "leaves out 1 cells of VTK's cell type 99",
                                                  "keeps only the corners of 1 higher-order triangles",
                                                  "keeps only the corners of 1 higher-order hexahedra"}));
  ASSERT_EQ(mesh.cells.size(), 3U);
  EXPECT_EQ(mesh.cells[1].num_nodes, 8);
  EXPECT_EQ(mesh.cells[2].nodes, (std::array<int, 10>{0, 1, 3, 2, 4, 5, 7, 6, 0, 0})) << "a voxel is turned";
}

TEST(VtkFormat, NamesWithBlanksAreCoded) {
  EXPECT_EQ(encoded_vtk_name("E 5% \"\xe9\""), "E%205%25%20%22%E9%22");
  EXPECT_EQ(decoded_vtk_name("E%205%25%20%22%e9%22"), "E 5% \"\xe9\"");
  EXPECT_EQ(decoded_vtk_name("50%"), "50%");
}

TEST(VtkFormat, RefusesInOneLine) {
  const auto refusal = [](const std::string& bytes) { return refusal_of_bytes(kRead, bytes); };
  const std::string tetrahedron = "CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10\n";
  EXPECT_EQ(refusal(grid_of(4, tetrahedron)), "");
  EXPECT_EQ(refusal("solid"),
            "organ:1: is no legacy VTK file, which starts with '# vtk DataFile Version'; check its ending");
  EXPECT_EQ(refusal("# vtk DataFile Version 7.0\n"),
            "organ:1: version '7.0' of VTK's format is not known; write version 5.1 or older");
  EXPECT_EQ(
      refusal("# vtk DataFile Version 3.0\nt\nASCII\nDATASET STRUCTURED_POINTS\n"),
      "organ:4: data of kind STRUCTURED_POINTS are no mesh; convert them to UNSTRUCTURED_GRID, such as by "
      "ParaView's filter Tetrahedralize");
  EXPECT_EQ(refusal(grid_of(4, "CELLS 1 5\n4 0 1 2 4\nCELL_TYPES 1\n10\n")),
            "organ:11: cell 0 names point 4, where points are 0 to 3; export the file again");
  EXPECT_EQ(refusal(grid_of(4, "CELLS 1 5\n4 1 2 3 -1\nCELL_TYPES 1\n10\n")),
            "organ:11: cell 0 names point -1, where points are 0 to 3; export the file again");
  EXPECT_EQ(refusal(grid_of(4, "CELLS 1 4\n4 0 1 2 3\nCELL_TYPES 1\n10\n")),
            "organ:11: cell 0 with 4 nodes passes the end of its section; export the file again");
  EXPECT_EQ(refusal(grid_of(4, "CELLS 1 6\n4 0 1 2 3\nCELL_TYPES 1\n10\n")),
            "organ:11: the section of cells has 1 numbers too many; export the file again");
  EXPECT_EQ(refusal(grid_of(4, "CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 2\n10 10\n")),
            "organ:12: there are 2 cell types for 1 cells; export the file again");
  EXPECT_EQ(refusal(grid_of(4, "CELLS 1 5\n4 0 1 2 3\n")),
            "organ:12: the section CELL_TYPES is missing; export the file again");
  EXPECT_EQ(refusal(grid_of(4, tetrahedron + "POINT_DATA 5\n")),
            "organ:14: there are values for 5 points, where the mesh has 4; export the file again");
  EXPECT_EQ(refusal(grid_of(4, tetrahedron + "CELL_DATA 1\nFIELD f 1\nE 1 2 float\n1 2\n")),
            "organ:15: array 'E' has 2 values for 1 cells; export the file again");
  EXPECT_EQ(refusal(grid_of(4, tetrahedron + "CELL_DATA 1\nSCALARS E variant\n")),
            "organ:15: 'variant' is no type of numbers; write int, float or double");
  EXPECT_EQ(
      refusal(grid_of(4, tetrahedron + "CELL_DATA 1\nSCALARS E float\nLOOKUP_TABLE default\n0,5\n")),
      "organ:17: '0,5' is no number, where array 'E' should be; write decimals with a point, and blanks "
      "between numbers");
}

TEST(VtkFormat, RefusesDamagedNumbers) {
  const std::string head = "# vtk DataFile Version 3.0\nt\nASCII\nDATASET POLYDATA\nPOINTS ";
  EXPECT_EQ(refusal_of_bytes(kRead, head + "1 float\n0 nan 0\n"),
            "organ:6: point 0 has a coordinate that is no finite number; correct it");
  EXPECT_EQ(refusal_of_bytes(kRead, head + "1 float\n0 0\n"),
            "organ:6: the file is too short for the 3 numbers of the points; copy or export it again");
  EXPECT_EQ(
      refusal_of_bytes(kRead, head + "2000000000 float\n0 0 0\n"),
      "organ:5: the number of points is 2000000000, more than the rest of the file holds; export it again");
  EXPECT_EQ(refusal_of_bytes(kRead, head + "-1 float\n"),
            "organ:5: the number of points is negative; export the file again");
}

// A file in the order of bytes of this machine: its counts make no sense.
TEST(VtkFormat, RefusesLittleEndianFiles) {
  std::string bytes = "# vtk DataFile Version 4.2\nt\nBINARY\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 float\n";
  bytes += std::string(48, '\0') + "\nCELLS 1 5\n";
  for (const char number : {'\4', '\0', '\1', '\2', '\3'})
    bytes += std::string(1, number) + std::string(3, '\0');
  EXPECT_EQ(
      refusal_of_bytes(kRead, bytes),
      "organ: byte 140: cell 0 with 67108864 nodes passes the end of its section; export the file again, "
      "with the most significant byte first");
}

TEST(VtkFormat, SurvivesDamage) {
  expect_survives_damage(kRead, kText42);
  expect_survives_damage(kRead, kText51);
  expect_survives_damage(kRead, kAttributes);
  expect_survives_damage(kRead, from_base64(kBinary42));
  expect_survives_damage(kRead, from_base64(kBinary51));
}

}  // namespace vtk_format_test
}  // namespace palpate::test
