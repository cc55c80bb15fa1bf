// VTK's XML files of unstructured grids (.vtu).
//
//   <VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64">
//     ... <DataArray type="Float64" Name="displacement" NumberOfComponents="3" format="appended" .../>
//     ... <AppendedData encoding="raw">
//      _[bytes: uint64][values][bytes: uint64][values] ...      offsets count from behind the underscore
//
// Source: https://docs.vtk.org/en/latest/vtk_file_formats/vtkxml_file_format.html. The reader knows arrays as
// text, base64 and appended, in each byte order, with zlib or without.
#pragma once

#include <filesystem>

#include "offline/io/file_cursor.hpp"
#include "offline/io/mesh_formats.hpp"

namespace palpate {

MeshData read_vtu(FileCursor& cursor);

// Writes raw appended arrays, which keep every bit, or text. Sets become arrays (set_arrays.hpp). Keeps
// values that are not finite, so that a failed state can be viewed.
void write_vtu(const MeshData& mesh, const WriteOptions& options, const std::filesystem::path& file);

}  // namespace palpate
