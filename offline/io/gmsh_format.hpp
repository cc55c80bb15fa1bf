// Gmsh's mesh files: format 1, 2.0 to 2.2 and 4.1, text and binary.
//
// A physical group of dimension 3 becomes an element set. A group of curves or surfaces becomes an element
// set of these cells and a node set of their nodes, the middles of quadratic cells included. A group of
// points becomes a node set alone. Groups without a name are called POINT_7, CURVE_7, SURFACE_7 or VOLUME_7
// by their number. $NodeData and $ElementData become arrays: the last time step of each name. The reader
// skips all other sections.
//
// Source: Gmsh 4.11 reference manual, sections "MSH file format" and "Legacy formats".
#pragma once

#include <filesystem>

#include "offline/io/file_cursor.hpp"
#include "offline/io/mesh_data.hpp"
#include "offline/io/mesh_formats.hpp"

namespace palpate {

// Throws InputError.
MeshData read_gmsh(FileCursor& in);

// The ending of the name picks the format, as in Gmsh: .msh1, .msh2 (2.2), .msh4 (4.1); .msh is 4.1. Format 1
// has text alone. Reading the file gives the same mesh, except for a node set that an element set of curves
// or surfaces gains. A point cell in an element set becomes a node of a node set. Throws std::runtime_error.
void write_gmsh(const MeshData& mesh, const WriteOptions& options, const std::filesystem::path& file);

}  // namespace palpate
