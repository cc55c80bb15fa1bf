// What the tests of mesh formats share: bytes, a mesh with everything, comparison, and damage.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "offline/io/file_cursor.hpp"
#include "offline/io/mesh_formats.hpp"
#include "offline/mesh/input_error.hpp"
#include "tests/support/temp_dir.hpp"

namespace palpate::test {

using CursorReader = MeshData (*)(FileCursor& cursor);
using MeshReader = std::function<MeshData(const std::string& bytes)>;
using MeshWriter = void (*)(const MeshData&, const WriteOptions&, const std::filesystem::path&);

inline MeshData read_bytes(CursorReader read, std::string_view bytes) {
  FileCursor cursor("organ", 1, std::string(bytes));
  return read(cursor);
}

// The message of the refusal, or "" where the reader accepts the bytes. Any other exception fails the test.
inline std::string refusal(const MeshReader& read, const std::string& bytes) {
  try {
    read(bytes);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

inline std::string refusal_of_bytes(CursorReader read, std::string_view bytes) {
  return refusal([&](const std::string& copy) { return read_bytes(read, copy); }, std::string(bytes));
}

// Text with `from` replaced by `to` once.
inline std::string edited(std::string text, std::string_view from, std::string_view to) {
  const std::size_t at = text.find(from);
  if (at == std::string::npos) throw std::logic_error("no '" + std::string(from) + "' to edit");
  return text.replace(at, from.size(), to);
}

// Bytes from pairs of hexadecimal digits.
inline std::string bytes_of(std::string_view hex) {
  std::string bytes;
  for (std::size_t i = 0; i + 1 < hex.size(); i += 2)
    bytes += static_cast<char>(std::stoi(std::string(hex.substr(i, 2)), nullptr, 16));
  return bytes;
}

// Bytes of a binary file that a source file holds as base64.
inline std::string from_base64(std::string_view text) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  unsigned bits = 0;
  int num_bits = 0;
  for (const char letter : text) {
    const std::size_t digit = kDigits.find(letter);
    if (digit == std::string_view::npos) continue;
    bits = (bits << 6 | static_cast<unsigned>(digit)) & 0xffff;
    num_bits += 6;
    if (num_bits < 8) continue;
    num_bits -= 8;
    bytes += static_cast<char>(bits >> num_bits & 0xff);
  }
  return bytes;
}

// Cuts the file at every byte and changes every byte. The reader must accept the result or refuse it in one
// short line with the name of the file. Returns the number of refusals.
inline int expect_clear_refusals(const MeshReader& read, const std::string& bytes) {
  int num_refused = 0;
  const auto expect_clear = [&](const std::string& damaged) {
    const std::string message = refusal(read, damaged);
    if (message.empty()) return;
    ++num_refused;
    EXPECT_EQ(message.find_first_of("\n\r"), std::string::npos) << message;
    EXPECT_TRUE(message.starts_with("file") || message.starts_with("organ")) << message;
    EXPECT_NE(message.find(';'), std::string::npos) << message;
    EXPECT_LT(message.size(), 300U);
  };
  for (std::size_t size = 0; size < bytes.size(); ++size) expect_clear(bytes.substr(0, size));
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    for (const char letter : {'\0', '\x7f', '\xff', '9', '-', '\n', ' ', '#'}) {
      std::string damaged = bytes;
      damaged[i] = letter;
      expect_clear(damaged);
    }
  }
  return num_refused;
}

inline int expect_survives_damage(CursorReader read, const std::string& bytes) {
  return expect_clear_refusals([&](const std::string& copy) { return read_bytes(read, copy); }, bytes);
}

// Writes the mesh, and returns what `read` makes of the file.
inline MeshData round_trip(const MeshData& mesh, MeshWriter write, CursorReader read, bool is_binary) {
  const TempDir dir;
  write(mesh, {.is_binary = is_binary}, dir.path() / "organ");
  FileCursor cursor(dir.path() / "organ");
  return read(cursor);
}

inline MeshCell cell_of(CellKind kind, int label, const std::vector<int>& nodes) {
  MeshCell cell = {.kind = kind, .label = label, .num_nodes = static_cast<int>(nodes.size())};
  std::copy(nodes.begin(), nodes.end(), cell.nodes.begin());
  return cell;
}

// A mesh with each kind of cell, in the order of Medit's sections, with labels, sets that overlap, and
// arrays. Its last cell is a straight tetrahedron of ten nodes. Other cells have no sensible shape.
inline MeshData mesh_with_everything() {
  MeshData mesh;
  for (int i = 0; i < 8; ++i)
    mesh.positions.emplace_back(0.1 * i, 1.0 / (i + 3), i % 2 == 0 ? -1e-20 * i : 3e7);
  constexpr int kCorners[4][3] = {{0, 0, 0}, {2, 0, 0}, {0, 3, 0}, {0, 0, 4}};
  constexpr int kEdges[6][2] = {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}};
  for (const auto& corner : kCorners) mesh.positions.emplace_back(corner[0], corner[1], corner[2]);
  for (const auto& edge : kEdges) {
    const Eigen::Vector3d a = mesh.positions[static_cast<std::size_t>(8 + edge[0])];
    const Eigen::Vector3d b = mesh.positions[static_cast<std::size_t>(8 + edge[1])];
    mesh.positions.push_back(0.5 * (a + b));
  }
  for (int i = 0; i < 18; ++i) mesh.node_labels.push_back(5 * (18 - i));
  mesh.cells = {cell_of(CellKind::line, 70, {3, 1}),
                cell_of(CellKind::triangle, 60, {2, 1, 0}),
                cell_of(CellKind::triangle, 61, {2, 1, 5}),
                cell_of(CellKind::quadrilateral, 50, {4, 5, 6, 7}),
                cell_of(CellKind::tetrahedron, 4, {7, 0, 1, 2}),
                cell_of(CellKind::tetrahedron, 5, {7, 6, 1, 2}),
                cell_of(CellKind::pyramid, 3, {0, 1, 2, 3, 4}),
                cell_of(CellKind::wedge, 2, {5, 4, 3, 2, 1, 0}),
                cell_of(CellKind::hexahedron, 1, {0, 1, 2, 3, 7, 6, 5, 4}),
                cell_of(CellKind::tetrahedron, 100, {8, 9, 10, 11, 12, 13, 14, 15, 16, 17})};
  mesh.node_sets = {{"FIXED", {0, 1, 2, 5}}, {"MARKER_7", {3}}, {"PROBE", {2, 9, 17}}, {"Two words", {2, 3}}};
  mesh.element_sets = {
      {"FIXED", {1, 2}}, {"REGION_3", {4}}, {"STIFF", {5, 8, 9}}, {"TISSUE", {4, 5, 6, 7, 8, 9}}};
  MeshArray temperature = {"temperature", 1, {}};
  MeshArray push = {"push of a tool", 3, {}};
  for (int i = 0; i < 18; ++i) temperature.values.push_back(i / 7.0);
  for (int i = 0; i < 54; ++i) push.values.push_back(-1e-3 * i);
  MeshArray modulus = {"E", 1, {}};
  for (int i = 0; i < 10; ++i) modulus.values.push_back(1000 + i);
  mesh.point_arrays = {temperature, push};
  mesh.cell_arrays = {modulus};
  return mesh;
}

inline void expect_equal_arrays(const std::vector<MeshArray>& found, const std::vector<MeshArray>& expected) {
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t i = 0; i < found.size(); ++i) {
    EXPECT_EQ(found[i].name, expected[i].name);
    EXPECT_EQ(found[i].num_components, expected[i].num_components);
    EXPECT_EQ(found[i].values, expected[i].values);
  }
}

// Exactly equal points, cells and sets.
inline void expect_equal_meshes(const MeshData& found, const MeshData& expected, bool with_labels) {
  EXPECT_EQ(found.positions, expected.positions);
  if (with_labels) {
    EXPECT_EQ(found.node_labels, expected.node_labels);
  }
  ASSERT_EQ(found.cells.size(), expected.cells.size());
  for (std::size_t i = 0; i < found.cells.size(); ++i) {
    EXPECT_EQ(found.cells[i].kind, expected.cells[i].kind) << "cell " << i;
    EXPECT_EQ(found.cells[i].num_nodes, expected.cells[i].num_nodes) << "cell " << i;
    EXPECT_EQ(found.cells[i].nodes, expected.cells[i].nodes) << "cell " << i;
    if (with_labels) {
      EXPECT_EQ(found.cells[i].label, expected.cells[i].label) << "cell " << i;
    }
  }
  EXPECT_EQ(found.node_sets, expected.node_sets);
  EXPECT_EQ(found.element_sets, expected.element_sets);
}

// Equal arrays, too; labels may differ.
inline void expect_equal_meshes(const MeshData& found, const MeshData& expected) {
  expect_equal_meshes(found, expected, false);
  expect_equal_arrays(found.point_arrays, expected.point_arrays);
  expect_equal_arrays(found.cell_arrays, expected.cell_arrays);
}

// The mesh with everything under names and numbers that VTK's files must quote or keep whole.
inline MeshData mesh_with_odd_names() {
  MeshData mesh = mesh_with_everything();
  mesh.cells.push_back(cell_of(CellKind::point, 11, {5}));
  mesh.node_sets["NONE"] = {};
  mesh.point_arrays[0].name = "u <1> & \"2\"";
  mesh.point_arrays[1].values[7] = 1e300;
  mesh.cell_arrays[0].name = "100% label";
  mesh.cell_arrays[0].values.push_back(2147483647);
  mesh.cell_arrays.push_back({"E", 1, std::vector<double>(mesh.cells.size(), 1e-300)});
  return mesh;
}

}  // namespace palpate::test
