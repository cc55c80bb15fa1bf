#include "offline/mesh/surface.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <queue>
#include <unordered_map>
#include <utility>

#include "offline/mesh/element_faces.hpp"

namespace palpate {
namespace {

// Relative tolerance of the radius, so that rounding does not exclude a node at exactly the radius.
constexpr double kRadiusTolerance = 1e-9;

std::size_t at(int index) {
  return static_cast<std::size_t>(index);
}

double distance(const Model& model, int a, int b) {
  return (model.positions[at(a)] - model.positions[at(b)]).norm();
}

// Lists distinct edges in both directions, sorted.
std::vector<std::pair<int, int>> directed_edges(const std::vector<std::array<int, 3>>& triangles) {
  std::vector<std::pair<int, int>> edges;
  edges.reserve(6 * triangles.size());
  for (const std::array<int, 3>& triangle : triangles) {
    for (std::size_t i = 0; i < 3; ++i) {
      const int a = triangle[i];
      const int b = triangle[(i + 1) % 3];
      edges.emplace_back(a, b);
      edges.emplace_back(b, a);
    }
  }
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  return edges;
}

}  // namespace

Surface extract_surface(const Model& model) {
  Surface surface;
  const std::vector<ElementFace> faces = sorted_faces(model);
  std::vector<std::array<int, 3>> corner_triangles;
  for (std::size_t i = 0; i < faces.size(); ++i) {
    const bool shared_before = i > 0 && faces[i - 1].sorted == faces[i].sorted;
    const bool shared_after = i + 1 < faces.size() && faces[i + 1].sorted == faces[i].sorted;
    if (shared_before || shared_after) continue;
    const auto& [a, b, c] = faces[i].outward;
    const auto& [ab, bc, ca] = faces[i].middles;
    corner_triangles.push_back(faces[i].outward);
    if (ab < 0) {
      surface.triangles.push_back({a, b, c});
    } else {
      surface.triangles.insert(surface.triangles.end(),
                               {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    }
  }
  const std::vector<std::pair<int, int>> corner_edges = directed_edges(corner_triangles);
  for (const auto& [from, to] : corner_edges)
    surface.mean_edge += distance(model, from, to) / static_cast<double>(corner_edges.size());
  const std::vector<std::pair<int, int>> edges = directed_edges(surface.triangles);
  surface.neighbour_start.assign(model.positions.size() + 1, 0);
  for (const auto& [from, to] : edges) {
    ++surface.neighbour_start[at(from) + 1];
    surface.neighbours.push_back(to);
    surface.neighbour_distance.push_back(distance(model, from, to));
  }
  for (std::size_t node = 0; node < model.positions.size(); ++node) {
    if (surface.neighbour_start[node + 1] > 0) surface.nodes.push_back(static_cast<int>(node));
    surface.neighbour_start[node + 1] += surface.neighbour_start[node];
  }
  return surface;
}

std::vector<int> nodes_within(const Surface& surface, int centre, double radius) {
  const double limit = radius * (1 + kRadiusTolerance);
  std::unordered_map<int, double> shortest = {{centre, 0.0}};
  using Reached = std::pair<double, int>;
  std::priority_queue<Reached, std::vector<Reached>, std::greater<>> queue;
  queue.emplace(0.0, centre);
  while (!queue.empty()) {
    const auto [length, node] = queue.top();
    queue.pop();
    if (length > shortest.at(node)) continue;
    for (int i = surface.neighbour_start[at(node)]; i < surface.neighbour_start[at(node) + 1]; ++i) {
      const double through = length + surface.neighbour_distance[at(i)];
      if (through > limit) continue;
      const auto [known, is_new] = shortest.try_emplace(surface.neighbours[at(i)], through);
      if (!is_new && known->second <= through) continue;
      known->second = through;
      queue.emplace(through, surface.neighbours[at(i)]);
    }
  }
  std::vector<int> nodes;
  nodes.reserve(shortest.size());
  for (const auto& [node, length] : shortest) nodes.push_back(node);
  std::sort(nodes.begin(), nodes.end());
  return nodes;
}

std::vector<Eigen::Vector3d> outward_normals(const Model& model, const Surface& surface) {
  std::vector<Eigen::Vector3d> normals(model.positions.size(), Eigen::Vector3d::Zero());
  for (const std::array<int, 3>& triangle : surface.triangles) {
    const Eigen::Vector3d& origin = model.positions[at(triangle[0])];
    const Eigen::Vector3d a = model.positions[at(triangle[1])] - origin;
    const Eigen::Vector3d b = model.positions[at(triangle[2])] - origin;
    const Eigen::Vector3d twice_area = a.cross(b);
    for (const int node : triangle) normals[at(node)] += twice_area;
  }
  for (Eigen::Vector3d& normal : normals) {
    const double length = normal.norm();
    if (length > 0) normal /= length;
  }
  return normals;
}

}  // namespace palpate
