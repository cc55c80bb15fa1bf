// A mesh as mesh files have it: points, cells, named sets and arrays. It has no laws and no supports, and is
// not checked beyond its indices. model_from_mesh.hpp makes a checked Model.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace palpate {

enum class CellKind : std::uint8_t {
  point,
  line,
  triangle,
  quadrilateral,
  tetrahedron,
  pyramid,
  wedge,
  hexahedron
};

// A cell of a mesh. Corners come in the order of VTK: base counter-clockwise seen from the top, then the top.
// A tetrahedron of ten nodes has the middles of the edges 01 12 02 03 13 23 behind its corners.
struct MeshCell {
  CellKind kind = CellKind::tetrahedron;
  int label = 0;                   // in the file; numbers from 1 where the format has no labels
  int num_nodes = 0;               // 4 or 10 for tetrahedra; the corners alone for other kinds
  std::array<int, 10> nodes = {};  // indices in MeshData::positions, num_nodes of them
  int line = 0;                    // in the file; 0 in a binary file
};

// Numbers for each point or each cell, such as "E", "nu" or a label of a segmentation.
struct MeshArray {
  std::string name;
  int num_components = 1;
  std::vector<double> values;  // [points or cells][num_components]
};

struct MeshData {
  std::string file;
  std::vector<Eigen::Vector3d> positions;  // in the file's length unit
  std::vector<int> node_labels;            // one a point; numbers from 1 where the format has no labels
  std::vector<MeshCell> cells;
  std::map<std::string, std::vector<int>> node_sets;     // sorted indices in `positions`
  std::map<std::string, std::vector<int>> element_sets;  // sorted indices in `cells`
  std::vector<MeshArray> point_arrays;
  std::vector<MeshArray> cell_arrays;
  std::vector<std::string> notes;  // one line each: content of the file that the mesh leaves out, with counts
};

// Returns "tetrahedra", "triangles", ... for messages.
const char* plural_name(CellKind kind);

// Returns the number of corners: 1 for a point, 8 for a hexahedron.
int num_corners(CellKind kind);

// Returns 0 for a point, 3 for a volume.
int dimension(CellKind kind);

// Labels nodes and cells from 1, for formats without labels.
void number_from_one(MeshData& mesh);

// Sorts each set and removes members that stand in it twice.
void sort_sets(std::map<std::string, std::vector<int>>& sets);

}  // namespace palpate
