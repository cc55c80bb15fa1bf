// Formats without sets store a set as an array of 0 and 1 with the name "set:NAME".
#pragma once

#include <vector>

#include "offline/io/mesh_data.hpp"

namespace palpate {

// Turns the arrays with such a name and such values into sets.
void arrays_to_sets(MeshData& mesh);

// The arrays of the mesh and those of its sets.
std::vector<MeshArray> point_arrays_with_sets(const MeshData& mesh);
std::vector<MeshArray> cell_arrays_with_sets(const MeshData& mesh);

// Whether each number of the array is an integer of 32 bits. Writers keep labels and sets as integers.
// Vectors stay floating: a field of displacements that is zero at the start keeps its type.
bool has_integers(const MeshArray& array);

}  // namespace palpate
