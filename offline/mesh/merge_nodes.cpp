#include "offline/mesh/merge_nodes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <string>

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

}  // namespace

void replace_nodes(Model& model, const std::vector<int>& first) {
  std::vector<int> index(first.size(), -1);
  int kept = 0;
  for (std::size_t node = 0; node < first.size(); ++node) {
    if (first[node] != static_cast<int>(node)) continue;
    model.positions[slot(kept)] = model.positions[node];
    model.labels[slot(kept)] = model.labels[node];
    index[node] = kept++;
  }
  model.positions.resize(slot(kept));
  model.labels.resize(slot(kept));
  const auto replace = [&](int& node) { node = index[slot(first[slot(node)])]; };
  for (auto& [label, node] : model.label_index) replace(node);
  for (Tetrahedron& element : model.elements) std::ranges::for_each(element.nodes(), replace);
  for (auto& [name, nodes] : model.node_sets) {
    std::ranges::for_each(nodes, replace);
    std::sort(nodes.begin(), nodes.end());
    nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
  }
}

void merge_nodes(Model& model, double length, const ModelOrigin& origin) {
  const std::vector<int> first = first_nodes(model, length);
  check_no_collapse(model, first, length, origin);
  std::map<std::string, std::size_t> sizes;
  for (const auto& [name, nodes] : model.node_sets) sizes[name] = nodes.size();
  replace_nodes(model, first);
  std::string smaller_sets;
  for (const auto& [name, nodes] : model.node_sets) {
    if (nodes.size() < sizes[name]) smaller_sets += (smaller_sets.empty() ? "" : ", ") + printable(name);
  }
  model.merge_length = length;
  const std::size_t merged = first.size() - model.positions.size();
  std::string message = fmt::format("{}: merged {} node{} into others closer than {:g}", model.file, merged,
                                    merged == 1 ? "" : "s", length);
  if (!smaller_sets.empty()) {
    message += fmt::format("; *CLOAD on a set acts once at each merged node, which concerns {}",
                           printable(smaller_sets, 200));
  }
  model.warnings.push_back(std::move(message));
}

}  // namespace palpate
