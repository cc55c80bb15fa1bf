#include "offline/io/mesh_data.hpp"

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

}  // namespace palpate
