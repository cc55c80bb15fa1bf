// Fills a closed surface with tetrahedra: Delaunay refinement, then a perturbation of nodes and weights that
// removes slivers (CGAL's Mesh_3).
#pragma once

#include <array>
#include <string>
#include <vector>

#include "offline/io/mesh_data.hpp"
#include "offline/mesher/closed_surface.hpp"
#include "offline/mesher/size_field.hpp"

namespace palpate {

struct FilledSolid {
  MeshData mesh;            // tetrahedra alone, turned as mesh_data.hpp says
  double sharp_length = 0;  // of the sharp edges that the mesh follows
  double deviation = 0;     // the largest distance between the two surfaces, either way
};

// Equal input gives equal output. Throws InputError where the refinement does not end, at `most_nodes`, or
// gives no tetrahedra.
FilledSolid fill_solid(const ClosedSurface& closed, const SizeField& sizes, std::size_t most_nodes,
                       const std::string& file);

}  // namespace palpate
