#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "offline/io/file_text.hpp"
#include "offline/io/finished_file.hpp"
#include "offline/io/mesh_formats.hpp"
#include "offline/io/set_arrays.hpp"
#include "offline/io/vtk_mesh.hpp"

namespace palpate {
namespace {

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
    xml.text("        <DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" format=\"", type,
             escaped_for_xml(name), components);
    if (is_binary_) {
      xml.text("appended\" offset=\"{}\"/>\n", blocks_.bytes.size());
      blocks_.binary(std::uint64_t{values.size_bytes()});
      for (const T value : values) blocks_.binary(value);
      return;
    }
    xml.text("ascii\">\n");
    for (std::size_t i = 0; i < values.size(); ++i)
      xml.text("{}{}", values[i], (i + 1) % static_cast<std::size_t>(components) == 0 ? '\n' : ' ');
    xml.text("        </DataArray>\n");
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

  std::string finish() {
    if (is_binary_) {
      xml.text("  <AppendedData encoding=\"raw\">\n_");
      xml.bytes += blocks_.bytes;
      xml.text("\n  </AppendedData>\n");
    }
    xml.text("</VTKFile>\n");
    return std::move(xml.bytes);
  }

  FileText xml;

 private:
  bool is_binary_;
  FileText blocks_;
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
  document.xml.text("      <Cells>\n");
  document.array<int>("Int32", "connectivity", 1, connectivity);
  document.array<std::int64_t>("Int64", "offsets", 1, cell_ends);
  document.array<std::uint8_t>("UInt8", "types", 1, cell_types);
  document.xml.text("      </Cells>\n");
}

}  // namespace

void write_vtu(const MeshData& mesh, const WriteOptions& options, const std::filesystem::path& file) {
  std::vector<double> coordinates;
  coordinates.reserve(3 * mesh.positions.size());
  for (const Eigen::Vector3d& position : mesh.positions)
    coordinates.insert(coordinates.end(), position.begin(), position.end());
  VtuDocument document(options.is_binary);
  document.xml.text(
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" "
      "byte_order=\"LittleEndian\" "
      "header_type=\"UInt64\">\n  <UnstructuredGrid>\n    <Piece NumberOfPoints=\"{}\" "
      "NumberOfCells=\"{}\">\n"
      "      <PointData>\n",
      mesh.positions.size(), mesh.cells.size());
  document.arrays(point_arrays_with_sets(mesh));
  document.xml.text("      </PointData>\n      <CellData>\n");
  document.arrays(cell_arrays_with_sets(mesh));
  document.xml.text("      </CellData>\n      <Points>\n");
  document.array<double>("Float64", "Points", 3, coordinates);
  document.xml.text("      </Points>\n");
  add_vtu_cells(mesh, document);
  document.xml.text("    </Piece>\n  </UnstructuredGrid>\n");
  write_finished_text(file, document.finish());
}

}  // namespace palpate
