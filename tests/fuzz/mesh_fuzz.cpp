// Reads arbitrary bytes as a mesh file. The first byte picks the format. Bad input may throw InputError
// alone.
#include <algorithm>
#include <array>
#include <string>

#include "offline/io/mesh_formats.hpp"
#include "offline/io/mesh_split.hpp"
#include "offline/mesh/input_error.hpp"
#include "tests/fuzz/fuzz_target.hpp"

namespace {

using palpate::FileCursor;
using palpate::MeshData;

struct Format {
  char letter;
  MeshData (*read)(FileCursor& cursor);  // null for TetGen, whose meshes have two files
};

constexpr auto kFormats = std::to_array<Format>({{'g', palpate::read_gmsh},
                                                 {'m', palpate::read_medit},
                                                 {'t', nullptr},
                                                 {'v', palpate::read_vtk},
                                                 {'x', palpate::read_vtu},
                                                 {'s', palpate::read_stl},
                                                 {'o', palpate::read_obj},
                                                 {'p', palpate::read_ply}});

// A zero byte parts the two files of TetGen.
MeshData read_tetgen_pair(const std::string& bytes) {
  const std::size_t end = std::min(bytes.find('\0'), bytes.size());
  FileCursor nodes("file.node", 1, bytes.substr(0, end));
  FileCursor elements("file.ele", 1, bytes.substr(std::min(end + 1, bytes.size())));
  return palpate::read_tetgen(nodes, elements);
}

// Ends the process where an index is out of range.
void check(const MeshData& mesh) {
  const auto expect_below = [](int index, std::size_t count) {
    if (index < 0 || static_cast<std::size_t>(index) >= count) __builtin_trap();
  };
  for (const palpate::MeshCell& cell : mesh.cells) {
    for (int i = 0; i < cell.num_nodes; ++i)
      expect_below(cell.nodes[static_cast<std::size_t>(i)], mesh.positions.size());
  }
  for (const auto& [name, set] : mesh.node_sets) {
    for (const int node : set) expect_below(node, mesh.positions.size());
  }
  for (const auto& [name, set] : mesh.element_sets) {
    for (const int cell : set) expect_below(cell, mesh.cells.size());
  }
  const auto expect_rows = [](const std::vector<palpate::MeshArray>& arrays, std::size_t count) {
    for (const palpate::MeshArray& array : arrays) {
      if (array.values.size() != count * static_cast<std::size_t>(array.num_components)) __builtin_trap();
    }
  };
  expect_rows(mesh.point_arrays, mesh.positions.size());
  expect_rows(mesh.cell_arrays, mesh.cells.size());
  for (const Eigen::Vector3d& position : mesh.positions) {
    if (!position.allFinite()) __builtin_trap();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  try {
    const auto found = std::ranges::find(kFormats, static_cast<char>(data[0]), &Format::letter);
    if (found == kFormats.end()) return 0;
    FileCursor file("file", 1, bytes);
    MeshData mesh = found->read == nullptr ? read_tetgen_pair(bytes) : found->read(file);
    check(mesh);
    palpate::split_into_tetrahedra(mesh);
    check(mesh);
    ++palpate::fuzz::num_accepted;
  } catch (const palpate::InputError&) {
  }
  return 0;
}
