// STL files: the triangles of a surface, as text ("solid NAME", "facet ...") or binary:
//
//   80 bytes of title, uint32 n, then n times: normal, three corners (float32), two bytes of attributes
//
// Corners at equal coordinates become one node; normals are passed over. Several solids with names become
// element sets.
#pragma once

#include <filesystem>

#include "offline/io/file_cursor.hpp"
#include "offline/io/mesh_formats.hpp"

namespace palpate {

MeshData read_stl(const std::filesystem::path& file);
MeshData read_stl(FileCursor& cursor);

// Writes the mesh's triangles, or the outer faces of its tetrahedra (surface_cells.hpp). A binary file keeps
// seven digits of a coordinate, text keeps all.
void write_stl(const MeshData& mesh, const WriteOptions& options, const std::filesystem::path& file);

}  // namespace palpate
