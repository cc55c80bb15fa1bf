// TetGen's files: NAME.node with the points and NAME.ele with tetrahedra of 4 or 10 nodes.
//
// Boundary markers of points become node sets MARKER_n. The last attribute of tetrahedra, the region, becomes
// element sets REGION_n where all its values are integers. Other attributes become arrays.
//
// Source: H. Si, TetGen 1.5 user's manual, 2013, section 5.2.
//
// The writer's comments tell the names of sets and arrays. Points, lines, triangles and quadrilaterals have
// no place and are left out. It refuses other volumes than tetrahedra, and tetrahedra of 4 and of 10 nodes.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <climits>
#include <cmath>
#include <stdexcept>

#include "offline/io/file_text.hpp"
#include "offline/io/finished_file.hpp"
#include "offline/io/label_index.hpp"
#include "offline/io/mesh_formats.hpp"
#include "offline/io/middle_order.hpp"
#include "offline/io/reference_sets.hpp"
#include "offline/mesh/text_number.hpp"

namespace palpate {
namespace {

// Attributes have no names in the files, so the writer tells them in a comment.
constexpr std::string_view kArray = "# array of ";

// TetGen 1.5 writes the middles of the edges 23 03 01 12 13 02.
constexpr std::array<std::size_t, 10> kOrder = {0, 1, 2, 3, 9, 7, 4, 5, 8, 6};

constexpr int kMostAttributes = 1000;  // of a point or a tetrahedron

// Attributes of points or tetrahedra, row by row.
struct Attributes {
  std::size_t num_columns = 0;
  std::vector<double> values;
  std::vector<MeshArray> named;  // from comments: names and numbers of components
};

// Reads "# array of 3: VELOCITY".
void read_array_comment(std::string_view comment, Attributes& attributes) {
  if (!comment.starts_with(kArray)) return;
  comment.remove_prefix(kArray.size());
  const std::size_t colon = comment.find(": ");
  if (colon == std::string_view::npos) return;
  const auto size = parse_integer(comment.substr(0, colon));
  if (size && *size > 0)
    attributes.named.push_back({std::string(trimmed(comment.substr(colon + 2))), *size, {}});
}

// Cuts columns from `first` on out of the rows.
MeshArray cut_array(const Attributes& attributes, std::string name, std::size_t first, int num_components) {
  MeshArray array = {std::move(name), num_components, {}};
  const auto size = static_cast<std::size_t>(num_components);
  for (std::size_t row = first; row < attributes.values.size(); row += attributes.num_columns) {
    for (std::size_t k = 0; k < size; ++k) array.values.push_back(attributes.values[row + k]);
  }
  return array;
}

// Makes arrays of the first `num_columns` attributes.
std::vector<MeshArray> make_arrays(const Attributes& attributes, std::size_t num_columns) {
  std::vector<MeshArray> arrays;
  std::size_t column = 0;
  for (const MeshArray& named : attributes.named) {
    const auto size = static_cast<std::size_t>(named.num_components);
    if (size > num_columns - column) break;
    arrays.push_back(cut_array(attributes, named.name, column, named.num_components));
    column += size;
  }
  for (; column < num_columns; ++column)
    arrays.push_back(cut_array(attributes, "attribute_" + std::to_string(column + 1), column, 1));
  return arrays;
}

class TetgenReader {
 public:
  TetgenReader(Pass pass, FileCursor& nodes, FileCursor& elements)
      : nodes_(nodes), elements_(elements), keeps_(pass == Pass::build) {}

  MeshData read() {
    mesh_.file = elements_.file();
    watch_comments(nodes_, of_nodes_);
    read_nodes();
    nodes_.set_comment(0);
    watch_comments(elements_, of_cells_);
    read_elements();
    elements_.set_comment(0);
    if (!keeps_) return {};
    mesh_.point_arrays = make_arrays(of_nodes_, of_nodes_.num_columns);
    make_regions();
    sort_middles(mesh_);
    sets_.fill(mesh_);
    return std::move(mesh_);
  }

 private:
  void watch_comments(FileCursor& in, Attributes& attributes) {
    in.set_comment('#', [&](std::string_view comment) {
      if (!keeps_) return;
      sets_.read_comment(comment);
      read_array_comment(comment, attributes);
    });
  }

  // Reads the attributes of a point or a tetrahedron.
  void read_attributes(FileCursor& in, Attributes& attributes) const {
    for (std::size_t k = 0; k < attributes.num_columns; ++k) {
      const double value = in.next_number("an attribute");
      if (keeps_) attributes.values.push_back(value);
    }
  }

  // Reads the first line: a count of items that is checked, then numbers that may be absent.
  std::vector<int> read_header(FileCursor& in, const char* what, const std::vector<int>& defaults) {
    std::vector<int> numbers = {in.next_integer(what)};
    for (const int number : defaults)
      numbers.push_back(in.has_word_in_line() ? in.next_integer(what) : number);
    if (*std::min_element(numbers.begin(), numbers.end()) < 0)
      in.fail(std::string(what) + " or a number behind it is negative; export the file again");
    in.check_count(numbers[0], what, 8);
    if (numbers.size() > 2 && numbers[2] > kMostAttributes)
      in.fail(fmt::format("there are {} attributes; use at most {}", numbers[2], kMostAttributes));
    if (in.has_word_in_line())
      in.fail(
          fmt::format("'{}' stands behind the first line's numbers; remove it", printable(in.peek_word())));
    return numbers;
  }

  void read_nodes() {
    const std::vector<int> header = read_header(nodes_, "the number of points", {3, 0, 0});
    if (header[1] != 3)
      nodes_.fail(fmt::format("points have dimension {}, not 3; export a mesh in space", header[1]));
    of_nodes_.num_columns = static_cast<std::size_t>(header[2]);
    for (int i = 0; i < header[0]; ++i) {
      const int label = nodes_.next_integer("the number of a point");
      Eigen::Vector3d position;
      for (int axis = 0; axis < 3; ++axis) position[axis] = nodes_.next_number("a coordinate");
      read_attributes(nodes_, of_nodes_);
      const int marker = header[3] > 0 ? nodes_.next_integer("a boundary marker") : 0;
      index_.add(label, i);
      if (!keeps_) continue;
      sets_.add_node(marker, i);
      mesh_.positions.push_back(position);
      mesh_.node_labels.push_back(label);
    }
    if (const auto twice = index_.sort())
      nodes_.fail(fmt::format("point {} stands twice in the file; renumber the points", *twice));
    expect_end(nodes_);
  }

  void read_elements() {
    const std::vector<int> header = read_header(elements_, "the number of tetrahedra", {4, 0});
    const int num_nodes = header[1];
    if (num_nodes != 4 && num_nodes != 10)
      elements_.fail(fmt::format("tetrahedra have {} nodes, not 4 or 10; export them so", num_nodes));
    of_cells_.num_columns = static_cast<std::size_t>(header[2]);
    LabelIndex labels;
    for (int i = 0; i < header[0]; ++i) {
      MeshCell cell = {.label = elements_.next_integer("the number of a tetrahedron"),
                       .num_nodes = num_nodes};
      cell.line = elements_.line();
      for (int k = 0; k < num_nodes; ++k) {
        const int label = elements_.next_integer("a node of a tetrahedron");
        const auto found = index_.find(label);
        if (!found)
          elements_.fail(
              fmt::format("tetrahedron {} names point {}, which {} does not hold; name the files of one mesh",
                          cell.label, label, nodes_.file()));
        cell.nodes[static_cast<std::size_t>(k)] = *found;
      }
      read_attributes(elements_, of_cells_);
      labels.add(cell.label, i);
      if (keeps_) mesh_.cells.push_back(cell);
    }
    if (const auto twice = labels.sort())
      elements_.fail(fmt::format("tetrahedron {} stands twice in the file; renumber the tetrahedra", *twice));
    expect_end(elements_);
  }

  // The counts are wrong where more numbers follow.
  void expect_end(FileCursor& in) const {
    if (in.skip_blanks())
      in.fail(fmt::format(
          "'{}' stands behind the last item; correct the count in the first line, or export the file again",
          printable(in.peek_word())));
  }

  // Makes sets of the last attribute, if it is a region, and arrays of the others.
  void make_regions() {
    std::size_t num_arrays = of_cells_.num_columns;
    if (num_arrays > 0) {
      const std::vector<double> regions = cut_array(of_cells_, "", num_arrays - 1, 1).values;
      const bool are_integers = std::ranges::all_of(
          regions, [](double region) { return std::abs(region) <= INT_MAX && std::floor(region) == region; });
      if (are_integers) {
        --num_arrays;
        for (std::size_t i = 0; i < regions.size(); ++i)
          sets_.add_cell(static_cast<int>(regions[i]), static_cast<int>(i));
      }
    }
    mesh_.cell_arrays = make_arrays(of_cells_, num_arrays);
  }

  FileCursor& nodes_;
  FileCursor& elements_;
  const bool keeps_;
  MeshData mesh_;
  LabelIndex index_;
  Attributes of_nodes_;
  Attributes of_cells_;
  ReferenceSets sets_{"MARKER_", "REGION_"};
};

class TetgenWriter {
 public:
  TetgenWriter(const MeshData& mesh, const std::filesystem::path& file) : mesh_(mesh), file_(file) {
    for (std::size_t i = 0; i < mesh.cells.size(); ++i) {
      const MeshCell& cell = mesh.cells[i];
      if (cell.kind == CellKind::tetrahedron) {
        tetrahedra_.push_back(i);
        if (cell.num_nodes != mesh.cells[tetrahedra_[0]].num_nodes) refuse("tetrahedra of 4 and of 10 nodes");
      } else if (num_corners(cell.kind) > 4) {
        refuse(plural_name(cell.kind));
      }
    }
  }

  std::string nodes() {
    const WrittenReferences markers =
        number_references(mesh_.node_sets, mesh_.positions.size(), "nodes", "MARKER_");
    const bool has_markers = !mesh_.node_sets.empty();
    FileText out;
    out.text("{}{}", markers.comments, array_comments(mesh_.point_arrays));
    out.text("{} 3 {} {}\n", mesh_.positions.size(), num_columns(mesh_.point_arrays), has_markers ? 1 : 0);
    for (std::size_t i = 0; i < mesh_.positions.size(); ++i) {
      const Eigen::Vector3d& place = mesh_.positions[i];
      out.text("{} {} {} {}", i + 1, place.x(), place.y(), place.z());
      add_values(mesh_.point_arrays, i, out);
      if (has_markers) out.text(" {}", markers.of_item[i]);
      out.text("\n");
    }
    return std::move(out.bytes);
  }

  std::string elements() {
    const WrittenReferences regions =
        number_references(mesh_.element_sets, mesh_.cells.size(), "cells", "REGION_");
    // The reader takes the last attribute as a region, so arrays need a region behind them.
    const bool has_regions = !mesh_.element_sets.empty() || !mesh_.cell_arrays.empty();
    FileText out;
    out.text("{}{}", regions.comments, array_comments(mesh_.cell_arrays));
    out.text("{} {} {}\n", tetrahedra_.size(),
             tetrahedra_.empty() ? 4 : mesh_.cells[tetrahedra_[0]].num_nodes,
             num_columns(mesh_.cell_arrays) + (has_regions ? 1 : 0));
    for (std::size_t row = 0; row < tetrahedra_.size(); ++row) {
      const std::size_t i = tetrahedra_[row];
      const MeshCell& cell = mesh_.cells[i];
      out.text("{}", row + 1);
      for (int k = 0; k < cell.num_nodes; ++k)
        out.text(" {}", cell.nodes[kOrder[static_cast<std::size_t>(k)]] + 1);
      add_values(mesh_.cell_arrays, i, out);
      if (has_regions) out.text(" {}", regions.of_item[i]);
      out.text("\n");
    }
    return std::move(out.bytes);
  }

 private:
  [[noreturn]] void refuse(const std::string& cells) const {
    throw std::runtime_error(file_.string() + ": TetGen's files cannot hold " + cells +
                             "; write another format, such as .msh or .vtu");
  }

  static std::string array_comments(const std::vector<MeshArray>& arrays) {
    FileText out;
    for (const MeshArray& array : arrays) out.text("{}{}: {}\n", kArray, array.num_components, array.name);
    return std::move(out.bytes);
  }

  static int num_columns(const std::vector<MeshArray>& arrays) {
    int count = 0;
    for (const MeshArray& array : arrays) count += array.num_components;
    return count;
  }

  static void add_values(const std::vector<MeshArray>& arrays, std::size_t item, FileText& out) {
    for (const MeshArray& array : arrays) {
      const auto size = static_cast<std::size_t>(array.num_components);
      for (std::size_t k = 0; k < size; ++k) out.text(" {}", array.values[item * size + k]);
    }
  }

  const MeshData& mesh_;
  const std::filesystem::path file_;
  std::vector<std::size_t> tetrahedra_;  // indices of cells
};

}  // namespace

MeshData read_tetgen(FileCursor& nodes, FileCursor& elements) {
  return read_twice<TetgenReader>(nodes, elements);
}

void write_tetgen(const MeshData& mesh, const WriteOptions&, const std::filesystem::path& file) {
  TetgenWriter writer(mesh, file);
  write_finished_text(std::filesystem::path(file).replace_extension(".node"), writer.nodes());
  write_finished_text(std::filesystem::path(file).replace_extension(".ele"), writer.elements());
}

}  // namespace palpate
