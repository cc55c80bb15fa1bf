// Medit's text mesh files, .mesh, as Mmg, Gmsh and libMeshb write them.
//
// References become sets REF_n: of vertices node sets, of cells element sets. Edges, triangles and
// quadrilaterals also give their nodes to the node set of their reference. Quadratic tetrahedra keep their
// middles, other quadratic cells their corners. Sections without cells, such as Normals, are skipped.
//
// Source: L. Marechal, libMeshb 7, "Handling meshes and solutions files", and P. Frey, "Medit", INRIA
// RT-0253, 2001.
#pragma once

#include <filesystem>

#include "offline/io/file_cursor.hpp"
#include "offline/io/mesh_data.hpp"
#include "offline/io/mesh_formats.hpp"

namespace palpate {

// Throws InputError.
MeshData read_medit(FileCursor& in);

// Comments tell the names of sets to read_medit(). The format has no labels and no arrays, and groups cells
// by their kind. Throws std::runtime_error.
void write_medit(const MeshData& mesh, const WriteOptions& options, const std::filesystem::path& file);

}  // namespace palpate
