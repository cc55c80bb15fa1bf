#include "offline/precompute/organ_tree.hpp"

#include <Eigen/SparseCore>
#include <algorithm>
#include <numeric>

#include "offline/fem/cholesky.hpp"

namespace palpate {
namespace {

// Groups the elements whose stiffness couples their nodes: one element, or all elements of a volume patch.
std::vector<std::vector<int>> coupled_groups(const Model& model) {
  std::vector<std::vector<int>> groups;
  std::vector<int> group_of_patch;
  for (int e = 0; e < static_cast<int>(model.elements.size()); ++e) {
    const int patch = model.elements[static_cast<size_t>(e)].volume_patch;
    if (patch >= 0) {
      if (group_of_patch.size() <= static_cast<size_t>(patch))
        group_of_patch.resize(static_cast<size_t>(patch) + 1, -1);
      int& group = group_of_patch[static_cast<size_t>(patch)];
      if (group >= 0) {
        groups[static_cast<size_t>(group)].push_back(e);
        continue;
      }
      group = static_cast<int>(groups.size());
    }
    groups.push_back({e});
  }
  return groups;
}

// Lists contact nodes, then other free nodes, then fixed nodes.
void list_nodes(const Model& model, const ContactSites& sites, OrganTree& tree) {
  const std::vector<char> fixed = model.fixed_dofs();
  std::vector<char> has_element(static_cast<size_t>(model.num_nodes()), 0);
  for (const Tetrahedron& element : model.elements) {
    for (const int node : element.nodes()) has_element[static_cast<size_t>(node)] = 1;
  }
  std::vector<char> is_listed(static_cast<size_t>(model.num_nodes()), 0);
  const auto list = [&](int node) {
    tree.nodes.push_back(node);
    is_listed[static_cast<size_t>(node)] = 1;
  };
  for (size_t i = 0; i < sites.contact_nodes.size(); ++i) list(sites.model_node(static_cast<int>(i)));
  for (const bool is_free : {true, false}) {
    for (int node = 0; node < model.num_nodes(); ++node) {
      const auto at = static_cast<size_t>(node);
      const bool all_fixed = fixed[3 * at] != 0 && fixed[3 * at + 1] != 0 && fixed[3 * at + 2] != 0;
      if (is_listed[at] == 0 && has_element[at] != 0 && all_fixed != is_free) list(node);
    }
    if (is_free) tree.num_free = static_cast<int>(tree.nodes.size());
  }
}

// Returns the graph of free nodes that share a group, as a lower triangle.
SparseLower graph_of(const Model& model, const std::vector<std::vector<int>>& groups,
                     const std::vector<int>& index_of, int num_free) {
  std::vector<std::vector<int>> neighbours(static_cast<size_t>(num_free));
  for (const std::vector<int>& group : groups) {
    std::vector<int> nodes;
    for (const int e : group) {
      for (const int node : model.elements[static_cast<size_t>(e)].nodes()) {
        if (const int index = index_of[static_cast<size_t>(node)]; index < num_free) nodes.push_back(index);
      }
    }
    std::ranges::sort(nodes);
    nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
    for (size_t i = 0; i < nodes.size(); ++i)
      neighbours[static_cast<size_t>(nodes[i])].insert(neighbours[static_cast<size_t>(nodes[i])].end(),
                                                       nodes.begin() + static_cast<ptrdiff_t>(i),
                                                       nodes.end());
  }
  SparseLower graph(num_free, num_free);
  for (int column = 0; column < num_free; ++column) {
    std::vector<int>& rows = neighbours[static_cast<size_t>(column)];
    std::ranges::sort(rows);
    rows.erase(std::unique(rows.begin(), rows.end()), rows.end());
    graph.startVec(column);
    for (const int row : rows) graph.insertBack(row, column) = 1.0;
  }
  graph.finalize();
  return graph;
}

// Copies the fronts from the roots down: rows below the columns of a front are rows of its parent.
void copy_fronts(const FrontTree& analysed, OrganTree& tree) {
  std::vector<std::vector<int>> rows(static_cast<size_t>(analysed.size()));
  for (int f = analysed.size() - 1; f >= 0; --f) {
    const Front& front = analysed[f];
    std::vector<int>& front_rows = rows[static_cast<size_t>(f)];
    for (int column = 0; column < front.num_columns; ++column)
      front_rows.push_back(front.first_column + column);
    if (front.parent < 0) continue;
    const std::vector<int>& parent_rows = rows[static_cast<size_t>(front.parent)];
    for (const FrontTree::Run& run : analysed.runs_in_parent(f)) {
      for (int i = 0; i < run.length; ++i)
        front_rows.push_back(parent_rows[static_cast<size_t>(run.place + i)]);
    }
  }
  for (int f = 0; f < analysed.size(); ++f) {
    const Front& front = analysed[f];
    pack::Front entry = {};
    entry.first_column = static_cast<std::uint32_t>(front.first_column);
    entry.num_columns = static_cast<std::uint32_t>(front.num_columns);
    entry.first_row = static_cast<std::uint32_t>(tree.rows.size());
    entry.num_rows =
        static_cast<std::uint32_t>(front.num_below());  // without the columns, unlike Front::num_rows
    entry.num_within = static_cast<std::uint32_t>(f - front.first_within + 1);
    entry.parent = front.parent < 0 ? pack::kNoFront : static_cast<std::uint32_t>(front.parent);
    const std::vector<int>& all = rows[static_cast<size_t>(f)];
    tree.rows.insert(tree.rows.end(), all.begin() + front.num_columns, all.end());
    tree.fronts.push_back(entry);
  }
  for (const int index : analysed.permutation()) tree.order.push_back(static_cast<std::uint32_t>(index));
}

// Sorts groups by the front that eliminates the first of their nodes. Groups without free nodes join front 0.
void list_elements(const Model& model, const std::vector<std::vector<int>>& groups,
                   const std::vector<int>& index_of, OrganTree& tree) {
  std::vector<size_t> front_of(tree.order.size());  // by index in tree.nodes
  for (size_t f = 0; f < tree.fronts.size(); ++f) {
    for (std::uint32_t c = 0; c < tree.fronts[f].num_columns; ++c)
      front_of[tree.order[tree.fronts[f].first_column + c]] = f;
  }
  std::vector<size_t> front_of_group;
  for (const std::vector<int>& group : groups) {
    size_t first = tree.fronts.size();
    for (const int e : group) {
      for (const int node : model.elements[static_cast<size_t>(e)].nodes()) {
        if (const int index = index_of[static_cast<size_t>(node)]; index < tree.num_free)
          first = std::min(first, front_of[static_cast<size_t>(index)]);
      }
    }
    front_of_group.push_back(first == tree.fronts.size() ? 0 : first);
  }
  std::vector<size_t> order(groups.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::ranges::stable_sort(order, {}, [&](size_t group) { return front_of_group[group]; });
  std::uint32_t num_patches = 0;
  for (const size_t group : order) {
    const bool shares = model.elements[static_cast<size_t>(groups[group].front())].volume_patch >= 0;
    const std::uint32_t patch = shares ? num_patches++ : pack::kNoPatch;
    for (const int e : groups[group]) {
      tree.elements.push_back(e);
      tree.volume_patches.push_back(patch);
    }
    tree.fronts[front_of_group[group]].num_elements += static_cast<std::uint32_t>(groups[group].size());
  }
  std::uint32_t first = 0;
  for (pack::Front& front : tree.fronts) {
    front.first_element = first;
    first += front.num_elements;
  }
}

}  // namespace

OrganTree make_organ_tree(const Model& model, const ContactSites& sites) {
  OrganTree tree;
  list_nodes(model, sites, tree);
  std::vector<int> index_of(static_cast<size_t>(model.num_nodes()), 0);
  for (size_t i = 0; i < tree.nodes.size(); ++i)
    index_of[static_cast<size_t>(tree.nodes[i])] = static_cast<int>(i);
  const std::vector<std::vector<int>> groups = coupled_groups(model);
  const CholeskyAnalysis analysis(graph_of(model, groups, index_of, tree.num_free));
  copy_fronts(*analysis.fronts(), tree);
  list_elements(model, groups, index_of, tree);
  return tree;
}

double organ_bytes(const Model& model) {
  constexpr double kRowsOfNode = 8;  // generous: entries of OrganTree::rows for each node
  double corners = 0;
  for (const Tetrahedron& element : model.elements) corners += element.num_nodes;
  return sizeof(pack::OrganElement) * static_cast<double>(model.elements.size()) +
         sizeof(std::uint32_t) * corners +
         (sizeof(pack::OrganNode) + sizeof(pack::Front) + sizeof(std::uint32_t) * (1 + kRowsOfNode)) *
             static_cast<double>(model.num_nodes());
}

}  // namespace palpate
