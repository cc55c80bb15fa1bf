// Writes Gmsh's files.
#include <algorithm>
#include <cstdint>
#include <stdexcept>

#include "offline/io/file_text.hpp"
#include "offline/io/finished_file.hpp"
#include "offline/io/gmsh_layout.hpp"
#include "offline/io/mesh_formats.hpp"

namespace palpate {
namespace {

class GmshWriter {
 public:
  GmshWriter(const MeshData& mesh, int version, bool is_binary)
      : mesh_(mesh), layout_(lay_out(mesh)), version_(version), is_binary_(is_binary) {}

  std::string write() {
    if (version_ > 1) write_format();
    if (version_ > 1) write_names();
    if (version_ == 4) {
      write_entities();
      write_node_block();
      write_element_blocks();
    } else {
      write_nodes();
      write_elements();
    }
    if (version_ == 1) write_names();  // Gmsh knows a file of format 1 by its first word, $NOD
    for (const MeshArray& array : mesh_.point_arrays) write_data(array, false);
    for (const MeshArray& array : mesh_.cell_arrays) write_data(array, true);
    return std::move(out_.bytes);
  }

 private:
  // A number of 4 bytes in a binary file.
  void integer(int number) { is_binary_ ? out_.binary(std::int32_t{number}) : out_.text("{} ", number); }

  // A label or a count of format 4.1, 8 bytes in a binary file.
  void wide(std::size_t number) {
    is_binary_ ? out_.binary(std::uint64_t{number}) : out_.text("{} ", number);
  }
  void wide(int number) { wide(static_cast<std::size_t>(number)); }

  void real(double number) { is_binary_ ? out_.binary(number) : out_.text("{} ", number); }

  void end_row() {
    if (is_binary_) return;
    if (out_.bytes.back() == ' ') out_.bytes.pop_back();
    out_.bytes += '\n';
  }

  void end_section(const char* end) {
    if (is_binary_) out_.bytes += '\n';
    out_.text("{}\n", end);
  }

  void write_format() {
    out_.text("$MeshFormat\n{} {} 8\n", version_ == 4 ? "4.1" : "2.2", is_binary_ ? 1 : 0);
    if (is_binary_) {
      out_.binary(std::int32_t{1});  // shows the byte order
      out_.bytes += '\n';
    }
    out_.text("$EndMeshFormat\n");
  }

  void write_names() {
    std::size_t count = 0;
    for (const auto& groups : layout_.groups) count += groups.size();
    if (count == 0) return;
    out_.text("$PhysicalNames\n{}\n", count);
    for (std::size_t rank = 0; rank < 4; ++rank) {
      for (const auto& [name, number] : layout_.groups[rank]) out_.text("{} {} \"{}\"\n", rank, number, name);
    }
    out_.text("$EndPhysicalNames\n");
  }

  void position(int node) {
    const Eigen::Vector3d& place = mesh_.positions[static_cast<std::size_t>(node)];
    for (int axis = 0; axis < 3; ++axis) real(place[axis]);
  }

  void write_entities() {
    Eigen::Vector3d low = Eigen::Vector3d::Zero();
    Eigen::Vector3d high = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < mesh_.positions.size(); ++i) {
      low = i == 0 ? mesh_.positions[i] : low.cwiseMin(mesh_.positions[i]);
      high = i == 0 ? mesh_.positions[i] : high.cwiseMax(mesh_.positions[i]);
    }
    out_.text("$Entities\n");
    for (const auto& entities : layout_.entities) wide(entities.size());
    end_row();
    for (std::size_t rank = 0; rank < 4; ++rank) {
      for (std::size_t i = 0; i < layout_.entities[rank].size(); ++i) {
        const GmshEntity& entity = layout_.entities[rank][i];
        integer(static_cast<int>(i) + 1);
        if (rank == 0) {
          position(entity.node);
        } else {
          for (int axis = 0; axis < 3; ++axis) real(low[axis]);
          for (int axis = 0; axis < 3; ++axis) real(high[axis]);
        }
        wide(entity.groups.size());
        for (const int group : entity.groups) integer(group);
        if (rank > 0) wide(0);  // bounding entities
        end_row();
      }
    }
    end_section("$EndEntities");
  }

  void write_node_block() {
    out_.text("$Nodes\n");
    const std::size_t count = mesh_.positions.size();
    const auto [least, largest] = std::minmax_element(layout_.node_labels.begin(), layout_.node_labels.end());
    int rank = 3;
    while (rank > 0 && layout_.entities[static_cast<std::size_t>(rank)].empty()) --rank;
    wide(count > 0 ? 1 : 0);
    wide(count);
    wide(count > 0 ? *least : 0);
    wide(count > 0 ? *largest : 0);
    end_row();
    if (count > 0) {
      integer(rank);
      integer(1);  // the entity
      integer(0);  // not parametric
      wide(count);
      end_row();
      for (const int label : layout_.node_labels) {
        wide(label);
        end_row();
      }
      for (std::size_t i = 0; i < count; ++i) {
        position(static_cast<int>(i));
        end_row();
      }
    }
    end_section("$EndNodes");
  }

  // Returns the end of the rows from `begin` with its type and entity.
  std::size_t end_of_block(std::size_t begin) const {
    std::size_t end = begin;
    while (end < layout_.rows.size() && layout_.rows[end].type == layout_.rows[begin].type &&
           layout_.rows[end].entity == layout_.rows[begin].entity)
      ++end;
    return end;
  }

  void write_element_blocks() {
    const std::vector<GmshRow>& rows = layout_.rows;
    std::size_t num_blocks = 0;
    for (std::size_t begin = 0; begin < rows.size(); begin = end_of_block(begin)) ++num_blocks;
    int least = rows.empty() ? 0 : rows[0].label;
    for (const GmshRow& row : rows) least = std::min(least, row.label);
    out_.text("$Elements\n");
    wide(num_blocks);
    wide(rows.size());
    wide(least);
    wide(layout_.largest_label);
    end_row();
    for (std::size_t begin = 0; begin < rows.size();) {
      const std::size_t end = end_of_block(begin);
      integer(dimension(rows[begin].type->kind));
      integer(rows[begin].entity);
      integer(rows[begin].type->number);
      wide(end - begin);
      end_row();
      for (; begin < end; ++begin) {
        wide(rows[begin].label);
        for (int i = 0; i < rows[begin].type->num_nodes; ++i) wide(node_label(rows[begin], i));
        end_row();
      }
    }
    end_section("$EndElements");
  }

  int node_label(const GmshRow& row, int i) const {
    const int node = row.cell < 0 ? row.node
                                  : mesh_.cells[static_cast<std::size_t>(row.cell)]
                                        .nodes[static_cast<std::size_t>(gmsh_place(*row.type, i))];
    return layout_.node_labels[static_cast<std::size_t>(node)];
  }

  void write_nodes() {
    out_.text("{}\n{}\n", version_ == 1 ? "$NOD" : "$Nodes", mesh_.positions.size());
    for (std::size_t i = 0; i < mesh_.positions.size(); ++i) {
      integer(layout_.node_labels[i]);
      position(static_cast<int>(i));
      end_row();
    }
    end_section(version_ == 1 ? "$ENDNOD" : "$EndNodes");
  }

  // Formats 1 and 2 have one group an element, so an element in several groups stands there several times.
  void write_elements() {
    std::size_t count = 0;
    for (const GmshRow& row : layout_.rows)
      count += std::max(std::size_t{1}, layout_.entity_of(row).groups.size());
    out_.text("{}\n{}\n", version_ == 1 ? "$ELM" : "$Elements", count);
    int label = layout_.largest_label;
    for (const GmshRow& row : layout_.rows) {
      const std::vector<int>& groups = layout_.entity_of(row).groups;
      write_element(row, row.label, groups.empty() ? 0 : groups[0]);
      for (std::size_t i = 1; i < groups.size(); ++i) write_element(row, ++label, groups[i]);
    }
    end_section(version_ == 1 ? "$ENDELM" : "$EndElements");
  }

  void write_element(const GmshRow& row, int label, int group) {
    if (is_binary_) {
      integer(row.type->number);
      integer(1);  // elements of this block
      integer(2);  // tags
      integer(label);
    } else {
      integer(label);
      integer(row.type->number);
      if (version_ == 2) integer(2);
    }
    integer(group);
    integer(row.entity);
    if (version_ == 1) integer(row.type->num_nodes);
    for (int i = 0; i < row.type->num_nodes; ++i) integer(node_label(row, i));
    end_row();
  }

  void write_data(const MeshArray& array, bool of_cells) {
    const std::size_t count = of_cells ? mesh_.cells.size() : mesh_.positions.size();
    const auto size = static_cast<std::size_t>(array.num_components);
    out_.text("{}\n1\n\"{}\"\n1\n0\n3\n0\n{}\n{}\n", of_cells ? "$ElementData" : "$NodeData", array.name,
              size, count);
    for (std::size_t i = 0; i < count; ++i) {
      integer(of_cells ? layout_.rows[i].label : layout_.node_labels[i]);
      for (std::size_t k = 0; k < size; ++k) real(array.values[i * size + k]);
      end_row();
    }
    end_section(of_cells ? "$EndElementData" : "$EndNodeData");
  }

  const MeshData& mesh_;
  const GmshLayout layout_;
  const int version_;  // 1, 2 or 4
  const bool is_binary_;
  FileText out_;
};

void check_name(const std::filesystem::path& file, const std::string& name) {
  if (name.find_first_of("\"\n\r") != std::string::npos)
    throw std::runtime_error(file.string() + ": Gmsh's files cannot hold the name '" + name +
                             "' with a quotation mark or a line end; rename it");
}

}  // namespace

void write_gmsh(const MeshData& mesh, const WriteOptions& options, const std::filesystem::path& file) {
  for (const auto& [name, set] : mesh.node_sets) check_name(file, name);
  for (const auto& [name, set] : mesh.element_sets) check_name(file, name);
  for (const MeshArray& array : mesh.point_arrays) check_name(file, array.name);
  for (const MeshArray& array : mesh.cell_arrays) check_name(file, array.name);
  const std::string name = file.string();
  const int version = name.ends_with('1') ? 1 : name.ends_with('2') ? 2 : 4;
  write_finished_text(file, GmshWriter(mesh, version, options.is_binary && version > 1).write());
}

}  // namespace palpate
