// The mesh of an Abaqus-style .inp file: nodes, tetrahedra and sets. offline/mesh reads whole models.
#pragma once

#include <filesystem>
#include <string>

#include "offline/io/mesh_formats.hpp"

namespace palpate {

// Reads nodes, tetrahedra and sets; materials, supports and steps may be absent and are not checked.
MeshData read_inp_mesh_file(const std::filesystem::path& file);

// Writes nodes, tetrahedra and sets. Throws if the mesh has no tetrahedra.
void write_inp_mesh(const MeshData& mesh, const WriteOptions& options, const std::filesystem::path& file);

// Returns the text of *NODE, *ELEMENT, *NSET and *ELSET. Cells of other kinds are left out. Element set ALL
// has every element unless the mesh has a set of this name.
std::string inp_mesh_text(const MeshData& mesh);

}  // namespace palpate
