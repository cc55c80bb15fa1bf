// Builds a mesh from the points, cells and arrays of VTK's files, legacy and XML. Cells have VTK's numbers of
// cell types: https://docs.vtk.org/en/latest/vtk_file_formats/vtk_legacy_file_format.html.
#pragma once

#include <cstddef>
#include <map>
#include <span>
#include <vector>

#include "offline/io/file_cursor.hpp"
#include "offline/io/file_number.hpp"
#include "offline/io/mesh_data.hpp"

namespace palpate {

inline constexpr int kVtkPolyVertex = 2, kVtkPolyLine = 4, kVtkTriangleStrip = 6, kVtkPolygon = 7;

// Cells as a file has them.
struct VtkCells {
  std::vector<int> types;
  std::vector<int> ends;   // of each cell in `nodes`: one behind its last
  std::vector<int> nodes;  // indices of points
  std::vector<int> lines;  // of each cell in the file; empty in a binary file
};

// A file has one piece or several, each with points, cells and arrays of its own. `line`: for messages
// about the whole section.
class VtkMesh {
 public:
  explicit VtkMesh(const FileCursor& cursor) : cursor_(cursor) { mesh_.file = cursor.file(); }

  void begin_piece();

  // Reads the points of the piece from `from`, which may be the file or a decoded array.
  void add_points(FileCursor& from, std::size_t count, NumberType type, NumberCoding coding, int line);

  // Adds the cells of the piece. Polygons and strips become triangles, polylines lines.
  void add_cells(const VtkCells& cells, int line);

  // Add an array with values for each point or each cell of the piece's file.
  void add_point_array(MeshArray array, int line);
  void add_cell_array(const MeshArray& array, int line);

  std::size_t num_points_of_piece() const { return mesh_.positions.size() - first_point_; }

  // Returns the mesh with its labels, sets and notes.
  MeshData finish(int line);

 private:
  void check_nodes(const VtkCells& cells, int line) const;
  void add_cell(int type, std::span<const int> nodes, int line);
  bool add_split_cell(int type, std::span<const int> nodes, int line);
  void add(CellKind kind, std::span<const int> nodes, int line);
  void append(MeshArray array, std::vector<MeshArray>& arrays, std::size_t num_before, int line);
  void add_notes();

  const FileCursor& cursor_;
  MeshData mesh_;
  std::size_t first_point_ = 0, first_cell_ = 0;  // of the piece
  std::size_t num_file_cells_ = 0;                // of the piece
  std::vector<int> sources_;                      // for each cell of the piece: its place in the file
  std::map<int, int> num_left_out_;               // by VTK's type
  std::map<CellKind, int> num_by_corners_;
};

// Returns VTK's type of a cell.
int vtk_type(const MeshCell& cell);

}  // namespace palpate
