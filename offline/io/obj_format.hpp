// OBJ files: "v x y z" and "f a b c ..." with indices from 1, or from the end if negative. "a/b/c" names
// texture and normal behind the vertex. Polygons become triangles. Groups, "g NAME ...", become element sets.
// Other lines are passed over.
#pragma once

#include <filesystem>

#include "offline/io/file_cursor.hpp"
#include "offline/io/mesh_formats.hpp"

namespace palpate {

MeshData read_obj(const std::filesystem::path& file);
MeshData read_obj(FileCursor& cursor);

// Writes the mesh's triangles, or the outer faces of its tetrahedra (surface_cells.hpp), as text.
void write_obj(const MeshData& mesh, const WriteOptions& options, const std::filesystem::path& file);

}  // namespace palpate
