// TetGen's files: NAME.node with the points and NAME.ele with tetrahedra of 4 or 10 nodes.
//
// Boundary markers of points become node sets MARKER_n. The last attribute of tetrahedra, the region, becomes
// element sets REGION_n where all its values are integers. Other attributes become arrays.
//
// Source: H. Si, TetGen 1.5 user's manual, 2013, section 5.2.
#pragma once

#include <filesystem>

#include "offline/io/file_cursor.hpp"
#include "offline/io/mesh_data.hpp"
#include "offline/io/mesh_formats.hpp"

namespace palpate {

// `file`: either of the two files; the other stands beside it. Throw InputError.
MeshData read_tetgen(const std::filesystem::path& file);
MeshData read_tetgen(FileCursor& nodes, FileCursor& elements);

// Writes both files beside each other. Comments tell the names of sets and arrays to read_tetgen(). Points,
// lines, triangles and quadrilaterals have no place and are left out. Throws std::runtime_error where other
// volumes than tetrahedra stand in the mesh, or tetrahedra of 4 and of 10 nodes.
void write_tetgen(const MeshData& mesh, const WriteOptions& options, const std::filesystem::path& file);

}  // namespace palpate
