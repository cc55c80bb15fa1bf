// The boundary of the tetrahedra: triangles, the nodes on it, distances along it.
#pragma once

#include <array>
#include <vector>

#include "offline/mesh/model.hpp"

namespace palpate {

struct Surface {
  // Node indices, counter-clockwise seen from outside. A face of six nodes is four triangles.
  std::vector<std::array<int, 3>> triangles;
  std::vector<int> nodes;  // sorted, unique: every node on a triangle
  double mean_edge = 0;    // h: mean length of the distinct edges of faces, corner to corner, length unit
  // Neighbours along edges, in compressed rows over all nodes of the model (empty rows off the surface).
  std::vector<int> neighbour_start;  // num_nodes + 1
  std::vector<int> neighbours;
  std::vector<double> neighbour_distance;  // length of that edge
};

// The faces that belong to exactly one element. Cost: O(elements log elements).
Surface extract_surface(const Model& model);

// The surface nodes within `radius` of `centre`, measured along surface edges (Dijkstra), so that the far
// wall of a fissure is not among them. Sorted; always holds `centre`.
std::vector<int> nodes_within(const Surface& surface, int centre, double radius);

// Area-weighted outward unit normal at each node of the model (zero off the surface).
std::vector<Eigen::Vector3d> outward_normals(const Model& model, const Surface& surface);

}  // namespace palpate
