#include "offline/io/stl_format.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <array>
#include <bit>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <functional>
#include <iterator>
#include <string>
#include <unordered_map>

#include "offline/io/file_number.hpp"
#include "offline/io/finished_file.hpp"
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
  explicit StlReader(FileCursor& cursor) : cursor_(cursor) { mesh_.file = cursor.file(); }

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
    } else if (trimmed(start).starts_with("solid")) {
      read_text();
    } else if (start.size() < kHeadBytes) {
      cursor_.fail_at(0, "is no STL file, which starts with 'solid' or with 84 bytes; check its ending");
    } else {
      cursor_.fail_at(0, fmt::format("has {} bytes, where its {} triangles take {}; copy or export it again",
                                     size, num_facets, expected));
    }
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
      add_polygon(nodes, 0, mesh_);
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
    add_polygon(nodes, line, mesh_);
  }

  int next_node(NumberCoding coding) {
    std::array<double, 3> point{};
    for (double& coordinate : point) {
      coordinate = next_number(cursor_, NumberType::float32, coding, "a coordinate");
      if (!std::isfinite(coordinate))
        cursor_.fail_at(coding == NumberCoding::text ? cursor_.line() : 0,
                        fmt::format("triangle {} has a coordinate that is no finite number; correct it",
                                    mesh_.cells.size() + 1));
      coordinate += 0.0;  // makes -0 equal to 0 in the bits, too
    }
    const auto [place, is_new] = nodes_.try_emplace(point, static_cast<int>(mesh_.positions.size()));
    if (is_new) mesh_.positions.emplace_back(point[0], point[1], point[2]);
    return place->second;
  }

  std::string lower_word() {
    std::string word(cursor_.peek_word().substr(0, 16));  // no keyword is longer
    for (char& letter : word) letter = static_cast<char>(std::tolower(static_cast<unsigned char>(letter)));
    return word;
  }

  void expect(const char* keyword) {
    if (lower_word() != keyword) {
      const std::string found = printable(cursor_.next_word(keyword));
      cursor_.fail("'" + found + "' stands where '" + keyword + "' should be; export the file again");
    }
    cursor_.next_word(keyword);
  }

  FileCursor& cursor_;
  MeshData mesh_;
  std::unordered_map<std::array<double, 3>, int, PointHash> nodes_;
};

void append_float(std::string& bytes, double number) {
  const auto bits = std::bit_cast<std::uint32_t>(static_cast<float>(number));
  for (int shift = 0; shift < 32; shift += 8) bytes += static_cast<char>(bits >> shift & 0xff);
}

void append_facet(std::string& text, const std::array<Eigen::Vector3d, 4>& normal_and_corners,
                  bool is_binary) {
  if (is_binary) {
    for (const Eigen::Vector3d& vector : normal_and_corners) {
      for (const double number : vector) append_float(text, number);
    }
    text.append(2, '\0');
    return;
  }
  const auto row = [&](const char* keyword, const Eigen::Vector3d& vector) {
    fmt::format_to(std::back_inserter(text), "{} {} {} {}\n", keyword, vector[0], vector[1], vector[2]);
  };
  row("facet normal", normal_and_corners[0]);
  text += "outer loop\n";
  for (std::size_t i = 1; i < 4; ++i) row("vertex", normal_and_corners[i]);
  text += "endloop\nendfacet\n";
}

}  // namespace

MeshData read_stl(FileCursor& cursor) {
  return StlReader(cursor).read();
}

MeshData read_stl(const std::filesystem::path& file) {
  FileCursor cursor(file);
  return read_stl(cursor);
}

void write_stl(const MeshData& mesh, const WriteOptions& options, const std::filesystem::path& file) {
  const SurfaceTriangles surface = surface_triangles(mesh, file);
  std::string text = "solid written by Palpate\n";
  if (options.is_binary) {
    text = "written by Palpate";
    text.resize(kTitleBytes, ' ');
    for (int shift = 0; shift < 32; shift += 8)
      text += static_cast<char>(surface.triangles.size() >> shift & 0xff);
  }
  for (const std::array<int, 3>& triangle : surface.triangles) {
    const auto corner = [&](int i) {
      return surface.positions[static_cast<std::size_t>(triangle[static_cast<std::size_t>(i)])];
    };
    const Eigen::Vector3d normal = (corner(1) - corner(0)).cross(corner(2) - corner(0));
    const double length = normal.norm();
    append_facet(text,
                 {length > 0 ? Eigen::Vector3d(normal / length) : normal, corner(0), corner(1), corner(2)},
                 options.is_binary);
  }
  if (!options.is_binary) text += "endsolid written by Palpate\n";
  write_finished_text(file, text);
}

}  // namespace palpate
