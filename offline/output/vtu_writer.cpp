#include "offline/output/vtu_writer.hpp"

#include <fmt/format.h>

#include <bit>
#include <span>
#include <string_view>

#include "offline/io/finished_file.hpp"

namespace palpate {
namespace {

static_assert(std::endian::native == std::endian::little,
              "the values are written in the order they have in memory");
static_assert(sizeof(Eigen::Vector3d) == 3 * sizeof(double) && sizeof(int) == 4);

// Collects the XML head and the value blocks; the head contains the blocks' offsets.
class Document {
 public:
  template <typename T>
  void array(std::string_view type, std::string_view name, int components, std::span<const T> values) {
    xml_ += fmt::format(
        "        <DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" format=\"appended\" "
        "offset=\"{}\"/>\n",
        type, name, components, blocks_.size());
    const std::uint64_t bytes = values.size_bytes();
    blocks_.append(reinterpret_cast<const char*>(&bytes), sizeof bytes);
    blocks_.append(reinterpret_cast<const char*>(values.data()), bytes);
  }
  void line(std::string_view text) {
    xml_ += text;
    xml_ += '\n';
  }

  std::string text() const {
    return xml_ + "  <AppendedData encoding=\"raw\">\n_" + blocks_ + "\n  </AppendedData>\n</VTKFile>\n";
  }

 private:
  std::string xml_;
  std::string blocks_;
};

}  // namespace

void write_vtu(const VtuMesh& mesh, const std::filesystem::path& path) {
  std::vector<std::int64_t> cell_ends;
  std::vector<std::uint8_t> cell_types;
  std::int64_t end = 0;
  for (const VtuCell cell : mesh.cells) {
    end += cell == VtuCell::kTetrahedron ? 4 : 10;
    cell_ends.push_back(end);
    cell_types.push_back(static_cast<std::uint8_t>(cell));
  }

  Document document;
  document.line("<?xml version=\"1.0\"?>");
  document.line(
      "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" "
      "header_type=\"UInt64\">");
  document.line("  <UnstructuredGrid>");
  document.line(fmt::format("    <Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">", mesh.points.size(),
                            mesh.cells.size()));
  document.line("      <PointData>");
  for (const VtuIntegers& field : mesh.point_integers)
    document.array<int>("Int32", field.name, 1, field.values);
  for (const VtuVectors& field : mesh.point_vectors)
    document.array<double>("Float64", field.name, 3, field.values);
  document.line("      </PointData>");
  document.line("      <CellData>");
  for (const VtuIntegers& field : mesh.cell_integers)
    document.array<int>("Int32", field.name, 1, field.values);
  document.line("      </CellData>");
  document.line("      <Points>");
  document.array<double>("Float64", "Points", 3, {mesh.points.front().data(), 3 * mesh.points.size()});
  document.line("      </Points>");
  document.line("      <Cells>");
  document.array<int>("Int32", "connectivity", 1, mesh.connectivity);
  document.array<std::int64_t>("Int64", "offsets", 1, cell_ends);
  document.array<std::uint8_t>("UInt8", "types", 1, cell_types);
  document.line("      </Cells>");
  document.line("    </Piece>");
  document.line("  </UnstructuredGrid>");
  write_finished_text(path, document.text());
}

}  // namespace palpate
