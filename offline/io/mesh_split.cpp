// A cell is cut into the tetrahedra between its smallest node and its faces that do not touch this node. The
// smallest node also cuts all its own quadrilaterals, so no further face is needed. The rule for a
// quadrilateral is that of J. Dompierre et al., "How to subdivide pyramids, prisms and hexahedra into
// tetrahedra", 8th International Meshing Roundtable 1999.
#include "offline/io/mesh_split.hpp"

#include <algorithm>
#include <array>
#include <climits>
#include <span>
#include <stdexcept>

namespace palpate {
namespace {

// Corners counter-clockwise seen from outside; -1 ends a triangle.
using Face = std::array<int, 4>;
using Corners = std::array<int, 4>;  // nodes of a tetrahedron

constexpr std::array<Face, 6> kHexahedron = {
    {{0, 3, 2, 1}, {4, 5, 6, 7}, {0, 1, 5, 4}, {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}}};
constexpr std::array<Face, 5> kWedge = {
    {{0, 2, 1, -1}, {3, 4, 5, -1}, {0, 1, 4, 3}, {1, 2, 5, 4}, {2, 0, 3, 5}}};
constexpr std::array<Face, 5> kPyramid = {
    {{0, 3, 2, 1}, {0, 1, 4, -1}, {1, 2, 4, -1}, {2, 3, 4, -1}, {3, 0, 4, -1}}};

std::span<const Face> faces_of(CellKind kind) {
  switch (kind) {
    case CellKind::hexahedron:
      return kHexahedron;
    case CellKind::wedge:
      return kWedge;
    case CellKind::pyramid:
      return kPyramid;
    default:
      return {};
  }
}

// Adds the tetrahedron between `apex` and a face. A triangle that touches the apex or has a node twice has no
// volume.
void add_tetrahedron(int apex, int a, int b, int c, std::vector<Corners>& found) {
  if (a != apex && b != apex && c != apex && a != b && b != c && c != a) found.push_back({apex, a, b, c});
}

void split_cell(const MeshCell& cell, std::vector<Corners>& found) {
  found.clear();
  const int apex = *std::min_element(cell.nodes.begin(), cell.nodes.begin() + cell.num_nodes);
  for (const Face& face : faces_of(cell.kind)) {
    std::array<int, 4> nodes = {-1, -1, -1, -1};
    const int num = face[3] < 0 ? 3 : 4;
    for (std::size_t i = 0; i < static_cast<std::size_t>(num); ++i)
      nodes[i] = cell.nodes[static_cast<std::size_t>(face[i])];
    if (num == 4) {
      std::rotate(nodes.begin(), std::min_element(nodes.begin(), nodes.end()), nodes.end());
      add_tetrahedron(apex, nodes[0], nodes[2], nodes[3], found);
    }
    add_tetrahedron(apex, nodes[0], nodes[1], nodes[2], found);
  }
}

int largest_label(const MeshData& mesh) {
  int largest = 0;
  for (const MeshCell& cell : mesh.cells) largest = std::max(largest, cell.label);
  return largest;
}

}  // namespace

std::size_t split_into_tetrahedra(MeshData& mesh) {
  std::size_t num_split = 0;
  std::int64_t label = largest_label(mesh);
  std::vector<MeshCell> cells;
  std::vector<std::size_t> first;  // new index of the first part of each cell, and the end
  std::vector<Corners> parts;
  for (const MeshCell& cell : mesh.cells) {
    first.push_back(cells.size());
    if (faces_of(cell.kind).empty()) {
      cells.push_back(cell);
      continue;
    }
    ++num_split;
    split_cell(cell, parts);
    for (std::size_t i = 0; i < parts.size(); ++i) {
      MeshCell part = {
          .label = i == 0 ? cell.label : static_cast<int>(++label), .num_nodes = 4, .line = cell.line};
      std::copy(parts[i].begin(), parts[i].end(), part.nodes.begin());
      cells.push_back(part);
    }
    if (label > INT_MAX - 12)
      throw std::runtime_error(mesh.file + ": labels end at 2147483647; renumber the elements");
  }
  first.push_back(cells.size());

  for (auto& [name, set] : mesh.element_sets) {
    std::vector<int> of_parts;
    for (const int index : set) {
      const auto at = static_cast<std::size_t>(index);
      for (std::size_t i = first[at]; i < first[at + 1]; ++i) of_parts.push_back(static_cast<int>(i));
    }
    set = std::move(of_parts);
  }
  for (MeshArray& array : mesh.cell_arrays) {
    const auto size = static_cast<std::size_t>(array.num_components);
    std::vector<double> of_parts;
    of_parts.reserve(cells.size() * size);
    for (std::size_t at = 0; at + 1 < first.size(); ++at) {
      for (std::size_t i = first[at]; i < first[at + 1]; ++i) {
        const auto from = array.values.begin() + static_cast<std::ptrdiff_t>(at * size);
        of_parts.insert(of_parts.end(), from, from + static_cast<std::ptrdiff_t>(size));
      }
    }
    array.values = std::move(of_parts);
  }
  mesh.cells = std::move(cells);
  return num_split;
}

}  // namespace palpate
