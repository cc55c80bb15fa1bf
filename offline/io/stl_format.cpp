// STL files: the triangles of a surface, as text ("solid NAME", "facet ...") or binary:
//
//   80 bytes of title, uint32 n, then n times: normal, three corners (float32), two bytes of attributes
//
// Corners at equal coordinates become one node; normals are passed over. Several solids with names become
// element sets.
// Written are the mesh's triangles, or the outer faces of its tetrahedra (surface_cells.hpp). A binary file
// keeps seven digits of a coordinate, text keeps all.
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <string>
#include <unordered_map>

#include "offline/io/file_number.hpp"
#include "offline/io/file_text.hpp"
#include "offline/io/finished_file.hpp"
#include "offline/io/mesh_formats.hpp"
#include "offline/io/surface_cells.hpp"
#include "offline/mesh/text_number.hpp"

namespace palpate {
namespace {

constexpr std::size_t kTitleBytes = 80, kHeadBytes = 84, kFacetBytes = 50;

struct PointHash {
  std::size_t operator()(const std::array<double, 3>& point) const {
    std::size_t hash = 0;
    for (const double coordinate : point) hash = hash * 1'000'003 + std::hash<double>()(coordinate);
    return hash;
  }
};

class StlReader {
 public:
  StlReader(Pass pass, FileCursor& cursor) : cursor_(cursor), keeps_(pass == Pass::build) {
    mesh_.file = cursor.file();
  }

  MeshData read() {
    const std::size_t size = cursor_.num_left();
    const std::string start(cursor_.peek_bytes(kHeadBytes));
    std::uint32_t num_facets = 0;
    if (start.size() == kHeadBytes) {
      for (std::size_t i = 0; i < 4; ++i)
        num_facets |= std::uint32_t{static_cast<unsigned char>(start[kTitleBytes + i])} << (8 * i);
    }
    const std::size_t expected = kHeadBytes + kFacetBytes * std::size_t{num_facets};
    // Some programs write titles that begin with "solid" in binary files, so the size decides first.
    if (start.size() == kHeadBytes && size == expected) {
      read_binary(num_facets);
    } else if (start.find('\0') == std::string::npos && lower_word().starts_with("solid")) {
      read_text();
    } else if (start.size() < kHeadBytes) {
      cursor_.fail_at(0, "is no STL file, which starts with 'solid' or with 84 bytes; check its ending");
    } else {
      cursor_.fail_at(0, fmt::format("has {} bytes, where its {} triangles take {}; copy or export it again",
                                     size, num_facets, expected));
    }
    if (num_triangles_ == 0) cursor_.fail_at(0, "has no triangles; export a surface");
    drop_whole_sets(mesh_);
    number_from_one(mesh_);
    return std::move(mesh_);
  }

 private:
  void read_binary(std::uint32_t num_facets) {
    cursor_.next_bytes(kHeadBytes, "the head");
    for (std::uint32_t i = 0; i < num_facets; ++i) {
      cursor_.next_bytes(3 * sizeof(float), "a normal");
      std::array<int, 3> nodes{};
      for (int& node : nodes) node = next_node(NumberCoding::little_endian);
      cursor_.next_bytes(2, "the attributes of a triangle");
      add_triangle(nodes, 0);
    }
  }

  void read_text() {
    while (cursor_.skip_blanks()) {
      expect("solid");
      const std::string name(trimmed(cursor_.next_line("the name of a solid")));
      const std::size_t first = mesh_.cells.size();
      while (lower_word() == "facet") read_facet();
      for (std::size_t cell = first; cell < mesh_.cells.size() && !name.empty(); ++cell)
        mesh_.element_sets[name].push_back(static_cast<int>(cell));
      expect("endsolid");
      if (!cursor_.at_end()) cursor_.next_line("the name of a solid");
    }
  }

  void read_facet() {
    const int line = cursor_.line();
    expect("facet");
    expect("normal");
    for (int axis = 0; axis < 3; ++axis)  // programs write nan for a sliver
      next_number(cursor_, NumberType::float64, NumberCoding::text, "a normal");
    expect("outer");
    expect("loop");
    std::array<int, 3> nodes{};
    for (int& node : nodes) {
      expect("vertex");
      node = next_node(NumberCoding::text);
    }
    expect("endloop");
    expect("endfacet");
    add_triangle(nodes, line);
  }

  void add_triangle(const std::array<int, 3>& nodes, int line) {
    ++num_triangles_;
    if (keeps_) add_polygon(nodes, line, mesh_);
  }

  int next_node(NumberCoding coding) {
    std::array<double, 3> point{};
    for (double& coordinate : point) {
      coordinate = next_number(cursor_, NumberType::float32, coding, "a coordinate");
      if (!std::isfinite(coordinate))
        cursor_.fail(fmt::format("triangle {} has a coordinate that is no finite number; correct it",
                                 num_triangles_ + 1));
      coordinate += 0.0;  // makes -0 equal to 0 in the bits, too
    }
    if (!keeps_) return 0;
    const auto [place, is_new] = nodes_.try_emplace(point, static_cast<int>(mesh_.positions.size()));
    if (is_new) mesh_.positions.emplace_back(point[0], point[1], point[2]);
    return place->second;
  }

  std::string lower_word() { return lower_case(cursor_.peek_word().substr(0, 16)); }  // no keyword is longer

  void expect(const char* keyword) {
    if (lower_word() != keyword) {
      const std::string found = printable(cursor_.next_word(keyword));
      cursor_.fail("'" + found + "' stands where '" + keyword + "' should be; export the file again");
    }
    cursor_.next_word(keyword);
  }

  FileCursor& cursor_;
  const bool keeps_;
  MeshData mesh_;
  std::size_t num_triangles_ = 0;
  std::unordered_map<std::array<double, 3>, int, PointHash> nodes_;
};

void add_facet(const std::array<Eigen::Vector3d, 4>& normal_and_corners, bool is_binary, FileText& out) {
  if (is_binary) {
    for (const Eigen::Vector3d& vector : normal_and_corners) {
      for (const double number : vector) out.binary(static_cast<float>(number));
    }
    out.bytes.append(2, '\0');
    return;
  }
  const char* const before[] = {"facet normal", "outer loop\nvertex", "vertex", "vertex"};
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector3d& vector = normal_and_corners[i];
    out.text("{} {} {} {}\n", before[i], vector[0], vector[1], vector[2]);
  }
  out.text("endloop\nendfacet\n");
}

}  // namespace

MeshData read_stl(FileCursor& cursor) {
  return read_twice<StlReader>(cursor);
}

void write_stl(const MeshData& mesh, const WriteOptions& options, const std::filesystem::path& file) {
  const SurfaceTriangles surface = surface_triangles(mesh, file);
  FileText out;
  out.bytes = options.is_binary ? "written by Palpate" : "solid written by Palpate\n";
  if (options.is_binary) {
    out.bytes.resize(kTitleBytes, ' ');
    out.binary(static_cast<std::uint32_t>(surface.triangles.size()));
  }
  for (const std::array<int, 3>& triangle : surface.triangles) {
    const auto corner = [&](int i) {
      return surface.positions[static_cast<std::size_t>(triangle[static_cast<std::size_t>(i)])];
    };
    const Eigen::Vector3d normal = (corner(1) - corner(0)).cross(corner(2) - corner(0));
    const double length = normal.norm();
    add_facet({length > 0 ? Eigen::Vector3d(normal / length) : normal, corner(0), corner(1), corner(2)},
              options.is_binary, out);
  }
  if (!options.is_binary) out.text("endsolid written by Palpate\n");
  write_finished_text(file, out.bytes);
}

}  // namespace palpate
