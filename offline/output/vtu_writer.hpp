// Writes meshes and fields for ParaView: VTK XML UnstructuredGrid files (.vtu).
//
//   <VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64">
//     ... <DataArray type="Float64" Name="displacement" NumberOfComponents="3" format="appended" offset="..."/>
//     ... <AppendedData encoding="raw">
//      _[bytes: uint64][values][bytes: uint64][values] ...      offsets count from behind the underscore
//
// Source: https://docs.vtk.org/en/latest/design_documents/VTKFileFormats.html. Raw appended data keeps every
// bit of a double and needs no encoder.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace palpate {

// VTK's cell type numbers. VTK and Abaqus (S3, C3D4, C3D10) order the nodes of a cell alike.
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

// Writes the whole file or none. Keeps values that are not finite, so that a failed state can be viewed.
// Throws std::invalid_argument where sizes, indices or names do not match, std::runtime_error "PATH: REASON"
// where the file cannot be written.
void write_vtu(const VtuMesh& mesh, const std::filesystem::path& path);

}  // namespace palpate
