// Mesh files held in strings: read, damaged, and compared.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "offline/io/file_cursor.hpp"
#include "offline/io/mesh_formats.hpp"
#include "offline/mesh/input_error.hpp"
#include "tests/support/mesh_files.hpp"
#include "tests/support/temp_dir.hpp"

namespace palpate::test {

using CursorReader = MeshData (*)(FileCursor& cursor);
using MeshWriter = void (*)(const MeshData&, const WriteOptions&, const std::filesystem::path&);

inline MeshData read_bytes(CursorReader read, std::string_view bytes) {
  FileCursor cursor("organ", 1, std::string(bytes));
  return read(cursor);
}

// The message that refuses the bytes; "" if they are a mesh. Any other exception fails the test.
inline std::string refusal_of_bytes(CursorReader read, std::string_view bytes) {
  try {
    read_bytes(read, bytes);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

// Every shorter file is refused in one line or is a mesh, and so is every file with one byte changed.
inline void expect_survives_damage(CursorReader read, const std::string& bytes) {
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    const std::string message = refusal_of_bytes(read, std::string_view(bytes).substr(0, size));
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
  }
  for (std::size_t at = 0; at < bytes.size(); ++at) {
    for (const char changed : {'\0', '9', '-', '\x7f', '\xff'}) {
      std::string damaged = bytes;
      damaged[at] = changed;
      const std::string message = refusal_of_bytes(read, damaged);
      EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    }
  }
}

// Writes the mesh, and returns what `read` makes of the file.
inline MeshData round_trip(const MeshData& mesh, MeshWriter write, CursorReader read, bool is_binary) {
  const TempDir dir;
  write(mesh, {.is_binary = is_binary}, dir.path() / "organ");
  FileCursor cursor(dir.path() / "organ");
  return read(cursor);
}

inline void expect_equal_cells(const MeshData& found, const MeshData& expected) {
  EXPECT_EQ(found.positions, expected.positions);
  ASSERT_EQ(found.cells.size(), expected.cells.size());
  for (std::size_t i = 0; i < found.cells.size(); ++i) {
    EXPECT_EQ(found.cells[i].kind, expected.cells[i].kind) << i;
    EXPECT_EQ(found.cells[i].num_nodes, expected.cells[i].num_nodes) << i;
    EXPECT_EQ(found.cells[i].nodes, expected.cells[i].nodes) << i;
  }
}

inline void expect_equal_meshes(const MeshData& found, const MeshData& expected) {
  expect_equal_cells(found, expected);
  EXPECT_EQ(found.node_sets, expected.node_sets);
  EXPECT_EQ(found.element_sets, expected.element_sets);
  expect_equal_arrays(found.point_arrays, expected.point_arrays);
  expect_equal_arrays(found.cell_arrays, expected.cell_arrays);
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

// A cell of each kind, sets, and arrays with names that files must quote.
inline MeshData mesh_of_all_kinds() {
  MeshData mesh;
  for (int i = 0; i < 12; ++i) mesh.positions.emplace_back(i / 3.0, i * i, -0.1 * (i % 4));
  const auto add = [&](CellKind kind, int num_nodes) {
    MeshCell cell;
    cell.kind = kind;
    cell.num_nodes = num_nodes;
    for (int i = 0; i < num_nodes; ++i) cell.nodes[static_cast<std::size_t>(i)] = (5 * i + num_nodes) % 12;
    mesh.cells.push_back(cell);
  };
  for (const CellKind kind :
       {CellKind::point, CellKind::line, CellKind::triangle, CellKind::quadrilateral, CellKind::tetrahedron,
        CellKind::pyramid, CellKind::wedge, CellKind::hexahedron})
    add(kind, num_corners(kind));
  add(CellKind::tetrahedron, 10);
  mesh.node_sets = {{"FIXED", {0, 3, 11}}, {"NONE", {}}};
  mesh.element_sets = {{"left lobe", {4, 8}}};
  mesh.point_arrays = {{"u <1> & \"2\"", 3, {}}, {"id", 1, {}}};
  for (int i = 0; i < 36; ++i) mesh.point_arrays[0].values.push_back(i / 7.0);
  for (int i = 0; i < 12; ++i) mesh.point_arrays[1].values.push_back(2147483647 - i);
  mesh.cell_arrays = {{"E", 1, {0.1, 1e300, -3, 4, 5, 6, 7, 8, 1e-300}},
                      {"100% label", 1, {9, 8, 7, 6, 5, 4, 3, 2, 1}}};
  return mesh;
}

}  // namespace palpate::test
