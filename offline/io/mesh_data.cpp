#include "offline/io/mesh_data.hpp"

#include <numeric>

namespace palpate {

const char* plural_name(CellKind kind) {
  switch (kind) {
    case CellKind::point:
      return "points";
    case CellKind::line:
      return "lines";
    case CellKind::triangle:
      return "triangles";
    case CellKind::quadrilateral:
      return "quadrilaterals";
    case CellKind::tetrahedron:
      return "tetrahedra";
    case CellKind::pyramid:
      return "pyramids";
    case CellKind::wedge:
      return "wedges";
    case CellKind::hexahedron:
      return "hexahedra";
  }
  return "cells";
}

int num_corners(CellKind kind) {
  switch (kind) {
    case CellKind::point:
      return 1;
    case CellKind::line:
      return 2;
    case CellKind::triangle:
      return 3;
    case CellKind::quadrilateral:
    case CellKind::tetrahedron:
      return 4;
    case CellKind::pyramid:
      return 5;
    case CellKind::wedge:
      return 6;
    case CellKind::hexahedron:
      return 8;
  }
  return 0;
}

void number_from_one(MeshData& mesh) {
  mesh.node_labels.resize(mesh.positions.size());
  std::iota(mesh.node_labels.begin(), mesh.node_labels.end(), 1);
  for (std::size_t i = 0; i < mesh.cells.size(); ++i) mesh.cells[i].label = static_cast<int>(i) + 1;
}

}  // namespace palpate
