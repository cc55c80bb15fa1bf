// Writes meshes and fields for ParaView: VTK XML UnstructuredGrid files (.vtu).
//
//   <VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64">
//     ... <DataArray type="Float64" Name="displacement" NumberOfComponents="3" format="appended" .../>
//     ... <AppendedData encoding="raw">
//      _[bytes: uint64][values][bytes: uint64][values] ...      offsets count from behind the underscore
//
// Source: https://docs.vtk.org/en/latest/design_documents/VTKFileFormats.html. Raw data keeps every bit.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace palpate {

// VTK's cell type numbers. VTK and Abaqus (C3D4, C3D10) order the nodes of a cell alike.
enum class VtuCell : std::uint8_t { kTetrahedron = 10, kQuadraticTetrahedron = 24 };

// Named fields. Names are plain words: the writer escapes nothing.
struct VtuVectors {
  std::string name;
  std::vector<double> values;  // x, y, z of each point
};

struct VtuIntegers {
  std::string name;
  std::vector<int> values;  // one for each point or cell
};

struct VtuMesh {
  std::vector<Eigen::Vector3d> points;  // length unit; at least one
  std::vector<VtuCell> cells;
  std::vector<int> connectivity;  // indices in `points`, the 4 or 10 nodes of each cell in turn
  std::vector<VtuVectors> point_vectors;
  std::vector<VtuIntegers> point_integers;  // e.g. node labels of the input
  std::vector<VtuIntegers> cell_integers;   // e.g. material of each element
};

// Writes the whole file or none. Keeps values that are not finite, so that a failed state can be viewed.
// Throws std::runtime_error "PATH: REASON; REMEDY" where the file cannot be written.
void write_vtu(const VtuMesh& mesh, const std::filesystem::path& path);

}  // namespace palpate
