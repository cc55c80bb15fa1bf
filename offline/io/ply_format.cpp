// PLY files of surfaces, text or binary in each byte order:
//
//   ply     format ascii | binary_little_endian | binary_big_endian 1.0
//   element vertex n     property float x ...
//   element face n       property list uchar int vertex_indices ...
//   end_header           the elements in turn, each with its properties
//
// Polygons become triangles. Other elements and properties are passed over.
// Written are the mesh's triangles, or the outer faces of its tetrahedra (surface_cells.hpp), with doubles.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "offline/io/file_number.hpp"
#include "offline/io/file_text.hpp"
#include "offline/io/finished_file.hpp"
#include "offline/io/mesh_formats.hpp"
#include "offline/io/surface_cells.hpp"
#include "offline/mesh/text_number.hpp"

namespace palpate {
namespace {

// An element or a property takes more memory than its line.
constexpr int kMostKeywords = 10'000;

struct PlyProperty {
  std::string name;
  NumberType type = NumberType::float32;
  std::optional<NumberType> count_type;  // of a list
};

struct PlyElement {
  std::string name;
  std::size_t count = 0;
  std::vector<PlyProperty> properties;
};

class PlyReader {
 public:
  PlyReader(Pass pass, FileCursor& cursor) : cursor_(cursor), keeps_(pass == Pass::build) {
    mesh_.file = cursor.file();
  }

  MeshData read() {
    read_head();
    for (const PlyElement& element : elements_) {
      check_size(element);
      if (element.properties.empty()) {
        if (element.name == "vertex") fail_without_coordinates();
        continue;
      }
      for (std::size_t i = 0; i < element.count; ++i) read_item(element, i);
    }
    if (!has_faces_) cursor_.fail_at(0, "has no faces; export a surface");
    number_from_one(mesh_);
    return std::move(mesh_);
  }

 private:
  void read_head() {
    if (trimmed(cursor_.next_line("'ply'")) != "ply")
      cursor_.fail_at(1, "is no PLY file, which starts with a line 'ply'; check its ending");
    for (int num_keywords = 0;; ++num_keywords) {
      const int line = cursor_.line();
      if (num_keywords > kMostKeywords)
        cursor_.fail(fmt::format("the head has more than {} lines; export the file again", kMostKeywords));
      const std::string_view keyword = cursor_.next_word("end_header");
      if (keyword == "end_header") break;
      if (keyword == "format") {
        read_coding();
      } else if (keyword == "element") {
        const std::string name(cursor_.next_word("the name of an element"));
        elements_.push_back({name, cursor_.next_count("the number of elements", 0), {}});
        if (name == "vertex") num_points_ += static_cast<std::int64_t>(elements_.back().count);
      } else if (keyword == "property") {
        if (elements_.empty()) cursor_.fail("a property stands before the elements; export the file again");
        elements_.back().properties.push_back(next_property());
      } else if (keyword != "comment" && keyword != "obj_info") {
        cursor_.fail_at(line, "'" + printable(keyword) + "' is no keyword of a PLY file; export it again");
      }
      cursor_.next_line("end_header");
    }
    if (!coding_) cursor_.fail("the line 'format' is missing; export the file again");
    if (!cursor_.at_end()) cursor_.next_line("the vertices");
  }

  void read_coding() {
    const std::string_view word = cursor_.next_word("a format");
    if (word == "ascii") {
      coding_ = NumberCoding::text;
    } else if (word == "binary_little_endian") {
      coding_ = NumberCoding::little_endian;
    } else if (word == "binary_big_endian") {
      coding_ = NumberCoding::big_endian;
    } else {
      cursor_.fail("the format '" + printable(word) + "' is not known; write ascii or binary_little_endian");
    }
  }

  PlyProperty next_property() {
    PlyProperty property;
    if (cursor_.peek_word() == "list") {
      cursor_.next_word("list");
      property.count_type = next_type(cursor_);
    }
    property.type = next_type(cursor_);
    property.name = cursor_.next_word("the name of a property");
    return property;
  }

  // Refuses a count that the rest of the file is too short for. A list takes its count at least.
  void check_size(const PlyElement& element) const {
    std::size_t least = 0;
    for (const PlyProperty& property : element.properties)
      least += *coding_ == NumberCoding::text ? 2 : num_bytes(property.count_type.value_or(property.type));
    if (least > 0 && element.count > (cursor_.num_left() + 1) / least)
      cursor_.fail(fmt::format("the file is too short for its {} elements '{}'; copy or export it again",
                               element.count, printable(element.name)));
  }

  void read_item(const PlyElement& element, std::size_t index) {
    const bool is_vertex = element.name == "vertex", is_face = element.name == "face";
    if (*coding_ == NumberCoding::text) cursor_.skip_blanks();
    const int line = *coding_ == NumberCoding::text ? cursor_.line() : 0;
    Eigen::Vector3d point = Eigen::Vector3d::Zero();
    int num_coordinates = 0;
    for (const PlyProperty& property : element.properties) {
      if (property.count_type) {
        const bool names_nodes = property.name == "vertex_indices" || property.name == "vertex_index";
        read_list(property, is_face && names_nodes, line);
        continue;
      }
      const bool is_coordinate =
          is_vertex && (property.name == "x" || property.name == "y" || property.name == "z");
      const double number =
          next_number(cursor_, property.type, *coding_, is_coordinate ? "a coordinate" : "a property");
      if (!is_coordinate) continue;
      if (!std::isfinite(number))
        cursor_.fail(fmt::format("vertex {} has a coordinate that is no finite number; correct it", index));
      point[property.name[0] - 'x'] = number;
      ++num_coordinates;
    }
    if (!is_vertex) return;
    if (num_coordinates != 3) fail_without_coordinates();
    if (keeps_) mesh_.positions.push_back(point);
  }

  [[noreturn]] void fail_without_coordinates() const {
    cursor_.fail("vertices have no properties x, y and z; export the file again");
  }

  void read_list(const PlyProperty& property, bool is_face, int line) {
    const int count = next_index(cursor_, *property.count_type, *coding_, "the size of a list");
    if (count < 0) cursor_.fail("the size of a list is negative; export the file again");
    const auto size = static_cast<std::size_t>(count);
    check_room(cursor_, size, property.type, *coding_, is_face ? "a face" : "a list");
    std::vector<int> nodes;
    for (std::size_t i = 0; i < size; ++i) {
      if (is_face) {
        const int node = next_node(property.type);
        if (keeps_) nodes.push_back(node);
      } else {
        next_number(cursor_, property.type, *coding_, "a list");
      }
    }
    if (!is_face) return;
    if (size < 3)
      cursor_.fail("a face needs three vertices; remove it, or correct the counts of the elements");
    has_faces_ = true;
    if (keeps_) add_polygon(nodes, line, mesh_);
  }

  int next_node(NumberType type) {
    const int node = next_index(cursor_, type, *coding_, "a vertex of a face");
    if (node < 0 || node >= num_points_)
      cursor_.fail(fmt::format("a face names vertex {}, where vertices are 0 to {}; export the file again",
                               node, num_points_ - 1));
    return node;
  }

  FileCursor& cursor_;
  const bool keeps_;
  MeshData mesh_;
  std::int64_t num_points_ = 0;
  bool has_faces_ = false;
  std::optional<NumberCoding> coding_;
  std::vector<PlyElement> elements_;
};

}  // namespace

MeshData read_ply(FileCursor& cursor) {
  return read_twice<PlyReader>(cursor);
}

void write_ply(const MeshData& mesh, const WriteOptions& options, const std::filesystem::path& file) {
  const SurfaceTriangles surface = surface_triangles(mesh, file);
  FileText out;
  out.text(
      "ply\nformat {} 1.0\ncomment written by Palpate\nelement vertex {}\nproperty double x\nproperty double "
      "y\n"
      "property double z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
      options.is_binary ? "binary_little_endian" : "ascii", surface.positions.size(),
      surface.triangles.size());
  for (const Eigen::Vector3d& point : surface.positions) {
    if (options.is_binary) {
      for (const double coordinate : point) out.binary(coordinate);
    } else {
      out.text("{} {} {}\n", point[0], point[1], point[2]);
    }
  }
  for (const std::array<int, 3>& triangle : surface.triangles) {
    if (options.is_binary) {
      out.binary('\3');
      for (const int node : triangle) out.binary(std::int32_t{node});
    } else {
      out.text("3 {} {} {}\n", triangle[0], triangle[1], triangle[2]);
    }
  }
  write_finished_text(file, out.bytes);
}

}  // namespace palpate
