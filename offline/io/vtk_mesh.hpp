// Builds a mesh from the points, cells and arrays of VTK's files, legacy and XML. Cells have VTK's numbers of
// cell types: https://docs.vtk.org/en/latest/vtk_file_formats/vtk_legacy_file_format.html.
#pragma once

#include <cstddef>
#include <map>
#include <span>
#include <string>
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

// A file has one piece or several, each with points, cells and arrays of its own. In the first pass the mesh
// counts and checks, and keeps nothing. `line`: of the section, for messages.
class VtkMesh {
 public:
  VtkMesh(Pass pass, const FileCursor& cursor) : cursor_(cursor), keeps_(pass == Pass::build) {
    mesh_.file = cursor.file();
  }

  void begin_piece();

  // Adds `count` coordinates of points of the piece. `from`: the file, or a part of an array.
  void add_coordinates(FileCursor& from, std::size_t count, NumberType type, NumberCoding coding);

  bool has_point(int node) const { return node >= 0 && node < static_cast<int>(num_points_of_piece()); }

  // Fails at the place of `from` if the piece has no such point.
  void check_node(const FileCursor& from, int node, std::size_t cell) const;

  // Adds cells of the piece. Polygons and strips become triangles, polylines lines.
  void add_cells(const VtkCells& cells, std::size_t count);

  // Add an array with `num_rows` rows, one for each point or each cell of the piece's file.
  void add_point_array(MeshArray array, std::size_t num_rows, int line);
  void add_cell_array(MeshArray array, std::size_t num_rows, int line);

  std::size_t num_points_of_piece() const { return num_points_ - first_point_; }
  std::size_t num_cells_of_piece() const { return num_cells_ - first_cell_; }

  // Returns the mesh with its labels, sets and notes.
  MeshData finish(int line);

 private:
  // What all pieces must agree on, and the rows so far.
  struct ArrayHead {
    std::string name;
    int num_components;
    std::size_t num_rows;
  };
  using ArrayHeads = std::vector<ArrayHead>;

  void add_cell(int type, std::span<const int> nodes, int line);
  bool add_split_cell(int type, std::span<const int> nodes, int line);
  void add(CellKind kind, std::span<const int> nodes, int line);
  void check_rows(const std::string& name, std::size_t num_rows, std::size_t num_items, const char* items,
                  int line) const;
  void append(MeshArray array, ArrayHead head, std::size_t num_before, ArrayHeads& heads,
              std::vector<MeshArray>& arrays, int line) const;
  void add_notes();

  const FileCursor& cursor_;
  const bool keeps_;
  MeshData mesh_;
  Eigen::Vector3d point_;
  std::size_t num_coordinates_ = 0;
  std::size_t num_points_ = 0, num_cells_ = 0;    // in the file
  std::size_t first_point_ = 0, first_cell_ = 0;  // of the piece
  std::vector<int> sources_;                      // for each cell of the mesh in the piece: its place there
  ArrayHeads point_heads_, cell_heads_;
  std::size_t num_repeated_ = 0;     // values of cells that were split
  std::map<int, int> num_left_out_;  // by VTK's type
  std::map<CellKind, int> num_by_corners_;
};

// Returns VTK's type of a cell.
int vtk_type(const MeshCell& cell);

}  // namespace palpate
