#include "offline/mesh/merge_nodes.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "offline/mesh/input_error.hpp"
#include "offline/mesh/point_groups.hpp"
#include "offline/mesh/text_number.hpp"

namespace palpate {
namespace {

std::size_t slot(int index) {
  return static_cast<std::size_t>(index);
}

// Returns for each node the node that takes its place. Nodes without element stay.
std::vector<int> first_nodes(const Model& model, double length) {
  std::vector<char> is_used(model.positions.size(), 0);
  for (const Tetrahedron& element : model.elements) {
    for (const int node : element.nodes()) is_used[slot(node)] = 1;
  }
  std::vector<int> used;
  std::vector<Eigen::Vector3d> points;
  std::vector<int> first(model.positions.size());
  for (std::size_t node = 0; node < first.size(); ++node) {
    first[node] = static_cast<int>(node);
    if (is_used[node] == 0) continue;
    used.push_back(static_cast<int>(node));
    points.push_back(model.positions[node]);
  }
  const std::vector<int> groups = group_points(points, length);
  for (std::size_t i = 0; i < used.size(); ++i) first[slot(used[i])] = used[slot(groups[i])];
  return first;
}

void check_no_collapse(const Model& model, const std::vector<int>& first, double length,
                       const ModelOrigin& origin) {
  for (std::size_t i = 0; i < model.elements.size(); ++i) {
    const std::span<const int> nodes = model.elements[i].nodes();
    for (std::size_t a = 0; a < nodes.size(); ++a) {
      for (std::size_t b = 0; b < a; ++b) {
        if (first[slot(nodes[a])] != first[slot(nodes[b])] || nodes[a] == nodes[b]) continue;
        const double distance = (model.positions[slot(nodes[a])] - model.positions[slot(nodes[b])]).norm();
        throw InputError(
            origin.files.at(origin.elements[i]),
            fmt::format(
                "element {} collapses where nodes closer than {:g} are merged: its nodes {} and {} are "
                "{:.3g} apart; merge with a shorter length",
                model.elements[i].label, length, model.labels[slot(nodes[b])], model.labels[slot(nodes[a])],
                distance));
      }
    }
  }
}

// Removes the nodes that another takes the place of. Returns the new index of each node.
std::vector<int> renumber(Model& model, const std::vector<int>& first) {
  std::vector<int> index(first.size());
  int kept = 0;
  for (std::size_t node = 0; node < first.size(); ++node) {
    if (first[node] != static_cast<int>(node)) {
      index[node] = index[slot(first[node])];
      continue;
    }
    index[node] = kept;
    model.positions[slot(kept)] = model.positions[node];
    model.labels[slot(kept)] = model.labels[node];
    ++kept;
  }
  model.positions.resize(slot(kept));
  model.labels.resize(slot(kept));
  return index;
}

}  // namespace

void merge_nodes(Model& model, double length, const ModelOrigin& origin) {
  const std::vector<int> first = first_nodes(model, length);
  check_no_collapse(model, first, length, origin);
  const std::size_t before = first.size();
  const std::vector<int> index = renumber(model, first);
  for (auto& [label, node] : model.label_index) node = index[slot(node)];
  for (Tetrahedron& element : model.elements) {
    for (int& node : element.nodes()) node = index[slot(node)];
  }
  std::string smaller_sets;
  for (auto& [name, nodes] : model.node_sets) {
    const std::size_t size = nodes.size();
    for (int& node : nodes) node = index[slot(node)];
    std::sort(nodes.begin(), nodes.end());
    nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
    if (nodes.size() < size) smaller_sets += (smaller_sets.empty() ? "" : ", ") + printable(name);
  }
  model.merge_length = length;
  const std::size_t merged = before - model.positions.size();
  std::string message = fmt::format("{}: merged {} node{} into others closer than {:g}", model.file, merged,
                                    merged == 1 ? "" : "s", length);
  if (!smaller_sets.empty()) {
    message += fmt::format("; *CLOAD on a set acts once at each merged node, which concerns {}",
                           printable(smaller_sets, 200));
  }
  model.warnings.push_back(std::move(message));
}

}  // namespace palpate
