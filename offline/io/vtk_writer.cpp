#include <fmt/format.h>

#include <bit>
#include <cstdint>
#include <iterator>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "offline/io/finished_file.hpp"
#include "offline/io/set_arrays.hpp"
#include "offline/io/vtk_attributes.hpp"
#include "offline/io/vtk_format.hpp"
#include "offline/io/vtk_mesh.hpp"

namespace palpate {
namespace {

class LegacyVtkWriter {
 public:
  explicit LegacyVtkWriter(bool is_binary) : is_binary_(is_binary) {}

  std::string text(const MeshData& mesh) {
    line("# vtk DataFile Version 4.2");
    line("written by Palpate");
    line(is_binary_ ? "BINARY" : "ASCII");
    line("DATASET UNSTRUCTURED_GRID");
    line(fmt::format("POINTS {} double", mesh.positions.size()));
    for (const Eigen::Vector3d& position : mesh.positions) {
      for (const double coordinate : position) number(coordinate);
      end_row();
    }
    end_block();
    write_cells(mesh);
    write_arrays("POINT_DATA", mesh.positions.size(), point_arrays_with_sets(mesh));
    write_arrays("CELL_DATA", mesh.cells.size(), cell_arrays_with_sets(mesh));
    return std::move(text_);
  }

 private:
  void write_cells(const MeshData& mesh) {
    std::size_t size = mesh.cells.size();
    for (const MeshCell& cell : mesh.cells) size += static_cast<std::size_t>(cell.num_nodes);
    line(fmt::format("CELLS {} {}", mesh.cells.size(), size));
    for (const MeshCell& cell : mesh.cells) {
      number(std::int32_t{cell.num_nodes});
      for (int i = 0; i < cell.num_nodes; ++i) number(std::int32_t{cell.nodes[static_cast<std::size_t>(i)]});
      end_row();
    }
    end_block();
    line(fmt::format("CELL_TYPES {}", mesh.cells.size()));
    for (const MeshCell& cell : mesh.cells) {
      number(std::int32_t{vtk_type(cell)});
      end_row();
    }
    end_block();
  }

  void write_arrays(std::string_view keyword, std::size_t size, const std::vector<MeshArray>& arrays) {
    if (arrays.empty()) return;
    line(fmt::format("{} {}", keyword, size));
    line(fmt::format("FIELD FieldData {}", arrays.size()));
    for (const MeshArray& array : arrays) {
      const bool is_integer = has_integers(array);
      line(fmt::format("{} {} {} {}", encoded_vtk_name(array.name), array.num_components, size,
                       is_integer ? "int" : "double"));
      for (std::size_t i = 0; i < array.values.size(); ++i) {
        is_integer ? number(static_cast<std::int32_t>(array.values[i])) : number(array.values[i]);
        if ((i + 1) % static_cast<std::size_t>(array.num_components) == 0) end_row();
      }
      end_block();
    }
  }

  template <typename Number>
  void number(Number value) {
    if (!is_binary_) {
      if (!row_is_empty_) text_ += ' ';
      fmt::format_to(std::back_inserter(text_), "{}", value);
      row_is_empty_ = false;
      return;
    }
    using Bits = std::conditional_t<sizeof(Number) == 8, std::uint64_t, std::uint32_t>;
    const auto bits = std::bit_cast<Bits>(value);
    for (int shift = 8 * (static_cast<int>(sizeof bits) - 1); shift >= 0; shift -= 8)
      text_ += static_cast<char>(bits >> shift & 0xff);
  }

  void line(std::string_view text) {
    text_ += text;
    text_ += '\n';
  }

  void end_row() {
    if (!is_binary_) text_ += '\n';
    row_is_empty_ = true;
  }

  void end_block() {
    if (is_binary_) text_ += '\n';
  }

  bool is_binary_;
  bool row_is_empty_ = true;
  std::string text_;
};

}  // namespace

void write_vtk(const MeshData& mesh, const WriteOptions& options, const std::filesystem::path& file) {
  write_finished_text(file, LegacyVtkWriter(options.is_binary).text(mesh));
}

}  // namespace palpate
