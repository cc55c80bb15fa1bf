// The boundary of the tetrahedra: triangles, surface nodes, distances along the surface.
#pragma once

#include <array>
#include <vector>

#include "offline/mesh/model.hpp"

namespace palpate {

struct Surface {
  // Node indices, counter-clockwise seen from outside. A six-node face gives four triangles.
  std::vector<std::array<int, 3>> triangles;
  std::vector<int> nodes;  // sorted, unique
  double mean_edge = 0;    // h: mean length of the distinct corner-to-corner edges, length unit
  // Neighbours along edges, in compressed rows over all nodes of the model; rows of inner nodes are empty.
  std::vector<int> neighbour_start;  // num_nodes + 1
  std::vector<int> neighbours;
  std::vector<double> neighbour_distance;  // lengths of the edges to `neighbours`
};

// Collects the faces that belong to exactly one element. Cost: O(elements log elements).
Surface extract_surface(const Model& model);

// Returns the surface nodes within `radius` of `centre` along surface edges (Dijkstra), sorted, including
// `centre`. This distance excludes the opposite wall of a fissure.
std::vector<int> nodes_within(const Surface& surface, int centre, double radius);

// Returns the area-weighted outward unit normal at each node of the model; zero off the surface.
std::vector<Eigen::Vector3d> outward_normals(const Model& model, const Surface& surface);

}  // namespace palpate
