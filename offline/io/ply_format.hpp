// PLY files of surfaces, text or binary in each byte order:
//
//   ply     format ascii | binary_little_endian | binary_big_endian 1.0
//   element vertex n     property float x ...
//   element face n       property list uchar int vertex_indices ...
//   end_header           the elements in turn, each with its properties
//
// Polygons become triangles. Other elements and properties are passed over.
#pragma once

#include <filesystem>

#include "offline/io/file_cursor.hpp"
#include "offline/io/mesh_formats.hpp"

namespace palpate {

MeshData read_ply(FileCursor& cursor);

// Writes the mesh's triangles, or the outer faces of its tetrahedra (surface_cells.hpp), with doubles.
void write_ply(const MeshData& mesh, const WriteOptions& options, const std::filesystem::path& file);

}  // namespace palpate
