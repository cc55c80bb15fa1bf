// VTU files: read as VTK writes them, written, refused. vtu_writer_test.cpp looks at the bytes.
#include "offline/io/mesh_formats.hpp"

#include <gtest/gtest.h>
#include <zlib.h>

#include "tests/support/mesh_files.hpp"
#include "tests/support/vtu_files.hpp"

namespace palpate::test {
namespace vtu_format_test {

constexpr CursorReader kRead = read_vtu;

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
}

TEST(VtuFormat, ReadsAsVtkWrites) {
  expect_reference(read_bytes(kRead, kTextVtu));
  expect_reference(read_bytes(kRead, from_base64(kBase64Vtu)));
  expect_reference(read_bytes(kRead, from_base64(kZlibVtu)));
  expect_reference(read_bytes(kRead, from_base64(kRawBigEndianVtu)));
  expect_reference(read_bytes(kRead, from_base64(kRawZlibVtu)));
  expect_reference(read_bytes(kRead, from_base64(kAppendedBase64Vtu)));
}

TEST(VtuFormat, WhatIsWrittenIsReadBack) {
  const MeshData mesh = mesh_with_odd_names();
  expect_equal_meshes(round_trip(mesh, write_vtu, kRead, true), mesh);
  expect_equal_meshes(round_trip(mesh, write_vtu, kRead, false), mesh);
  expect_equal_meshes(round_trip({}, write_vtu, kRead, true), {});
}

// The text of a file with `pieces` in it. Each '|' becomes a line end.
std::string grid_of(const std::string& attributes, const std::string& pieces) {
  std::string text = "<VTKFile type=\"UnstructuredGrid\"" + attributes + ">|<UnstructuredGrid>|" + pieces +
                     "|</UnstructuredGrid>|</VTKFile>|";
  for (char& letter : text) letter = letter == '|' ? '\n' : letter;
  return text;
}

std::string piece_of(const std::string& points, const std::string& connectivity = "0 1",
                     const std::string& offsets = "2", const std::string& arrays = "") {
  return "<Piece NumberOfPoints=\"2\" NumberOfCells=\"1\">|<Points>|<DataArray type=\"Float64\" "
         "NumberOfComponents=\"3\">" +
         points + "</DataArray></Points>|<Cells>|<DataArray type=\"Int32\" Name=\"connectivity\">" +
         connectivity + "</DataArray>|<DataArray type=\"Int32\" Name=\"offsets\">" + offsets +
         "</DataArray>|<DataArray type=\"UInt8\" Name=\"types\">3</DataArray></Cells>" + arrays + "</Piece>";
}

TEST(VtuFormat, PiecesBecomeOneMesh) {
  const std::string array = "<CellData><DataArray type=\"Int32\" Name=\"a\">5</DataArray></CellData>";
  const std::string empty = "<Piece NumberOfPoints=\"0\" NumberOfCells=\"0\"/>";
  const std::string one = piece_of("0 0 0 1 0 0", "0 1", "2", array);
  const MeshData mesh = read_bytes(kRead, grid_of("", empty + one + empty + one));
  ASSERT_EQ(mesh.cells.size(), 2U);
  EXPECT_EQ(mesh.cells[1].nodes[0], 2);
  EXPECT_EQ(mesh.cells[1].nodes[1], 3);
  ASSERT_EQ(mesh.cell_arrays.size(), 1U);
  EXPECT_EQ(mesh.cell_arrays[0].values, (std::vector<double>{5, 5}));
  EXPECT_EQ(refusal_of_bytes(kRead, grid_of("", one + piece_of("0 0 0 1 0 0"))),
            "organ:2: array 'a' has 1 values for 2 cells; export the file again");
  EXPECT_EQ(refusal_of_bytes(kRead, grid_of("", piece_of("0 0 0 1 0 0") + "|" + one)),
            "organ:16: array 'a' is not the same in every piece; merge the pieces before the export");
}

TEST(VtuFormat, RefusesInOneLine) {
  const auto refusal = [](const std::string& attributes, const std::string& piece) {
    return refusal_of_bytes(kRead, grid_of(attributes, piece));
  };
  const std::string points = "0 0 0 1 0 0";
  EXPECT_EQ(refusal("", piece_of(points)), "");
  EXPECT_EQ(refusal_of_bytes(kRead, "<mesh/>"),
            "organ:1: is no VTU file, which has an element VTKFile; check its ending");
  EXPECT_EQ(refusal_of_bytes(kRead, "<VTKFile type=\"PolyData\"/>"),
            "organ:1: data of type 'PolyData' are no unstructured grid; export an unstructured grid");
  EXPECT_EQ(refusal_of_bytes(kRead, "<VTKFile>\n<Piece>\n</VTKFile>"),
            "organ:3: is no complete XML (Start-end tags mismatch); copy or export it again");
  EXPECT_EQ(
      refusal(" compressor=\"vtkLZ4DataCompressor\"", ""),
      "organ:1: arrays are compressed by vtkLZ4DataCompressor, which is not supported; export the file with "
      "zlib or without compression");
  EXPECT_EQ(refusal("", "<Piece NumberOfPoints=\"two\"/>"),
            "organ:3: NumberOfPoints is 'two', where a count should be; export the file again");
  EXPECT_EQ(refusal("", "<Piece NumberOfPoints=\"2\" NumberOfCells=\"0\"/>"),
            "organ: has no array 'Points'; export the file again");
  EXPECT_EQ(refusal("", piece_of("0 0 0 1 0 nan")),
            "organ:5: point 1 has a coordinate that is no finite number; correct it");
  EXPECT_EQ(refusal("", piece_of("0 0 0 1 0")),
            "organ:5: the file is too short for the 6 numbers of Points; copy or export it again");
  EXPECT_EQ(refusal("", piece_of("0 0 0 1 0 0 7")),
            "organ:5: array 'Points' has more values than the mesh; export the file again");
  EXPECT_EQ(refusal("", piece_of(points, "0 2")),
            "organ:7: cell 0 names point 2, where points are 0 to 1; export the file again");
  EXPECT_EQ(refusal("", piece_of(points, "0 1", "-2")),
            "organ:8: the offsets do not ascend; export the file again");
  EXPECT_EQ(
      refusal("", piece_of(points, "0 1", "2000000000")),
      "organ:7: the file is too short for the 2000000000 numbers of connectivity; copy or export it again");
}

TEST(VtuFormat, RefusesManyElements) {
  std::string elements;
  for (int i = 0; i < 100'000; ++i) elements += "<a/>";
  EXPECT_EQ(refusal_of_bytes(kRead, grid_of("", elements)),
            "organ:1: has more XML elements than a mesh needs; export the file again");
}

std::string little_endian(std::uint32_t number) {
  std::string bytes;
  for (int shift = 0; shift < 32; shift += 8) bytes += static_cast<char>(number >> shift & 0xff);
  return bytes;
}

// A file whose points are `num_bytes` zeros in one compressed block, said to grow to `said` bytes.
std::string bomb(std::size_t num_points, std::size_t num_bytes, std::size_t said) {
  const std::string zeros(num_bytes, '\0');
  std::string block(compressBound(zeros.size()), '\0');
  uLongf size = block.size();
  compress2(reinterpret_cast<Bytef*>(block.data()), &size, reinterpret_cast<const Bytef*>(zeros.data()),
            zeros.size(), 9);
  block.resize(size);
  return "<VTKFile type=\"UnstructuredGrid\" compressor=\"vtkZLibDataCompressor\"><UnstructuredGrid>\n"
         "<Piece NumberOfPoints=\"" +
         std::to_string(num_points) +
         "\" NumberOfCells=\"0\"><Points><DataArray type=\"Float64\" NumberOfComponents=\"3\" "
         "format=\"appended\" "
         "offset=\"0\"/></Points></Piece></UnstructuredGrid><AppendedData encoding=\"raw\">_" +
         little_endian(1) + little_endian(static_cast<std::uint32_t>(said)) + little_endian(0) +
         little_endian(static_cast<std::uint32_t>(size)) + block + "</AppendedData></VTKFile>";
}

TEST(VtuFormat, RefusesZipBombs) {
  const std::size_t bytes = 24'000'000;
  EXPECT_EQ(refusal_of_bytes(kRead, bomb(bytes / 24, bytes, bytes)),
            "organ:2: array 'Points' would grow far beyond the size of the file; export the file without "
            "compression");
  EXPECT_EQ(refusal_of_bytes(kRead, bomb(1000, bytes, bytes)),
            "organ:2: array 'Points' has blocks that do not make up its 24000 bytes; export the file again");
  EXPECT_EQ(refusal_of_bytes(kRead, bomb(1000, bytes, 24'000)),
            "organ:2: array 'Points' has a damaged compressed block 1; copy or export the file again");
  EXPECT_EQ(refusal_of_bytes(kRead, bomb(1000, 24'000, 24'000)), "") << "a compressed array of its true size";
}

// Arrays without compression that all name the bytes of the points.
std::string shared_offset(int num_arrays) {
  constexpr std::uint32_t kNumPoints = 10'000;
  std::string arrays;
  for (int i = 0; i < num_arrays; ++i)
    arrays += "<DataArray type=\"Float64\" Name=\"a" + std::to_string(i) +
              "\" NumberOfComponents=\"3\" format=\"appended\" offset=\"0\"/>";
  const std::string points =
      "<DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"appended\" "
      "offset=\"0\"/>";
  return "<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid>\n<Piece NumberOfPoints=\"" +
         std::to_string(kNumPoints) + "\" NumberOfCells=\"0\"><Points>" + points + "</Points><PointData>" +
         arrays + "</PointData></Piece></UnstructuredGrid><AppendedData encoding=\"raw\">_" +
         little_endian(24 * kNumPoints) + std::string(std::size_t{24} * kNumPoints, '\0') +
         "</AppendedData></VTKFile>";
}

TEST(VtuFormat, RefusesManyArraysOfTheSameBytes) {
  EXPECT_EQ(refusal_of_bytes(kRead, shared_offset(1)), "") << "an offset that two arrays share";
  EXPECT_EQ(
      refusal_of_bytes(kRead, shared_offset(300)),
      "organ:2: array 'a1' would grow far beyond the size of the file; give each array an offset of its "
      "own");
}

TEST(VtuFormat, SurvivesDamage) {
  expect_survives_damage(kRead, kTextVtu);
  expect_survives_damage(kRead, from_base64(kBase64Vtu));
  expect_survives_damage(kRead, from_base64(kZlibVtu));
  expect_survives_damage(kRead, from_base64(kRawBigEndianVtu));
  expect_survives_damage(kRead, from_base64(kRawZlibVtu));
  expect_survives_damage(kRead, from_base64(kAppendedBase64Vtu));
}

}  // namespace vtu_format_test
}  // namespace palpate::test
