#include <fmt/format.h>

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "offline/io/file_text.hpp"
#include "offline/io/finished_file.hpp"
#include "offline/io/mesh_formats.hpp"
#include "offline/io/set_arrays.hpp"
#include "offline/io/vtk_attributes.hpp"
#include "offline/io/vtk_mesh.hpp"

namespace palpate {
namespace {

class LegacyVtkWriter {
 public:
  explicit LegacyVtkWriter(bool is_binary) : is_binary_(is_binary) {}

  std::string text(const MeshData& mesh) {
    out_.text("# vtk DataFile Version 4.2\nwritten by Palpate\n{}\nDATASET UNSTRUCTURED_GRID\n",
              is_binary_ ? "BINARY" : "ASCII");
    out_.text("POINTS {} double\n", mesh.positions.size());
    for (const Eigen::Vector3d& position : mesh.positions) {
      for (const double coordinate : position) number(coordinate);
      end_row();
    }
    end_block();
    write_cells(mesh);
    write_arrays("POINT_DATA", mesh.positions.size(), point_arrays_with_sets(mesh));
    write_arrays("CELL_DATA", mesh.cells.size(), cell_arrays_with_sets(mesh));
    return std::move(out_.bytes);
  }

 private:
  void write_cells(const MeshData& mesh) {
    std::size_t size = mesh.cells.size();
    for (const MeshCell& cell : mesh.cells) size += static_cast<std::size_t>(cell.num_nodes);
    out_.text("CELLS {} {}\n", mesh.cells.size(), size);
    for (const MeshCell& cell : mesh.cells) {
      number(std::int32_t{cell.num_nodes});
      for (int i = 0; i < cell.num_nodes; ++i) number(std::int32_t{cell.nodes[static_cast<std::size_t>(i)]});
      end_row();
    }
    end_block();
    out_.text("CELL_TYPES {}\n", mesh.cells.size());
    for (const MeshCell& cell : mesh.cells) {
      number(std::int32_t{vtk_type(cell)});
      end_row();
    }
    end_block();
  }

  void write_arrays(std::string_view keyword, std::size_t size, const std::vector<MeshArray>& arrays) {
    if (arrays.empty()) return;
    out_.text("{} {}\n", keyword, size);
    out_.text("FIELD FieldData {}\n", arrays.size());
    for (const MeshArray& array : arrays) {
      const bool is_integer = has_integers(array);
      out_.text("{} {} {} {}\n", encoded_vtk_name(array.name), array.num_components, size,
                is_integer ? "int" : "double");
      for (std::size_t i = 0; i < array.values.size(); ++i) {
        is_integer ? number(static_cast<std::int32_t>(array.values[i])) : number(array.values[i]);
        if ((i + 1) % static_cast<std::size_t>(array.num_components) == 0) end_row();
      }
      end_block();
    }
  }

  template <typename Number>
  void number(Number value) {
    if (is_binary_) return out_.binary(value, true);
    out_.text("{}{}", row_is_empty_ ? "" : " ", value);
    row_is_empty_ = false;
  }

  void end_row() {
    if (!is_binary_) out_.bytes += '\n';
    row_is_empty_ = true;
  }

  void end_block() {
    if (is_binary_) out_.bytes += '\n';
  }

  bool is_binary_;
  bool row_is_empty_ = true;
  FileText out_;
};

}  // namespace

void write_vtk(const MeshData& mesh, const WriteOptions& options, const std::filesystem::path& file) {
  write_finished_text(file, LegacyVtkWriter(options.is_binary).text(mesh));
}

}  // namespace palpate
