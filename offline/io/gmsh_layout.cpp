#include "offline/io/gmsh_layout.hpp"

#include <algorithm>
#include <climits>

#include "offline/io/reference_sets.hpp"

namespace palpate {
namespace {

// Returns the labels, or numbers from 1 where labels are below 1, not unique or too large for `num_more` of
// them.
std::vector<int> valid_labels(std::vector<int> labels, std::size_t num_more) {
  std::vector<int> sorted = labels;
  std::sort(sorted.begin(), sorted.end());
  const bool are_valid =
      sorted.empty() ||
      (sorted.front() > 0 && std::adjacent_find(sorted.begin(), sorted.end()) == sorted.end() &&
       num_more <= static_cast<std::size_t>(INT_MAX - sorted.back()));
  if (!are_valid) {
    for (std::size_t i = 0; i < labels.size(); ++i) labels[i] = static_cast<int>(i) + 1;
  }
  return labels;
}

// Whether reading the element set gives this node set: the nodes of its curves and surfaces.
bool follows_from_cells(const MeshData& mesh, const std::string& name, const std::vector<int>& nodes) {
  const auto set = mesh.element_sets.find(name);
  if (set == mesh.element_sets.end()) return false;
  std::vector<int> of_cells;
  for (const int index : set->second) {
    const MeshCell& cell = mesh.cells[static_cast<std::size_t>(index)];
    if (dimension(cell.kind) == 0) return false;
    if (dimension(cell.kind) == 3) continue;
    of_cells.insert(of_cells.end(), cell.nodes.begin(), cell.nodes.begin() + cell.num_nodes);
  }
  std::sort(of_cells.begin(), of_cells.end());
  of_cells.erase(std::unique(of_cells.begin(), of_cells.end()), of_cells.end());
  return of_cells == nodes;
}

class LayoutMaker {
 public:
  explicit LayoutMaker(const MeshData& mesh) : mesh_(mesh) {}

  GmshLayout make() {
    std::vector<int> labels;
    for (const MeshCell& cell : mesh_.cells) labels.push_back(cell.label);
    // Point elements, and in formats 1 and 2 a further element for each further set, take labels of their
    // own.
    std::size_t num_more = 0;
    for (const auto& [name, set] : mesh_.element_sets) num_more += set.size();
    for (const auto& [name, set] : mesh_.node_sets) num_more += set.size();
    labels = valid_labels(std::move(labels), num_more);
    layout_.node_labels = valid_labels(mesh_.node_labels, 0);
    for (const int label : labels) layout_.largest_label = std::max(layout_.largest_label, label);
    add_cells(labels);
    add_points();
    return std::move(layout_);
  }

 private:
  void add_cells(const std::vector<int>& labels) {
    const SetCombinations sets = combine_sets(mesh_.element_sets, mesh_.cells.size());
    for (std::size_t i = 0; i < mesh_.cells.size(); ++i) {
      const MeshCell& cell = mesh_.cells[i];
      const int combination = sets.of_item[i];
      const int entity = entity_of(dimension(cell.kind), combination,
                                   sets.names[static_cast<std::size_t>(combination)], cell.nodes[0]);
      layout_.rows.push_back({labels[i], &gmsh_type(cell), entity, static_cast<int>(i), -1});
    }
  }

  void add_points() {
    std::map<std::string, std::vector<int>> written;
    for (const auto& [name, nodes] : mesh_.node_sets) {
      if (!follows_from_cells(mesh_, name, nodes)) written[name] = nodes;
    }
    entities_.clear();  // the numbers of combinations below are of nodes
    const SetCombinations sets = combine_sets(written, mesh_.positions.size());
    for (std::size_t node = 0; node < mesh_.positions.size(); ++node) {
      const int combination = sets.of_item[node];
      if (combination == 0) continue;
      const int index = static_cast<int>(node);
      const int entity = entity_of(0, combination, sets.names[static_cast<std::size_t>(combination)], index);
      layout_.rows.push_back({++layout_.largest_label, find_gmsh_type(15), entity, -1, index});
    }
  }

  int entity_of(int rank, int combination, const std::vector<std::string>& names, int node) {
    const auto place = static_cast<std::size_t>(rank);
    std::vector<GmshEntity>& entities = layout_.entities[place];
    const auto [at, is_new] =
        entities_.try_emplace({rank, combination}, static_cast<int>(entities.size()) + 1);
    if (!is_new) return at->second;
    GmshEntity entity;
    entity.node = node;
    std::map<std::string, int>& groups = layout_.groups[place];
    for (const std::string& name : names)
      entity.groups.push_back(groups.try_emplace(name, static_cast<int>(groups.size()) + 1).first->second);
    entities.push_back(std::move(entity));
    return at->second;
  }

  const MeshData& mesh_;
  GmshLayout layout_;
  std::map<std::pair<int, int>, int> entities_;  // (dimension, combination of sets) -> number
};

}  // namespace

GmshLayout lay_out(const MeshData& mesh) {
  return LayoutMaker(mesh).make();
}

}  // namespace palpate
