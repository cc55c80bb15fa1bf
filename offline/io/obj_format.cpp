#include "offline/io/obj_format.hpp"

#include <fmt/format.h>

#include <iterator>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "offline/io/finished_file.hpp"
#include "offline/io/surface_cells.hpp"
#include "offline/mesh/text_number.hpp"

namespace palpate {
namespace {

// Removes the first word of `text` and returns it; empty at the end.
std::string_view cut_word(std::string_view& text) {
  text = trimmed(text);
  const std::string_view word = text.substr(0, text.find_first_of(" \t\v\f"));
  text.remove_prefix(word.size());
  return word;
}

class ObjReader {
 public:
  explicit ObjReader(FileCursor& cursor) : cursor_(cursor) { mesh_.file = cursor.file(); }

  MeshData read() {
    while (!cursor_.at_end()) {
      line_ = cursor_.line();
      std::string_view text = cursor_.next_line("a line");
      const std::string_view keyword = cut_word(text);
      if (keyword == "v") read_vertex(text);
      if (keyword == "f") read_face(text);
      if (keyword == "g") group_ = cut_word(text);
    }
    if (mesh_.cells.empty()) cursor_.fail_at(0, "has no faces; export a surface, or check the file's ending");
    drop_whole_sets(mesh_);
    number_from_one(mesh_);
    return std::move(mesh_);
  }

 private:
  // Colours and weights may follow.
  void read_vertex(std::string_view text) {
    Eigen::Vector3d point;
    for (double& coordinate : point) {
      const std::string_view word = cut_word(text);
      const std::optional<double> number = parse_number(word);
      if (!number)
        cursor_.fail_at(line_,
                        "'" + printable(word) + "' is no number, where a coordinate should be; correct it");
      coordinate = *number;
    }
    mesh_.positions.push_back(point);
  }

  void read_face(std::string_view text) {
    std::vector<int> nodes;
    for (std::string_view word = cut_word(text); !word.empty(); word = cut_word(text)) {
      const std::optional<int> index = parse_integer(word.substr(0, word.find('/')));
      const auto num_points = static_cast<int>(mesh_.positions.size());
      if (!index || *index == 0 || *index > num_points || *index < -num_points)
        cursor_.fail_at(line_, fmt::format("'{}' is none of the {} vertices above; export the file again",
                                           printable(word), num_points));
      nodes.push_back(*index > 0 ? *index - 1 : num_points + *index);
    }
    if (nodes.size() < 3) cursor_.fail_at(line_, "a face needs three vertices; remove it");
    const std::size_t first = mesh_.cells.size();
    add_polygon(nodes, line_, mesh_);
    for (std::size_t cell = first; cell < mesh_.cells.size() && !group_.empty(); ++cell)
      mesh_.element_sets[group_].push_back(static_cast<int>(cell));
  }

  FileCursor& cursor_;
  MeshData mesh_;
  std::string group_;  // of the next face; the first where a line names several
  int line_ = 0;
};

}  // namespace

MeshData read_obj(FileCursor& cursor) {
  return ObjReader(cursor).read();
}

MeshData read_obj(const std::filesystem::path& file) {
  FileCursor cursor(file);
  return read_obj(cursor);
}

void write_obj(const MeshData& mesh, const WriteOptions& /*options*/, const std::filesystem::path& file) {
  const SurfaceTriangles surface = surface_triangles(mesh, file);
  std::string text = "# written by Palpate\n";
  for (const Eigen::Vector3d& point : surface.positions)
    fmt::format_to(std::back_inserter(text), "v {} {} {}\n", point[0], point[1], point[2]);
  for (const auto& [a, b, c] : surface.triangles)
    fmt::format_to(std::back_inserter(text), "f {} {} {}\n", a + 1, b + 1, c + 1);
  write_finished_text(file, text);
}

}  // namespace palpate
