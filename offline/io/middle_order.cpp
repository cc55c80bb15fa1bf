#include "offline/io/middle_order.hpp"

#include <algorithm>
#include <map>

namespace palpate {
namespace {

constexpr std::size_t kEdges[6][2] = {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}};

using Order = std::array<std::size_t, 6>;  // place in the file of the middle of each edge

// Returns false where two middles are nearest to one edge.
bool find_order(const MeshData& mesh, const MeshCell& cell, Order& order) {
  const auto place = [&](std::size_t i) { return mesh.positions[static_cast<std::size_t>(cell.nodes[i])]; };
  std::array<bool, 6> is_taken = {};
  for (std::size_t middle = 0; middle < 6; ++middle) {
    std::array<double, 6> distance = {};
    for (std::size_t edge = 0; edge < 6; ++edge)
      distance[edge] =
          (0.5 * (place(kEdges[edge][0]) + place(kEdges[edge][1])) - place(4 + middle)).squaredNorm();
    const auto nearest =
        static_cast<std::size_t>(std::min_element(distance.begin(), distance.end()) - distance.begin());
    if (is_taken[nearest]) return false;
    is_taken[nearest] = true;
    order[nearest] = middle;
  }
  return true;
}

}  // namespace

void sort_middles(MeshData& mesh) {
  std::map<Order, std::size_t> counts;
  for (const MeshCell& cell : mesh.cells) {
    Order order = {};
    if (cell.num_nodes == 10 && find_order(mesh, cell, order)) ++counts[order];
  }
  if (counts.empty()) return;
  const Order order = std::max_element(counts.begin(), counts.end(), [](const auto& a, const auto& b) {
                        return a.second < b.second;
                      })->first;
  for (MeshCell& cell : mesh.cells) {
    if (cell.num_nodes != 10) continue;
    const std::array<int, 10> nodes = cell.nodes;
    for (std::size_t edge = 0; edge < 6; ++edge) cell.nodes[4 + edge] = nodes[4 + order[edge]];
  }
}

}  // namespace palpate
