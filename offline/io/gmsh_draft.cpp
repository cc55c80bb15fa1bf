#include "offline/io/gmsh_draft.hpp"

#include <algorithm>
#include <cstdlib>

namespace palpate {
namespace {

void append(const std::vector<int>& from, std::vector<int>& to) {
  to.insert(to.end(), from.begin(), from.end());
}

}  // namespace

void GmshDraft::add_node(int label, const Eigen::Vector3d& position) {
  nodes_.add(label, num_points_++);
  if (!keeps_) return;
  mesh_.node_labels.push_back(label);
  mesh_.positions.push_back(position);
}

void GmshDraft::end_nodes(int line) {
  has_nodes_ = true;
  if (const auto twice = nodes_.sort())
    in_.fail_at(line, "node " + std::to_string(*twice) + " stands twice in the nodes; renumber the nodes");
}

void GmshDraft::end_elements(int line) {
  has_elements_ = true;
  if (const auto twice = cells_.sort())
    in_.fail_at(line,
                "element " + std::to_string(*twice) + " stands twice in the elements; renumber the elements");
}

int GmshDraft::find_node(int label) const {
  const auto found = nodes_.find(label);
  if (!found)
    in_.fail("node " + std::to_string(label) +
             " is not among the nodes; export the file again, with all nodes");
  return *found;
}

int GmshDraft::find_cell(int label) const {
  const auto found = cells_.find(label);
  if (!found)
    in_.fail("element " + std::to_string(label) +
             " is not among the elements; export the file again, with all elements");
  return *found;
}

// Whether the element is the last cell once more, for a further physical group. Formats 1 and 2 have one
// group an element.
bool GmshDraft::repeats_last(const GmshElement& element, const MeshCell& cell) const {
  if (num_cells_ == 0 || element.groups.size() != 1) return false;
  return last_group_ != 0 && element.groups[0] != 0 && element.groups[0] != last_group_ &&
         element.entity == last_entity_ && last_cell_.kind == cell.kind && last_cell_.nodes == cell.nodes;
}

void GmshDraft::add_element(const GmshElement& element) {
  const GmshType& type = *element.type;
  const int rank = dimension(type.kind);
  std::array<int, kMostGmshNodes> nodes = {};
  for (int i = 0; i < type.num_nodes; ++i)
    nodes[static_cast<std::size_t>(i)] = find_node(element.labels[static_cast<std::size_t>(i)]);
  MeshCell cell = {
      .kind = type.kind, .label = element.label, .num_nodes = num_kept_nodes(type), .line = element.line};
  for (int i = 0; i < cell.num_nodes; ++i)
    cell.nodes[static_cast<std::size_t>(i)] = nodes[static_cast<std::size_t>(gmsh_place(type, i))];

  const bool has_group = std::ranges::any_of(element.groups, [](int group) { return group != 0; });
  const bool is_set_point = rank == 0 && has_group;
  const bool repeats = !is_set_point && repeats_last(element, cell);
  if (!is_set_point && !repeats) {
    last_cell_ = cell;
    ++num_cells_;
    if (keeps_) mesh_.cells.push_back(cell);
    if (rank == 3 && cell.num_nodes < type.num_nodes) ++num_truncated_[&type];
  }
  const int index = is_set_point ? -1 : num_cells_ - 1;
  // Gmsh may repeat the number with the element.
  if (!repeats || element.label != last_cell_.label) cells_.add(element.label, index);
  last_entity_ = element.entity;
  last_group_ = element.groups.size() == 1 ? element.groups[0] : 0;
  for (const int number : element.groups) {
    if (number == 0 || !keeps_) continue;
    // A negative number marks a reversed element.
    Group& group = groups_[{rank, std::abs(std::int64_t{number})}];
    if (!is_set_point) group.cells.push_back(index);
    if (rank < 3) group.nodes.insert(group.nodes.end(), nodes.begin(), nodes.begin() + type.num_nodes);
  }
}

void GmshDraft::add_array(bool of_cells, MeshArray array) {
  std::vector<MeshArray>& arrays = of_cells ? mesh_.cell_arrays : mesh_.point_arrays;
  const auto old = std::find_if(arrays.begin(), arrays.end(),
                                [&](const MeshArray& other) { return other.name == array.name; });
  if (old == arrays.end()) {
    arrays.push_back(std::move(array));
  } else {
    *old = std::move(array);
  }
}

std::string GmshDraft::name_of(const GroupKey& key) const {
  const auto found = names_.find(key);
  if (found != names_.end() && !found->second.empty()) return found->second;
  constexpr const char* kKinds[] = {"POINT_", "CURVE_", "SURFACE_", "VOLUME_"};
  return kKinds[key.first] + std::to_string(key.second);
}

MeshData GmshDraft::finish() {
  for (const auto& [key, group] : groups_) {
    const std::string name = name_of(key);
    if (!group.cells.empty()) append(group.cells, mesh_.element_sets[name]);
    if (key.first == 0) append(group.nodes, mesh_.node_sets[name]);
  }
  // A group of points gives the exact nodes, so curves and surfaces of the same name add nothing.
  std::map<std::string, std::vector<int>> of_faces;
  for (const auto& [key, group] : groups_) {
    if (key.first == 0 || key.first == 3) continue;
    const std::string name = name_of(key);
    if (!mesh_.node_sets.contains(name)) append(group.nodes, of_faces[name]);
  }
  mesh_.node_sets.merge(of_faces);
  sort_sets(mesh_.node_sets);
  sort_sets(mesh_.element_sets);
  for (const auto& [type, count] : num_truncated_)
    mesh_.notes.push_back(std::to_string(count) + " " + type->name + " are kept by their corners");
  return std::move(mesh_);
}

}  // namespace palpate
