// Legacy VTK files, versions 2.0 to 5.1, text or big-endian binary, with an unstructured grid or polygons:
//
//   # vtk DataFile Version 4.2       title     ASCII | BINARY     DATASET UNSTRUCTURED_GRID | POLYDATA
//   POINTS n type                    x y z of each point
//   CELLS n size                     number of nodes, nodes ... of each cell, before version 5
//   CELLS n + 1 size                 OFFSETS type, CONNECTIVITY type, since version 5
//   CELL_TYPES n                     a number for each cell
//   POINT_DATA n | CELL_DATA n       SCALARS, VECTORS, FIELD ...: values for each point or cell
//
// Source: https://docs.vtk.org/en/latest/vtk_file_formats/vtk_legacy_file_format.html. Cells that
// a MeshData does not have are counted in its notes. Cells of higher order, but tetrahedra of ten nodes, keep
// their corners alone.
#pragma once

#include <filesystem>

#include "offline/io/file_cursor.hpp"
#include "offline/io/mesh_formats.hpp"

namespace palpate {

MeshData read_vtk(FileCursor& cursor);

// Writes version 4.2, which older programs read too. Sets become arrays (set_arrays.hpp).
void write_vtk(const MeshData& mesh, const WriteOptions& options, const std::filesystem::path& file);

}  // namespace palpate
