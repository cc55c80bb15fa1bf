// OBJ files: "v x y z" and "f a b c ..." with indices from 1, or from the end if negative. "a/b/c" names
// texture and normal behind the vertex. Polygons become triangles. Groups, "g NAME ...", become element sets.
// Other lines are passed over.
// Written are the mesh's triangles, or the outer faces of its tetrahedra (surface_cells.hpp).
#include <fmt/format.h>

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "offline/io/file_text.hpp"
#include "offline/io/finished_file.hpp"
#include "offline/io/mesh_formats.hpp"
#include "offline/io/surface_cells.hpp"
#include "offline/mesh/text_number.hpp"

namespace palpate {
namespace {

class ObjReader {
 public:
  ObjReader(Pass pass, FileCursor& cursor) : cursor_(cursor), keeps_(pass == Pass::build) {
    mesh_.file = cursor.file();
  }

  MeshData read() {
    while (cursor_.skip_blanks()) {
      const std::string_view keyword = cursor_.next_word("a keyword");
      if (keyword == "v") read_vertex();
      if (keyword == "f") read_face();
      if (keyword == "g") group_ = cursor_.has_word_in_line() ? cursor_.next_word("a group") : "";
      if (!cursor_.at_end()) cursor_.next_line("the rest of a line");
    }
    if (!has_faces_) cursor_.fail_at(0, "has no faces; export a surface, or check the file's ending");
    drop_whole_sets(mesh_);
    number_from_one(mesh_);
    return std::move(mesh_);
  }

 private:
  // Colours and weights may follow.
  void read_vertex() {
    Eigen::Vector3d point;
    for (double& coordinate : point) {
      if (!cursor_.has_word_in_line()) cursor_.fail("the line ends where a coordinate should be; add it");
      coordinate = cursor_.next_number("a coordinate");
    }
    ++num_points_;
    if (keeps_) mesh_.positions.push_back(point);
  }

  void read_face() {
    std::vector<int> nodes;
    int num_nodes = 0;
    for (; cursor_.has_word_in_line(); ++num_nodes) {
      const std::string_view word = cursor_.next_word("a vertex");
      const std::optional<int> index = parse_integer(word.substr(0, word.find('/')));
      if (!index || *index == 0 || *index > num_points_ || *index < -num_points_)
        cursor_.fail(
            fmt::format("'{}' is none of the {} vertices above, which count from 1; export the file again",
                        printable(word), num_points_));
      if (keeps_) nodes.push_back(*index > 0 ? *index - 1 : num_points_ + *index);
    }
    if (num_nodes < 3) cursor_.fail("a face needs three vertices; remove it");
    has_faces_ = true;
    if (!keeps_) return;
    const std::size_t first = mesh_.cells.size();
    add_polygon(nodes, cursor_.line(), mesh_);
    for (std::size_t cell = first; cell < mesh_.cells.size() && !group_.empty(); ++cell)
      mesh_.element_sets[group_].push_back(static_cast<int>(cell));
  }

  FileCursor& cursor_;
  const bool keeps_;
  MeshData mesh_;
  int num_points_ = 0;
  bool has_faces_ = false;
  std::string group_;  // of the next face; the first where a line names several
};

}  // namespace

MeshData read_obj(FileCursor& cursor) {
  return read_twice<ObjReader>(cursor);
}

void write_obj(const MeshData& mesh, const WriteOptions& /*options*/, const std::filesystem::path& file) {
  const SurfaceTriangles surface = surface_triangles(mesh, file);
  FileText out;
  out.text("# written by Palpate\n");
  for (const Eigen::Vector3d& point : surface.positions)
    out.text("v {} {} {}\n", point[0], point[1], point[2]);
  for (const auto& [a, b, c] : surface.triangles) out.text("f {} {} {}\n", a + 1, b + 1, c + 1);
  write_finished_text(file, out.bytes);
}

}  // namespace palpate
