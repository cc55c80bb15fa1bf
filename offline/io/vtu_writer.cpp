#include <fmt/format.h>

#include <bit>
#include <cstdint>
#include <iterator>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "offline/io/finished_file.hpp"
#include "offline/io/mesh_formats.hpp"
#include "offline/io/set_arrays.hpp"
#include "offline/io/vtk_mesh.hpp"

namespace palpate {
namespace {

static_assert(std::endian::native == std::endian::little,
              "the values are written in the order they have in memory");
static_assert(sizeof(Eigen::Vector3d) == 3 * sizeof(double) && sizeof(int) == 4);

std::string escaped_for_xml(std::string_view text) {
  std::string escaped;
  for (const char letter : text) {
    if (letter == '&') {
      escaped += "&amp;";
    } else if (letter == '<') {
      escaped += "&lt;";
    } else if (letter == '"') {
      escaped += "&quot;";
    } else {
      escaped += letter;
    }
  }
  return escaped;
}

// Collects the XML and the value blocks; the XML contains the blocks' offsets, or the values as text.
class VtuDocument {
 public:
  explicit VtuDocument(bool is_binary) : is_binary_(is_binary) {}

  template <typename T>
  void array(std::string_view type, std::string_view name, int components, std::span<const T> values) {
    xml_ += fmt::format("        <DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" format=\"",
                        type, escaped_for_xml(name), components);
    if (!is_binary_) {
      xml_ += "ascii\">\n";
      for (std::size_t i = 0; i < values.size(); ++i) {
        fmt::format_to(std::back_inserter(xml_), "{}", values[i]);
        xml_ += (i + 1) % static_cast<std::size_t>(components) == 0 ? '\n' : ' ';
      }
      xml_ += "        </DataArray>\n";
      return;
    }
    xml_ += fmt::format("appended\" offset=\"{}\"/>\n", blocks_.size());
    const std::uint64_t bytes = values.size_bytes();
    blocks_.append(reinterpret_cast<const char*>(&bytes), sizeof bytes);
    blocks_.append(reinterpret_cast<const char*>(values.data()), bytes);
  }

  void arrays(const std::vector<MeshArray>& arrays) {
    for (const MeshArray& mesh_array : arrays) {
      if (has_integers(mesh_array)) {
        const std::vector<int> integers(mesh_array.values.begin(), mesh_array.values.end());
        array<int>("Int32", mesh_array.name, 1, integers);
      } else {
        array<double>("Float64", mesh_array.name, mesh_array.num_components, mesh_array.values);
      }
    }
  }

  void line(std::string_view text) {
    xml_ += text;
    xml_ += '\n';
  }

  std::string text() const {
    if (!is_binary_) return xml_ + "</VTKFile>\n";
    return xml_ + "  <AppendedData encoding=\"raw\">\n_" + blocks_ + "\n  </AppendedData>\n</VTKFile>\n";
  }

 private:
  bool is_binary_;
  std::string xml_;
  std::string blocks_;
};

void add_vtu_cells(const MeshData& mesh, VtuDocument& document) {
  std::vector<int> connectivity;
  std::vector<std::int64_t> cell_ends;
  std::vector<std::uint8_t> cell_types;
  for (const MeshCell& cell : mesh.cells) {
    connectivity.insert(connectivity.end(), cell.nodes.begin(), cell.nodes.begin() + cell.num_nodes);
    cell_ends.push_back(static_cast<std::int64_t>(connectivity.size()));
    cell_types.push_back(static_cast<std::uint8_t>(vtk_type(cell)));
  }
  document.line("      <Cells>");
  document.array<int>("Int32", "connectivity", 1, connectivity);
  document.array<std::int64_t>("Int64", "offsets", 1, cell_ends);
  document.array<std::uint8_t>("UInt8", "types", 1, cell_types);
  document.line("      </Cells>");
}

}  // namespace

void write_vtu(const MeshData& mesh, const WriteOptions& options, const std::filesystem::path& file) {
  std::vector<double> coordinates;
  coordinates.reserve(3 * mesh.positions.size());
  for (const Eigen::Vector3d& position : mesh.positions)
    coordinates.insert(coordinates.end(), position.begin(), position.end());
  VtuDocument document(options.is_binary);
  document.line("<?xml version=\"1.0\"?>");
  document.line(
      "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" "
      "header_type=\"UInt64\">");
  document.line("  <UnstructuredGrid>");
  document.line(fmt::format("    <Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">", mesh.positions.size(),
                            mesh.cells.size()));
  document.line("      <PointData>");
  document.arrays(point_arrays_with_sets(mesh));
  document.line("      </PointData>");
  document.line("      <CellData>");
  document.arrays(cell_arrays_with_sets(mesh));
  document.line("      </CellData>");
  document.line("      <Points>");
  document.array<double>("Float64", "Points", 3, coordinates);
  document.line("      </Points>");
  add_vtu_cells(mesh, document);
  document.line("    </Piece>");
  document.line("  </UnstructuredGrid>");
  write_finished_text(file, document.text());
}

}  // namespace palpate
