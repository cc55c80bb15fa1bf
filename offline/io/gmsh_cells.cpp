#include "offline/io/gmsh_cells.hpp"

#include <algorithm>
#include <array>

namespace palpate {
namespace {

using enum CellKind;

constexpr std::array<GmshType, 40> kTypes = {{
    {1, line, 2, "lines"},
    {2, triangle, 3, "triangles"},
    {3, quadrilateral, 4, "quadrilaterals"},
    {4, tetrahedron, 4, "tetrahedra"},
    {5, hexahedron, 8, "hexahedra"},
    {6, wedge, 6, "wedges"},
    {7, pyramid, 5, "pyramids"},
    {8, line, 3, "quadratic lines"},
    {9, triangle, 6, "quadratic triangles"},
    {10, quadrilateral, 9, "quadratic quadrilaterals of 9 nodes"},
    {11, tetrahedron, 10, "quadratic tetrahedra"},
    {12, hexahedron, 27, "quadratic hexahedra of 27 nodes"},
    {13, wedge, 18, "quadratic wedges of 18 nodes"},
    {14, pyramid, 14, "quadratic pyramids of 14 nodes"},
    {15, point, 1, "points"},
    {16, quadrilateral, 8, "quadratic quadrilaterals of 8 nodes"},
    {17, hexahedron, 20, "quadratic hexahedra of 20 nodes"},
    {18, wedge, 15, "quadratic wedges of 15 nodes"},
    {19, pyramid, 13, "quadratic pyramids of 13 nodes"},
    {20, triangle, 9, "cubic triangles of 9 nodes"},
    {21, triangle, 10, "cubic triangles of 10 nodes"},
    {22, triangle, 12, "triangles of 12 nodes"},
    {23, triangle, 15, "triangles of 15 nodes"},
    {24, triangle, 15, "triangles of 15 nodes"},
    {25, triangle, 21, "triangles of 21 nodes"},
    {26, line, 4, "lines of 4 nodes"},
    {27, line, 5, "lines of 5 nodes"},
    {28, line, 6, "lines of 6 nodes"},
    {36, quadrilateral, 16, "quadrilaterals of 16 nodes"},
    {37, quadrilateral, 25, "quadrilaterals of 25 nodes"},
    {38, quadrilateral, 36, "quadrilaterals of 36 nodes"},
    {29, tetrahedron, 20, "cubic tetrahedra of 20 nodes", false},
    {30, tetrahedron, 35, "tetrahedra of 35 nodes", false},
    {31, tetrahedron, 56, "tetrahedra of 56 nodes", false},
    {90, wedge, 40, "cubic wedges of 40 nodes", false},
    {91, wedge, 75, "wedges of 75 nodes", false},
    {92, hexahedron, 64, "cubic hexahedra of 64 nodes", false},
    {93, hexahedron, 125, "hexahedra of 125 nodes", false},
    {118, pyramid, 30, "cubic pyramids of 30 nodes", false},
    {119, pyramid, 55, "pyramids of 55 nodes", false},
}};

}  // namespace

const GmshType* find_gmsh_type(int number) {
  const auto found =
      std::find_if(kTypes.begin(), kTypes.end(), [&](const GmshType& type) { return type.number == number; });
  return found == kTypes.end() ? nullptr : &*found;
}

const GmshType& gmsh_type(const MeshCell& cell) {
  return *std::find_if(kTypes.begin(), kTypes.end(), [&](const GmshType& type) {
    return type.kind == cell.kind && type.num_nodes == cell.num_nodes;
  });
}

int num_kept_nodes(const GmshType& type) {
  return type.kind == tetrahedron ? type.num_nodes : num_corners(type.kind);
}

int gmsh_place(const GmshType& type, int i) {
  if (type.kind != tetrahedron || i < 8) return i;
  return i == 8 ? 9 : 8;
}

}  // namespace palpate
