// Brings the middles of ten-node tetrahedra into the order of MeshCell.
#pragma once

#include "offline/io/mesh_data.hpp"

namespace palpate {

// Programs disagree on the order of the middles in TetGen's and Medit's files. A middle belongs to the edge
// whose centre is nearest. The order that most cells of the mesh have counts for all of them.
void sort_middles(MeshData& mesh);

}  // namespace palpate
