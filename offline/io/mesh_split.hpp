// Splits hexahedra, wedges and pyramids into tetrahedra that fit together across faces.
#pragma once

#include <cstddef>

#include "offline/io/mesh_data.hpp"

namespace palpate {

// Splits every hexahedron, wedge and pyramid. Each quadrilateral is cut by the diagonal at its smallest node
// number, so neighbours agree. The tetrahedra have det F > 0 where the cell has. They keep the place, the
// element sets and the values of their cell. The first keeps its label; the others get labels above the
// largest. Returns the number of cells that were split.
std::size_t split_into_tetrahedra(MeshData& mesh);

}  // namespace palpate
