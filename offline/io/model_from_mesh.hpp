// The tetrahedra of a mesh file as a Model that has no materials (-1), supports and steps yet.
#pragma once

#include "offline/io/mesh_data.hpp"
#include "offline/mesh/model.hpp"

namespace palpate {

// Leaves out cells of other kinds and nodes without an element, and turns inverted elements around. Each of
// these is one line of Model::warnings with a count. Throws InputError if the mesh has no tetrahedra, or if an
// element has no volume.
Model model_from_mesh(const MeshData& mesh);

// Returns the tetrahedra of a model as a mesh, with its labels and sets.
MeshData mesh_from_model(const Model& model);

}  // namespace palpate
