#include "offline/io/inp_format.hpp"

#include <utility>
#include <vector>

#include "offline/io/file_text.hpp"
#include "offline/io/finished_file.hpp"
#include "offline/io/model_from_mesh.hpp"
#include "offline/mesh/inp_reader.hpp"

namespace palpate {
namespace {

void write_elements(const MeshData& mesh, int num_nodes, FileText& out) {
  bool has_keyword = false;
  for (const MeshCell& cell : mesh.cells) {
    if (cell.kind != CellKind::tetrahedron || cell.num_nodes != num_nodes) continue;
    if (!has_keyword) out.text("*ELEMENT, TYPE=C3D{}, ELSET=ALL\n", num_nodes);
    has_keyword = true;
    out.text("{}", cell.label);
    for (int a = 0; a < num_nodes; ++a) {
      const int node = cell.nodes[static_cast<size_t>(a)];
      out.text(", {}", mesh.node_labels[static_cast<size_t>(node)]);
    }
    out.text("\n");
  }
}

// Writes a set as lines of at most 16 labels. `label_of`: the label of a member; 0: not a member of the file.
template <typename LabelOf>
void write_set(const char* keyword, const std::string& name, const std::vector<int>& members,
               const LabelOf& label_of, FileText& out) {
  constexpr int kPerLine = 16;
  int count = 0;
  for (const int member : members) {
    const int label = label_of(member);
    if (label == 0) continue;
    if (count == 0) out.text("*{0}, {0}={1}\n", keyword, name);
    out.text("{}{}", count % kPerLine == 0 ? "" : ", ", label);
    if (++count % kPerLine == 0) out.text("\n");
  }
  if (count % kPerLine != 0) out.text("\n");
}

// Quotes a name that a reader of .inp would change: blanks, commas, lower case.
std::string quoted(const std::string& name) {
  for (const char letter : name) {
    const bool is_plain = (letter >= 'A' && letter <= 'Z') || (letter >= '0' && letter <= '9') ||
                          letter == '_' || letter == '-' || letter == '.';
    if (!is_plain) return '"' + name + '"';
  }
  return name;
}

}  // namespace

MeshData read_inp_mesh_file(const std::filesystem::path& file) {
  return mesh_from_model(read_inp_mesh(file));
}

std::string inp_mesh_text(const MeshData& mesh) {
  FileText out;
  out.text("*NODE\n");
  for (size_t node = 0; node < mesh.positions.size(); ++node) {
    const Eigen::Vector3d& x = mesh.positions[node];
    out.text("{}, {}, {}, {}\n", mesh.node_labels[node], x[0], x[1], x[2]);
  }
  write_elements(mesh, 4, out);
  write_elements(mesh, 10, out);
  const auto node_label = [&](int node) { return mesh.node_labels[static_cast<size_t>(node)]; };
  const auto cell_label = [&](int index) {
    const MeshCell& cell = mesh.cells[static_cast<size_t>(index)];
    return cell.kind == CellKind::tetrahedron ? cell.label : 0;
  };
  for (const auto& [name, members] : mesh.node_sets)
    write_set("NSET", quoted(name), members, node_label, out);
  for (const auto& [name, members] : mesh.element_sets) {
    if (name != "ALL") write_set("ELSET", quoted(name), members, cell_label, out);
  }
  return std::move(out.bytes);
}

void write_inp_mesh(const MeshData& mesh, const WriteOptions& /*options*/,
                    const std::filesystem::path& file) {
  const Model model = model_from_mesh(mesh);  // throws without tetrahedra
  write_finished_text(file, inp_mesh_text(mesh_from_model(model)));
}

}  // namespace palpate
