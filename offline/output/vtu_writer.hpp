// Meshes and fields for ParaView: VTK XML UnstructuredGrid files (.vtu).
//
//   <VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64">
//     ... <DataArray type="Float64" Name="displacement" NumberOfComponents="3" format="appended"
//     offset="..."/> ... <AppendedData encoding="raw">
//      _[bytes: uint64][values][bytes: uint64][values] ...      offsets count from behind the underscore
//
// Source: VTK file formats, "XML file formats",
// https://docs.vtk.org/en/latest/design_documents/VTKFileFormats.html Raw appended data keeps every bit of a
// double and needs no encoder on either side.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace palpate {

// VTK's own cell type numbers. The order of a cell's nodes is that of Abaqus' S3, C3D4 and C3D10: the two
// agree.
enum class VtuCell : std::uint8_t { kTriangle = 5, kTetrahedron = 10, kQuadraticTetrahedron = 24 };

int nodes_per_cell(VtuCell cell);  // 3, 4, 10

// A named field over the points or over the cells.
struct VtuArray {
  std::string name;
  int components = 1;          // 1 a scalar, 3 a vector (x, y, z)
  std::vector<double> values;  // count * components, the components of one point or cell side by side
};

struct VtuIntegerArray {
  std::string name;
  std::vector<int> values;  // one a point or cell
};

struct VtuMesh {
  std::vector<Eigen::Vector3d> points;  // length unit
  std::vector<VtuCell> cells;
  std::vector<int> connectivity;  // indices in `points`, nodes_per_cell(cell) for each cell in turn
  std::vector<VtuArray> point_data;
  std::vector<VtuIntegerArray> point_integers;  // e.g. node labels of the input
  std::vector<VtuArray> cell_data;
  std::vector<VtuIntegerArray> cell_integers;  // e.g. material of each element
};

// Writes `path` whole or not at all. Values that are not finite are written as they are: a failed state is
// worth a look. Throws std::invalid_argument when the sizes, indices or names do not fit together,
// std::runtime_error "PATH: REASON" when the file cannot be written.
void write_vtu(const VtuMesh& mesh, const std::filesystem::path& path);

}  // namespace palpate
