// Medit's text mesh files, .mesh, as Mmg, Gmsh and libMeshb write them.
//
// References become sets REF_n: of vertices node sets, of cells element sets. Edges, triangles and
// quadrilaterals also give their nodes to the node set of their reference. Quadratic tetrahedra keep their
// middles, other quadratic cells their corners. Sections without cells, such as Normals, are skipped.
//
// Source: L. Marechal, libMeshb 7, "Handling meshes and solutions files", and P. Frey, "Medit", INRIA
// RT-0253, 2001.
//
// The writer's comments tell the names of sets. The format has no labels and no arrays, and groups cells by
// kind.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>

#include "offline/io/file_text.hpp"
#include "offline/io/finished_file.hpp"
#include "offline/io/mesh_formats.hpp"
#include "offline/io/middle_order.hpp"
#include "offline/io/reference_sets.hpp"
#include "offline/mesh/text_number.hpp"

namespace palpate {
namespace {

using enum CellKind;

// A section of cells.
struct Section {
  const char* keyword;
  CellKind kind;
  int num_nodes;  // in the file
};

constexpr std::array<Section, 15> kSections = {{
    {"Edges", line, 2},
    {"Triangles", triangle, 3},
    {"Quadrilaterals", quadrilateral, 4},
    {"Tetrahedra", tetrahedron, 4},
    {"Pyramids", pyramid, 5},
    {"Prisms", wedge, 6},
    {"Pentahedra", wedge, 6},
    {"Hexahedra", hexahedron, 8},
    {"Hexaedra", hexahedron, 8},
    {"EdgesP2", line, 3},
    {"TrianglesP2", triangle, 6},
    {"QuadrilateralsQ2", quadrilateral, 9},
    {"TetrahedraP2", tetrahedron, 10},
    {"PrismsP2", wedge, 18},
    {"HexahedraQ2", hexahedron, 27},
}};

constexpr const char* kFirstWord = "MeshVersionFormatted";

bool begins_with_letter(std::string_view word) {
  return !word.empty() && std::isalpha(static_cast<unsigned char>(word.front())) != 0;
}

class MeditReader {
 public:
  MeditReader(Pass pass, FileCursor& in) : in_(in), keeps_(pass == Pass::build) {
    in_.set_comment('#', [this](std::string_view comment) {
      if (keeps_) sets_.read_comment(comment);
    });
  }
  MeditReader(const MeditReader&) = delete;
  MeditReader& operator=(const MeditReader&) = delete;
  ~MeditReader() { in_.set_comment(0); }

  MeshData read() {
    mesh_.file = in_.file();
    read_header();
    while (in_.skip_blanks()) {
      const int line = in_.line();
      const std::string keyword(in_.next_word("a keyword"));
      if (keyword == "End") break;
      read_section(keyword, line);
    }
    if (num_points_ == 0) in_.fail("has no Vertices; export the file again");
    number_from_one(mesh_);
    sort_middles(mesh_);
    sets_.fill(mesh_);
    return std::move(mesh_);
  }

 private:
  void read_header() {
    const std::string word(in_.next_word(kFirstWord));
    if (word != kFirstWord)
      in_.fail(
          fmt::format("begins with '{}', not with {}; name a text file of Medit, or export the mesh as one",
                      printable(word), kFirstWord));
    in_.next_integer("the version");
  }

  void read_section(const std::string& keyword, int line) {
    const auto section = std::find_if(kSections.begin(), kSections.end(),
                                      [&](const Section& other) { return keyword == other.keyword; });
    if (section != kSections.end()) {
      read_cells(*section);
    } else if (keyword == "Dimension") {
      if (const int dimension = in_.next_integer("the dimension"); dimension != 3)
        in_.fail(fmt::format("the mesh has dimension {}, not 3; export a mesh in space", dimension));
    } else if (keyword == "Vertices") {
      read_vertices();
    } else if (keyword.starts_with("Tetrahedra") || keyword.starts_with("Hexahedra") ||
               keyword.starts_with("Prisms") || keyword.starts_with("Pyramids")) {
      in_.fail_at(line,
                  printable(keyword) + " are not supported; export the mesh with cells of order 1 or 2");
    } else {
      skip_section(keyword, line);
    }
  }

  void read_vertices() {
    if (num_points_ > 0) in_.fail("second Vertices begin; keep one mesh in the file");
    const std::size_t count = in_.next_count("the number of vertices", 8);
    for (; num_points_ < static_cast<int>(count); ++num_points_) {
      Eigen::Vector3d position;
      for (double& coordinate : position) coordinate = in_.next_number("a coordinate");
      const int reference = in_.next_integer("the reference of a vertex");
      if (!keeps_) continue;
      sets_.add_node(reference, num_points_);
      mesh_.positions.push_back(position);
    }
  }

  void read_cells(const Section& section) {
    const auto num_nodes = static_cast<std::size_t>(section.num_nodes);
    const std::size_t count = in_.next_count("the number of cells", 2 * (num_nodes + 1));
    const bool is_volume = num_corners(section.kind) > 4 || section.kind == tetrahedron;
    const int num_kept = section.kind == tetrahedron ? section.num_nodes : num_corners(section.kind);
    std::vector<int> nodes(num_nodes);
    for (std::size_t i = 0; i < count; ++i) {
      MeshCell cell = {.kind = section.kind, .num_nodes = num_kept};
      for (int& node : nodes) node = next_node();
      cell.line = in_.line();
      std::copy_n(nodes.begin(), num_kept, cell.nodes.begin());
      const int reference = in_.next_integer("the reference of a cell");
      if (!keeps_) continue;
      const int index = static_cast<int>(mesh_.cells.size());
      mesh_.cells.push_back(cell);
      if (is_volume) {
        sets_.add_cell(reference, index);
      } else {
        sets_.add_face(reference, index, nodes);
      }
    }
    if (is_volume && num_kept < section.num_nodes && count > 0)
      mesh_.notes.push_back(std::to_string(count) + " " + section.keyword + " are kept by their corners");
  }

  int next_node() {
    const int number = in_.next_integer("a vertex of a cell");
    if (number < 1 || number > num_points_)
      in_.fail(
          fmt::format("a cell names vertex {}, but the vertices before it are 1 to {}; correct it, or "
                      "export the file again",
                      number, num_points_));
    return number - 1;
  }

  void skip_section(const std::string& keyword, int line) {
    if (!begins_with_letter(keyword))
      in_.fail_at(line, fmt::format("'{}' stands where a keyword should be; the count of the section before "
                                    "is wrong, so export the file again",
                                    printable(keyword)));
    while (in_.skip_blanks() && !begins_with_letter(in_.peek_word())) in_.next_word("a number");
  }

  FileCursor& in_;
  const bool keeps_;
  MeshData mesh_;
  int num_points_ = 0;
  ReferenceSets sets_{"REF_", "REF_"};
};

class MeditWriter {
 public:
  explicit MeditWriter(const MeshData& mesh)
      : mesh_(mesh),
        nodes_(number_references(mesh.node_sets, mesh.positions.size(), "nodes", "REF_")),
        cells_(number_references(mesh.element_sets, mesh.cells.size(), "cells", "REF_")) {}

  std::string write() {
    out_.text("MeshVersionFormatted 2\nDimension 3\n{}{}", nodes_.comments, cells_.comments);
    out_.text("Vertices\n{}\n", mesh_.positions.size());
    for (std::size_t i = 0; i < mesh_.positions.size(); ++i) {
      const Eigen::Vector3d& place = mesh_.positions[i];
      out_.text("{} {} {} {}\n", place.x(), place.y(), place.z(), nodes_.of_item[i]);
    }
    for (const Section& section : kSections) write_cells(section);
    out_.text("End\n");
    return std::move(out_.bytes);
  }

 private:
  void write_cells(const Section& section) {
    const auto is_here = [&](const MeshCell& cell) {
      return cell.kind == section.kind && cell.num_nodes == section.num_nodes;
    };
    const auto count = std::count_if(mesh_.cells.begin(), mesh_.cells.end(), is_here);
    // Two keywords name the same cells in files of different programs.
    const std::string_view keyword = section.keyword;
    if (count == 0 || keyword == "Pentahedra" || keyword == "Hexaedra") return;
    out_.text("{}\n{}\n", keyword, count);
    for (std::size_t i = 0; i < mesh_.cells.size(); ++i) {
      const MeshCell& cell = mesh_.cells[i];
      if (!is_here(cell)) continue;
      for (int k = 0; k < cell.num_nodes; ++k) out_.text("{} ", cell.nodes[static_cast<std::size_t>(k)] + 1);
      out_.text("{}\n", cells_.of_item[i]);
    }
  }

  const MeshData& mesh_;
  const WrittenReferences nodes_;
  const WrittenReferences cells_;
  FileText out_;
};

}  // namespace

MeshData read_medit(FileCursor& in) {
  return read_twice<MeditReader>(in);
}

void write_medit(const MeshData& mesh, const WriteOptions&, const std::filesystem::path& file) {
  write_finished_text(file, MeditWriter(mesh).write());
}

}  // namespace palpate
