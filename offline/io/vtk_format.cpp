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
//
// Written is version 4.2, which older programs read too. Sets become arrays (set_arrays.hpp).
#include <fmt/format.h>

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "offline/io/file_number.hpp"
#include "offline/io/mesh_formats.hpp"
#include "offline/io/vtk_attributes.hpp"
#include "offline/io/vtk_mesh.hpp"
#include "offline/mesh/text_number.hpp"

namespace palpate {
namespace {

// Sections of cells of polygonal data, in the order in which their cells have values.
struct PolygonSection {
  std::string_view keyword;
  int type;
};

constexpr auto kPolygonSections = std::to_array<PolygonSection>({
    {"VERTICES", kVtkPolyVertex},
    {"LINES", kVtkPolyLine},
    {"POLYGONS", kVtkPolygon},
    {"TRIANGLE_STRIPS", kVtkTriangleStrip},
});

class LegacyVtkReader {
 public:
  LegacyVtkReader(Pass pass, FileCursor& cursor)
      : cursor_(cursor), keeps_(pass == Pass::build), attributes_(pass, cursor), mesh_(pass, cursor) {}

  MeshData read() {
    read_head();
    while (cursor_.skip_blanks()) read_section();
    finish_cells();
    return mesh_.finish(cursor_.line());
  }

 private:
  void read_head() {
    constexpr std::string_view kStart = "# vtk DataFile Version";
    const std::string_view first = cursor_.next_line("'# vtk DataFile Version'");
    if (!first.starts_with(kStart))
      cursor_.fail_at(1,
                      "is no legacy VTK file, which starts with '# vtk DataFile Version'; check its ending");
    const std::optional<double> version = parse_number(trimmed(first.substr(kStart.size())));
    if (!version || *version >= 6)
      cursor_.fail_at(1, "version '" + printable(trimmed(first.substr(kStart.size()))) +
                             "' of VTK's format is not known; write version 5.1 or older");
    has_offsets_ = *version >= 5;
    cursor_.next_line("the title");
    const std::string coding = upper_case(cursor_.next_word("ASCII or BINARY"));
    if (coding != "ASCII" && coding != "BINARY")
      cursor_.fail("'" + printable(coding) +
                   "' stands where ASCII or BINARY should be; export the file again");
    coding_ = coding == "ASCII" ? NumberCoding::text : NumberCoding::big_endian;
    attributes_.set_coding(coding_);
  }

  void read_section() {
    const int line = cursor_.line();
    const std::string keyword = upper_case(cursor_.next_word("a keyword"));
    if (keyword == "DATASET") return read_dataset();
    if (!has_dataset_) cursor_.fail_at(line, "the line DATASET is missing; export the file again");
    if (keyword == "METADATA") return attributes_.skip_metadata();
    if (keyword == "POINTS") return read_points(line);
    if (keyword == "CELLS") return read_cells(line, cells_);
    if (keyword == "CELL_TYPES") return read_types(line);
    if (keyword == "POINT_DATA" || keyword == "CELL_DATA") return start_arrays(keyword == "POINT_DATA", line);
    for (std::size_t i = 0; i < kPolygonSections.size(); ++i) {
      if (keyword == kPolygonSections[i].keyword) return read_cells(line, polygons_[i]);
    }
    const auto take = [&](MeshArray array, std::size_t num_rows) {
      if (of_points_) mesh_.add_point_array(std::move(array), num_rows, line);
      if (of_cells_) mesh_.add_cell_array(std::move(array), num_rows, line);
    };
    if (!attributes_.read(keyword, num_values_, take))
      cursor_.fail_at(line, "'" + printable(keyword) +
                                "' is no keyword of a VTK file; correct the count of the section before, or "
                                "export it again");
  }

  void read_dataset() {
    const std::string kind = upper_case(cursor_.next_word("the kind of data"));
    if (kind != "UNSTRUCTURED_GRID" && kind != "POLYDATA")
      cursor_.fail(
          "data of kind " + printable(kind) +
          " are no mesh; convert them to UNSTRUCTURED_GRID, such as by ParaView's filter Tetrahedralize");
    has_dataset_ = true;
    is_grid_ = kind == "UNSTRUCTURED_GRID";
  }

  void read_points(int line) {
    if (std::exchange(has_points_, true)) cursor_.fail_at(line, "POINTS stands twice; export the file again");
    const std::size_t count = cursor_.next_count("the number of points", 3);
    const NumberType type = next_type(cursor_);
    attributes_.end_header();
    check_room(cursor_, 3 * count, type, coding_, "the points");
    mesh_.add_coordinates(cursor_, 3 * count, type, coding_);
  }

  void read_cells(int line, VtkCells& cells) {
    if (!cells.ends.empty()) cursor_.fail_at(line, "a section of cells stands twice; export the file again");
    if (!has_points_) cursor_.fail_at(line, "the cells stand before POINTS; export the file again");
    const std::size_t count = cursor_.next_count("the number of cells", 1);
    const std::size_t size = cursor_.next_count("the size of the cells", 1);
    attributes_.end_header();
    if (!has_offsets_) {
      read_counted_cells(count, size, cells);
    } else if (count > 0) {
      read_offset_cells(count, size, cells);
    }
  }

  // 4 0 1 2 3     a number of nodes before the nodes of each cell
  void read_counted_cells(std::size_t count, std::size_t size, VtkCells& cells) {
    check_room(cursor_, size, NumberType::int32, coding_, "the cells");
    if (count > size) cursor_.fail("CELLS has more cells than numbers; export the file again");
    std::size_t left = size;
    for (std::size_t i = 0; i < count; ++i) {
      add_line(cells);
      const int num_nodes = next_index(cursor_, NumberType::int32, coding_, "the number of nodes of a cell");
      if (left == 0 || num_nodes < 0 || static_cast<std::size_t>(num_nodes) > left - 1)
        cursor_.fail(fmt::format(
            "cell {} with {} nodes passes the end of its section; export the file again{}", i, num_nodes,
            coding_ == NumberCoding::text ? "" : ", with the most significant byte first"));
      left -= static_cast<std::size_t>(num_nodes) + 1;
      for (int node = 0; node < num_nodes; ++node) add_node(NumberType::int32, i, cells);
      cells.ends.push_back(static_cast<int>(size - left - i - 1));
    }
    if (left > 0)
      cursor_.fail(fmt::format("the section of cells has {} numbers too many; export the file again", left));
  }

  // OFFSETS type, then 0 and the ends of the cells; CONNECTIVITY type, then the nodes of all cells
  void read_offset_cells(std::size_t num_offsets, std::size_t size, VtkCells& cells) {
    const NumberType offset_type = next_part("OFFSETS");
    check_room(cursor_, num_offsets, offset_type, coding_, "the offsets");
    int end = 0;
    bool ascends = true;
    for (std::size_t i = 0; i < num_offsets; ++i) {
      const int next = next_index(cursor_, offset_type, coding_, "an offset");
      ascends = ascends && next >= end && (i > 0 || next == 0);
      end = next;
      if (i > 0) cells.ends.push_back(end);
    }
    if (!ascends || static_cast<std::size_t>(end) != size)
      cursor_.fail(fmt::format("OFFSETS do not ascend from 0 to {}; export the file again", size));
    const NumberType type = next_part("CONNECTIVITY");
    check_room(cursor_, size, type, coding_, "the cells");
    std::size_t node = 0;
    for (std::size_t cell = 0; cell < cells.ends.size(); ++cell) {
      add_line(cells);
      for (; node < static_cast<std::size_t>(cells.ends[cell]); ++node) add_node(type, cell, cells);
    }
  }

  void add_node(NumberType type, std::size_t cell, VtkCells& cells) {
    const int node = next_index(cursor_, type, coding_, "a node of a cell");
    mesh_.check_node(cursor_, node, cell);
    if (keeps_) cells.nodes.push_back(node);
  }

  NumberType next_part(const char* keyword) {
    const std::string word = upper_case(cursor_.next_word(keyword));
    if (word != keyword)
      cursor_.fail(
          fmt::format("'{}' stands where {} should be; export the file again", printable(word), keyword));
    const NumberType type = next_type(cursor_);
    attributes_.end_header();
    return type;
  }

  // Notes the line of the cell that comes next.
  void add_line(VtkCells& cells) {
    if (coding_ != NumberCoding::text || !keeps_) return;
    cursor_.skip_blanks();
    cells.lines.push_back(cursor_.line());
  }

  void read_types(int line) {
    const std::size_t count = cursor_.next_count("the number of cell types", 1);
    attributes_.end_header();
    if (count != cells_.ends.size())
      cursor_.fail_at(line, fmt::format("there are {} cell types for {} cells; export the file again", count,
                                        cells_.ends.size()));
    for (std::size_t i = 0; i < count; ++i) {
      const int type = next_index(cursor_, NumberType::int32, coding_, "a cell type");
      if (keeps_) cells_.types.push_back(type);
    }
    has_types_ = true;
  }

  // Arrays of cells need the cells.
  void finish_cells() {
    if (std::exchange(has_cells_, true)) return;
    if (!has_dataset_) cursor_.fail("the line DATASET is missing; export the file again");
    if (!has_types_ && !cells_.ends.empty())
      cursor_.fail("the section CELL_TYPES is missing; export the file again");
    for (std::size_t i = 0; i < kPolygonSections.size() && !is_grid_; ++i) {
      VtkCells& section = polygons_[i];
      if (keeps_) section.types.assign(section.ends.size(), kPolygonSections[i].type);
      mesh_.add_cells(section, section.ends.size());
    }
    mesh_.add_cells(cells_, cells_.ends.size());
  }

  void start_arrays(bool of_points, int line) {
    finish_cells();
    const std::size_t count = cursor_.next_count("the number of values", 0);
    of_points_ = of_points;
    of_cells_ = !of_points;
    num_values_ = of_points ? mesh_.num_points_of_piece() : mesh_.num_cells_of_piece();
    if (count != num_values_)
      cursor_.fail_at(
          line, fmt::format("there are values for {} {}, where the mesh has {}; export the file again", count,
                            of_points ? "points" : "cells", num_values_));
  }

  FileCursor& cursor_;
  const bool keeps_;
  VtkAttributes attributes_;
  VtkMesh mesh_;
  NumberCoding coding_ = NumberCoding::text;
  bool has_offsets_ = false;  // version 5
  bool has_dataset_ = false, is_grid_ = false;
  bool has_points_ = false, has_cells_ = false, has_types_ = false;
  bool of_points_ = false, of_cells_ = false;  // the arrays that follow
  std::size_t num_values_ = 0;                 // of each such array
  VtkCells cells_;
  std::array<VtkCells, kPolygonSections.size()> polygons_;
};

}  // namespace

MeshData read_vtk(FileCursor& cursor) {
  return read_twice<LegacyVtkReader>(cursor);
}

}  // namespace palpate
