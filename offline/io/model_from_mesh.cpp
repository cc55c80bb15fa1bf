#include "offline/io/model_from_mesh.hpp"

#include <fmt/core.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <filesystem>
#include <map>
#include <utility>

#include "offline/mesh/input_error.hpp"
#include "offline/mesh/model_check.hpp"

namespace palpate {
namespace {

// Says how to fill a surface: with edges of a 25th of its length, which give an organ of some thousand nodes.
std::string surface_remedy(const MeshData& mesh) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& position : mesh.positions) box.extend(position);
  std::filesystem::path filled = mesh.file;
  filled.replace_extension(".vtu");
  if (filled == mesh.file) filled.replace_filename(filled.stem().string() + "_solid.vtu");
  return fmt::format("holds a surface alone: run `palpate mesh {} --size {:.2g} -o {}` first", mesh.file,
                     box.sizes().maxCoeff() / 25, filled.string());
}

// Says which cells the model leaves out. Throws if no tetrahedra are left, with a remedy for the other kinds.
void check_kinds(const MeshData& mesh, Model& model) {
  std::map<CellKind, size_t> counts;
  for (const MeshCell& cell : mesh.cells) ++counts[cell.kind];
  const SourceLine whole = {mesh.file, 0};
  const size_t others = counts[CellKind::hexahedron] + counts[CellKind::wedge] + counts[CellKind::pyramid];
  if (others > 0)
    throw InputError(whole, fmt::format("has {} hexahedra, wedges or pyramids, which would be missing in the "
                                        "organ; split them into tetrahedra: palpate convert --split",
                                        others));
  if (counts[CellKind::tetrahedron] == 0) {
    throw InputError(whole, counts[CellKind::triangle] + counts[CellKind::quadrilateral] > 0
                                ? surface_remedy(mesh)
                                : "has no tetrahedra; export the volume mesh");
  }
  std::string left_out;
  for (const auto& [kind, count] : counts) {
    if (kind != CellKind::tetrahedron && count > 0)
      left_out += fmt::format("{}{} {}", left_out.empty() ? "" : ", ", count, plural_name(kind));
  }
  if (!left_out.empty())
    model.warnings.push_back(mesh.file + ": left out " + left_out + ", which carry no load here");
}

// Copies the nodes that elements use. Returns the new index of each node of the mesh, or -1.
std::vector<int> copy_used_nodes(const MeshData& mesh, Model& model) {
  std::vector<int> index(mesh.positions.size(), -1);
  for (const MeshCell& cell : mesh.cells) {
    for (int a = 0; a < cell.num_nodes && cell.kind == CellKind::tetrahedron; ++a)
      index[static_cast<size_t>(cell.nodes[static_cast<size_t>(a)])] = 0;
  }
  for (size_t node = 0; node < index.size(); ++node) {
    if (index[node] < 0) continue;
    index[node] = model.num_nodes();
    model.positions.push_back(mesh.positions[node]);
    model.labels.push_back(mesh.node_labels[node]);
  }
  if (const size_t unused = index.size() - model.positions.size(); unused > 0)
    model.warnings.push_back(
        fmt::format("{}: left out {} nodes that belong to no tetrahedron", mesh.file, unused));
  return index;
}

// Turns an inverted element around: exchanges two corners, and the middles of the edges with them.
void turn_around(Tetrahedron& element) {
  std::swap(element.node_array[1], element.node_array[2]);
  if (element.num_nodes == 4) return;
  std::swap(element.node_array[4], element.node_array[6]);  // 01, 02
  std::swap(element.node_array[8], element.node_array[9]);  // 13, 23
}

// Returns the members of a set in the model, sorted. `index`: new indices, or -1.
std::vector<int> kept_members(const std::vector<int>& members, const std::vector<int>& index) {
  std::vector<int> kept;
  for (const int member : members) {
    if (index[static_cast<size_t>(member)] >= 0) kept.push_back(index[static_cast<size_t>(member)]);
  }
  std::sort(kept.begin(), kept.end());
  return kept;
}

}  // namespace

Model model_from_mesh(const MeshData& mesh) {
  Model model;
  model.file = mesh.file;
  model.files = {mesh.file};
  model.warnings = mesh.notes;
  check_kinds(mesh, model);
  const std::vector<int> node_index = copy_used_nodes(mesh, model);
  std::vector<int> element_index(mesh.cells.size(), -1);
  size_t turned = 0;
  for (size_t i = 0; i < mesh.cells.size(); ++i) {
    const MeshCell& cell = mesh.cells[i];
    if (cell.kind != CellKind::tetrahedron) continue;
    Tetrahedron element;
    element.label = cell.label;
    element.material = -1;
    element.num_nodes = cell.num_nodes;
    for (size_t a = 0; a < static_cast<size_t>(cell.num_nodes); ++a)
      element.node_array[a] = node_index[static_cast<size_t>(cell.nodes[a])];
    if (signed_volume(model, element) < 0) {
      turn_around(element);
      ++turned;
    }
    element_index[i] = static_cast<int>(model.elements.size());
    model.elements.push_back(element);
  }
  if (turned > 0)
    model.warnings.push_back(fmt::format("{}: turned {} inverted tetrahedra around", mesh.file, turned));
  for (const auto& [name, members] : mesh.node_sets)
    model.node_sets[name] = kept_members(members, node_index);
  for (const auto& [name, members] : mesh.element_sets)
    model.element_sets[name] = kept_members(members, element_index);
  for (int node = 0; node < model.num_nodes(); ++node)
    model.label_index.emplace_back(model.labels[static_cast<size_t>(node)], node);
  std::sort(model.label_index.begin(), model.label_index.end());
  return model;
}

MeshData mesh_from_model(const Model& model) {
  MeshData mesh;
  mesh.file = model.file;
  mesh.notes = model.warnings;
  mesh.positions = model.positions;
  mesh.node_labels = model.labels;
  mesh.node_sets = model.node_sets;
  mesh.element_sets = model.element_sets;
  for (const Tetrahedron& element : model.elements)
    mesh.cells.push_back({CellKind::tetrahedron, element.label, element.num_nodes, element.node_array, 0});
  return mesh;
}

}  // namespace palpate
