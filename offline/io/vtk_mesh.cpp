#include "offline/io/vtk_mesh.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <climits>
#include <cmath>
#include <utility>

#include "offline/io/set_arrays.hpp"
#include "offline/io/surface_cells.hpp"
#include "offline/mesh/text_number.hpp"

namespace palpate {
namespace {

struct VtkCellType {
  int type;
  CellKind kind;
  bool is_linear;  // no nodes but the corners
};

// Each part of a split cell gets the values of the cell. So many repeated values of all arrays may fall to a
// cell of the mesh, so that a small file cannot fill the memory.
constexpr std::size_t kMostRepeated = 100;

constexpr int kPixel = 8, kVoxel = 11, kQuadraticTetrahedron = 24, kLagrangeTetrahedron = 71;

// The corners come first in each type. 68 and above: Lagrange and Bezier cells of any order.
constexpr auto kVtkCellTypes = std::to_array<VtkCellType>({
    {1, CellKind::point, true},           {3, CellKind::line, true},
    {5, CellKind::triangle, true},        {kPixel, CellKind::quadrilateral, true},
    {9, CellKind::quadrilateral, true},   {10, CellKind::tetrahedron, true},
    {kVoxel, CellKind::hexahedron, true}, {12, CellKind::hexahedron, true},
    {13, CellKind::wedge, true},          {14, CellKind::pyramid, true},
    {21, CellKind::line, false},          {22, CellKind::triangle, false},
    {23, CellKind::quadrilateral, false}, {kQuadraticTetrahedron, CellKind::tetrahedron, false},
    {25, CellKind::hexahedron, false},    {26, CellKind::wedge, false},
    {27, CellKind::pyramid, false},       {28, CellKind::quadrilateral, false},
    {29, CellKind::hexahedron, false},    {30, CellKind::quadrilateral, false},
    {31, CellKind::wedge, false},         {32, CellKind::wedge, false},
    {33, CellKind::hexahedron, false},    {34, CellKind::triangle, false},
    {35, CellKind::line, false},          {37, CellKind::pyramid, false},
    {68, CellKind::line, false},          {69, CellKind::triangle, false},
    {70, CellKind::quadrilateral, false}, {kLagrangeTetrahedron, CellKind::tetrahedron, false},
    {72, CellKind::hexahedron, false},    {73, CellKind::wedge, false},
    {74, CellKind::pyramid, false},       {75, CellKind::line, false},
    {76, CellKind::triangle, false},      {77, CellKind::quadrilateral, false},
    {78, CellKind::tetrahedron, false},   {79, CellKind::hexahedron, false},
    {80, CellKind::wedge, false},         {81, CellKind::pyramid, false},
});

}  // namespace

void VtkMesh::begin_piece() {
  first_point_ = num_points_;
  first_cell_ = num_cells_;
  num_coordinates_ = 0;
  // Pieces before were empty, and so are their arrays.
  if (first_point_ == 0) {
    mesh_.point_arrays.clear();
    point_heads_.clear();
  }
  if (first_cell_ == 0) {
    mesh_.cell_arrays.clear();
    cell_heads_.clear();
  }
  sources_.clear();
}

void VtkMesh::add_coordinates(FileCursor& from, std::size_t count, NumberType type, NumberCoding coding) {
  for (std::size_t i = 0; i < count; ++i) {
    const double coordinate = next_number(from, type, coding, "a coordinate");
    if (!std::isfinite(coordinate))
      from.fail(fmt::format("point {} has a coordinate that is no finite number; correct it",
                            num_points_of_piece()));
    point_[static_cast<Eigen::Index>(num_coordinates_ % 3)] = coordinate;
    if (++num_coordinates_ % 3 != 0) continue;
    if (keeps_) mesh_.positions.push_back(point_);
    if (++num_points_ > INT_MAX) from.fail("has more than 2147483647 points; split the mesh");
  }
}

void VtkMesh::check_node(const FileCursor& from, int node, std::size_t cell) const {
  if (!has_point(node))
    from.fail(fmt::format("cell {} names point {}, where points are 0 to {}; export the file again", cell,
                          node, static_cast<int>(num_points_of_piece()) - 1));
}

void VtkMesh::add_cells(const VtkCells& cells, std::size_t count) {
  std::vector<int> nodes;
  std::size_t begin = 0;
  for (std::size_t i = 0; i < count && keeps_; ++i) {
    const auto end = static_cast<std::size_t>(cells.ends[i]);
    nodes.clear();
    for (std::size_t at = begin; at < end; ++at)
      nodes.push_back(static_cast<int>(first_point_) + cells.nodes[at]);
    begin = end;
    const std::size_t num_before = mesh_.cells.size();
    add_cell(cells.types[i], nodes, cells.lines.empty() ? 0 : cells.lines[i]);
    sources_.insert(sources_.end(), mesh_.cells.size() - num_before,
                    static_cast<int>(num_cells_of_piece() + i));
  }
  num_cells_ += count;
}

void VtkMesh::add_cell(int type, std::span<const int> nodes, int line) {
  if (add_split_cell(type, nodes, line)) return;
  const auto* known = std::ranges::find(kVtkCellTypes, type, &VtkCellType::type);
  const bool is_known = known != kVtkCellTypes.end();
  const std::size_t corners = is_known ? static_cast<std::size_t>(num_corners(known->kind)) : 0;
  if (!is_known || nodes.size() < corners || (known->is_linear && nodes.size() != corners)) {
    ++num_left_out_[type];
    return;
  }
  const bool has_middles = type == kQuadraticTetrahedron || type == kLagrangeTetrahedron;
  if (has_middles && nodes.size() == 10) {
    add(known->kind, nodes, line);
    return;
  }
  if (nodes.size() > corners) ++num_by_corners_[known->kind];
  add(known->kind, nodes.first(corners), line);
  if (type == kPixel || type == kVoxel) {  // these count their nodes along x, then y, then z
    std::array<int, 10>& order = mesh_.cells.back().nodes;
    std::swap(order[2], order[3]);
    if (type == kVoxel) std::swap(order[6], order[7]);
  }
}

bool VtkMesh::add_split_cell(int type, std::span<const int> nodes, int line) {
  switch (type) {
    case kVtkPolyVertex:
      for (std::size_t i = 0; i < nodes.size(); ++i) add(CellKind::point, nodes.subspan(i, 1), line);
      return true;
    case kVtkPolyLine:
      for (std::size_t i = 0; i + 1 < nodes.size(); ++i) add(CellKind::line, nodes.subspan(i, 2), line);
      return true;
    case kVtkTriangleStrip:
      for (std::size_t i = 0; i + 2 < nodes.size(); ++i) {
        add(CellKind::triangle, nodes.subspan(i, 3), line);
        if (i % 2 == 1) std::swap(mesh_.cells.back().nodes[0], mesh_.cells.back().nodes[1]);
      }
      return true;
    case kVtkPolygon:
      add_polygon(nodes, line, mesh_);
      return true;
    default:
      return false;
  }
}

void VtkMesh::add(CellKind kind, std::span<const int> nodes, int line) {
  MeshCell cell;
  cell.kind = kind;
  cell.num_nodes = static_cast<int>(nodes.size());
  std::ranges::copy(nodes, cell.nodes.begin());
  cell.line = line;
  mesh_.cells.push_back(cell);
}

void VtkMesh::check_rows(const std::string& name, std::size_t num_rows, std::size_t num_items,
                         const char* items, int line) const {
  if (num_rows != num_items)
    cursor_.fail_at(line, fmt::format("array '{}' has {} values for {} {}; export the file again",
                                      printable(name), num_rows, num_items, items));
}

void VtkMesh::add_point_array(MeshArray array, std::size_t num_rows, int line) {
  check_rows(array.name, num_rows, num_points_of_piece(), "points", line);
  ArrayHead head = {array.name, array.num_components, num_rows};
  append(std::move(array), std::move(head), first_point_, point_heads_, mesh_.point_arrays, line);
}

void VtkMesh::add_cell_array(MeshArray array, std::size_t num_rows, int line) {
  check_rows(array.name, num_rows, num_cells_of_piece(), "cells", line);
  MeshArray kept = {array.name, array.num_components, {}};
  const auto width = static_cast<std::size_t>(array.num_components);
  if (sources_.size() > num_rows) num_repeated_ += (sources_.size() - num_rows) * width;
  if (num_repeated_ > kMostRepeated * mesh_.cells.size())
    cursor_.fail_at(line, "array '" + printable(array.name) +
                              "' has too many values to repeat them for each part of a polygon or strip; "
                              "split these into triangles before the export");
  if (keeps_) kept.values.reserve(sources_.size() * width);
  for (const int source : sources_) {
    const auto* begin = array.values.data() + static_cast<std::size_t>(source) * width;
    kept.values.insert(kept.values.end(), begin, begin + width);
  }
  ArrayHead head = {array.name, array.num_components, num_rows};
  append(std::move(kept), std::move(head), first_cell_, cell_heads_, mesh_.cell_arrays, line);
}

void VtkMesh::append(MeshArray array, ArrayHead head, std::size_t num_before, ArrayHeads& heads,
                     std::vector<MeshArray>& arrays, int line) const {
  const auto earlier = std::ranges::find_if(heads, [&](const ArrayHead& other) {
    return num_before > 0 && other.name == head.name && other.num_components == head.num_components &&
           other.num_rows == num_before;
  });
  if (earlier == heads.end() && num_before > 0)
    cursor_.fail_at(line, "array '" + printable(head.name) +
                              "' is not the same in every piece; merge the pieces before the export");
  if (earlier != heads.end()) {
    earlier->num_rows += head.num_rows;
    if (!keeps_) return;
    MeshArray& begun = arrays[static_cast<std::size_t>(earlier - heads.begin())];
    begun.values.insert(begun.values.end(), array.values.begin(), array.values.end());
    return;
  }
  heads.push_back(std::move(head));
  if (keeps_) arrays.push_back(std::move(array));
}

MeshData VtkMesh::finish(int line) {
  for (const ArrayHead& head : point_heads_)
    check_rows(head.name, head.num_rows, num_points_, "points", line);
  for (const ArrayHead& head : cell_heads_) check_rows(head.name, head.num_rows, num_cells_, "cells", line);
  number_from_one(mesh_);
  arrays_to_sets(mesh_);
  add_notes();
  return std::move(mesh_);
}

void VtkMesh::add_notes() {
  for (const auto& [type, count] : num_left_out_)
    mesh_.notes.push_back(fmt::format("leaves out {} cells of VTK's cell type {}", count, type));
  for (const auto& [kind, count] : num_by_corners_)
    mesh_.notes.push_back(
        fmt::format("keeps only the corners of {} higher-order {}", count, plural_name(kind)));
}

int vtk_type(const MeshCell& cell) {
  if (cell.kind == CellKind::tetrahedron && cell.num_nodes == 10) return kQuadraticTetrahedron;
  const auto* known = std::ranges::find_if(kVtkCellTypes, [&](const VtkCellType& type) {
    return type.kind == cell.kind && type.is_linear && type.type != kPixel && type.type != kVoxel;
  });
  return known->type;
}

}  // namespace palpate
