#include "offline/output/vtu_writer.hpp"

#include <fmt/format.h>

#include <bit>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <set>
#include <span>
#include <stdexcept>
#include <string_view>

#include "offline/output/finished_file.hpp"

namespace palpate {
namespace {

static_assert(std::endian::native == std::endian::little,
              "the values are written in the order they have in memory");
static_assert(sizeof(Eigen::Vector3d) == 3 * sizeof(double) && sizeof(int) == 4);

std::string escape_xml(std::string_view text) {
  std::string escaped;
  for (const char c : text) {
    switch (c) {
      case '&':
        escaped += "&amp;";
        break;
      case '<':
        escaped += "&lt;";
        break;
      case '>':
        escaped += "&gt;";
        break;
      case '"':
        escaped += "&quot;";
        break;
      default:
        escaped += c;
    }
  }
  return escaped;
}

// Collects the XML head and the value blocks; the head contains the blocks' offsets.
class Document {
 public:
  template <typename T>
  void array(std::string_view type, std::string_view name, int components, std::span<const T> values) {
    xml_ += fmt::format(
        "        <DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" format=\"appended\" "
        "offset=\"{}\"/>\n",
        type, escape_xml(name), components, offset_);
    blocks_.push_back(std::as_bytes(values));
    offset_ += sizeof(std::uint64_t) + values.size_bytes();
  }
  void line(std::string_view text) {
    xml_ += text;
    xml_ += '\n';
  }

  void write(std::ostream& out) const {
    out << xml_ << "  <AppendedData encoding=\"raw\">\n_";
    for (const std::span<const std::byte> block : blocks_) {
      const std::uint64_t bytes = block.size();
      out.write(reinterpret_cast<const char*>(&bytes), sizeof bytes);
      out.write(reinterpret_cast<const char*>(block.data()), static_cast<std::streamsize>(bytes));
    }
    out << "\n  </AppendedData>\n</VTKFile>\n";
  }

 private:
  std::string xml_;
  std::vector<std::span<const std::byte>> blocks_;
  std::uint64_t offset_ = 0;
};

void check_fields(const std::vector<VtuArray>& arrays, const std::vector<VtuIntegerArray>& integers,
                  std::size_t count, std::string_view where) {
  std::set<std::string> names;
  const auto check = [&](const std::string& name, std::size_t size, int components) {
    if (name.empty()) throw std::invalid_argument(fmt::format("a {} array has no name", where));
    if (!names.insert(name).second)
      throw std::invalid_argument(fmt::format("two {} arrays are named '{}'", where, name));
    if (components < 1)
      throw std::invalid_argument(fmt::format("{} array '{}' has {} components", where, name, components));
    if (size != count * static_cast<std::size_t>(components))
      throw std::invalid_argument(fmt::format("{} array '{}' has {} values; {} times {} are needed", where,
                                              name, size, count, components));
  };
  for (const VtuArray& array : arrays) check(array.name, array.values.size(), array.components);
  for (const VtuIntegerArray& array : integers) check(array.name, array.values.size(), 1);
}

void add_fields(Document& document, std::string_view element, const std::vector<VtuArray>& arrays,
                const std::vector<VtuIntegerArray>& integers) {
  document.line(fmt::format("      <{}>", element));
  for (const VtuIntegerArray& array : integers) document.array<int>("Int32", array.name, 1, array.values);
  for (const VtuArray& array : arrays)
    document.array<double>("Float64", array.name, array.components, array.values);
  document.line(fmt::format("      </{}>", element));
}

}  // namespace

int nodes_per_cell(VtuCell cell) {
  switch (cell) {
    case VtuCell::kTriangle:
      return 3;
    case VtuCell::kTetrahedron:
      return 4;
    case VtuCell::kQuadraticTetrahedron:
      return 10;
  }
  throw std::invalid_argument(fmt::format("unknown VTK cell type {}", static_cast<int>(cell)));
}

void write_vtu(const VtuMesh& mesh, const std::filesystem::path& path) {
  const std::size_t num_cells = mesh.cells.size();
  std::vector<std::int64_t> cell_ends;
  std::vector<std::uint8_t> cell_types;
  std::int64_t end = 0;
  for (const VtuCell cell : mesh.cells) {
    end += nodes_per_cell(cell);
    cell_ends.push_back(end);
    cell_types.push_back(static_cast<std::uint8_t>(cell));
  }
  if (static_cast<std::size_t>(end) != mesh.connectivity.size()) {
    throw std::invalid_argument(
        fmt::format("{} cells have {} nodes, not {}", num_cells, end, mesh.connectivity.size()));
  }
  std::size_t cell = 0;
  for (std::size_t i = 0; i < mesh.connectivity.size(); ++i) {
    while (static_cast<std::size_t>(cell_ends[cell]) <= i) ++cell;
    if (mesh.connectivity[i] < 0 || static_cast<std::size_t>(mesh.connectivity[i]) >= mesh.points.size())
      throw std::invalid_argument(
          fmt::format("cell {} names point {} of {}", cell, mesh.connectivity[i], mesh.points.size()));
  }
  check_fields(mesh.point_data, mesh.point_integers, mesh.points.size(), "point");
  check_fields(mesh.cell_data, mesh.cell_integers, num_cells, "cell");

  const double* coordinates = mesh.points.empty() ? nullptr : mesh.points.front().data();

  Document document;
  document.line("<?xml version=\"1.0\"?>");
  document.line(
      "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" "
      "header_type=\"UInt64\">");
  document.line("  <UnstructuredGrid>");
  document.line(
      fmt::format("    <Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">", mesh.points.size(), num_cells));
  add_fields(document, "PointData", mesh.point_data, mesh.point_integers);
  add_fields(document, "CellData", mesh.cell_data, mesh.cell_integers);
  document.line("      <Points>");
  document.array<double>("Float64", "Points", 3, {coordinates, 3 * mesh.points.size()});
  document.line("      </Points>");
  document.line("      <Cells>");
  document.array<int>("Int32", "connectivity", 1, mesh.connectivity);
  document.array<std::int64_t>("Int64", "offsets", 1, cell_ends);
  document.array<std::uint8_t>("UInt8", "types", 1, cell_types);
  document.line("      </Cells>");
  document.line("    </Piece>");
  document.line("  </UnstructuredGrid>");

  write_finished_file(path, [&](const std::filesystem::path& temporary) {
    errno = 0;
    std::ofstream out(temporary, std::ios::binary | std::ios::trunc);
    if (out) document.write(out);
    out.close();
    if (!out)
      throw std::runtime_error(path.string() + ": " +
                               (errno != 0 ? std::strerror(errno) : "cannot be written"));
  });
}

}  // namespace palpate
