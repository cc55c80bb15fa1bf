// Reads arbitrary bytes as a mesh file. The first byte picks the format. Bad input may throw InputError
// alone.
#include <algorithm>
#include <string>

#include "offline/io/gmsh_format.hpp"
#include "offline/io/medit_format.hpp"
#include "offline/io/mesh_split.hpp"
#include "offline/io/tetgen_format.hpp"
#include "offline/mesh/input_error.hpp"
#include "tests/fuzz/fuzz_target.hpp"

namespace {

using palpate::FileCursor;
using palpate::MeshData;

FileCursor cursor(const char* name, const std::string& bytes) {
  return {name, 1, bytes};
}

// A zero byte parts the two files of TetGen.
MeshData read_tetgen_pair(const std::string& bytes) {
  const std::size_t end = std::min(bytes.find('\0'), bytes.size());
  FileCursor nodes = cursor("file.node", bytes.substr(0, end));
  FileCursor elements = cursor("file.ele", bytes.substr(std::min(end + 1, bytes.size())));
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
  for (const palpate::MeshArray& array : mesh.cell_arrays) {
    if (array.values.size() != mesh.cells.size() * static_cast<std::size_t>(array.num_components))
      __builtin_trap();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  try {
    FileCursor file = cursor("file", bytes);
    MeshData mesh;
    switch (data[0]) {
      case 'g':
        mesh = palpate::read_gmsh(file);
        break;
      case 'm':
        mesh = palpate::read_medit(file);
        break;
      case 't':
        mesh = read_tetgen_pair(bytes);
        break;
      default:
        return 0;
    }
    check(mesh);
    palpate::split_into_tetrahedra(mesh);
    check(mesh);
    ++palpate::fuzz::num_accepted;
  } catch (const palpate::InputError&) {
  }
  return 0;
}
