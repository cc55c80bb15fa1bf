// The size of an organ beside its unit, tip and reach, with warnings of a mistaken unit or radius.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "offline/precompute/scene.hpp"

namespace palpate {

// Returns the extents of the elements' nodes along x, y and z: length unit.
Eigen::Vector3d organ_size(const Model& model);

// Says the size and the reach: "organ 160 x 140 x 120 mm; |d| to 8.24 mm: 1.00 h, 5 % of it".
std::string size_text(const Scene& scene, const Model& model, double mean_surface_edge);

// Returns a warning each, "SCENE.toml: ...; REMEDY", where:
//   1. the organ is shorter than 1 mm or longer than 2 m in the unit of the scene,
//   2. max_displacement is above the organ's size.
std::vector<std::string> size_warnings(const Scene& scene, const Model& model, double mean_surface_edge);

// Whether a tip holds hardly more than a node: forces then depend on the mesh and not on the organ alone. Any
// one unit of length.
inline bool is_tip_below_edge(double tip_radius, double mean_surface_edge) {
  return tip_radius < mean_surface_edge;
}

// Says so: "the tip (tip_radius = 0.3 mm) is smaller than an edge ...". `unit`: " mm", or empty.
std::string tip_text(double tip_radius, double mean_surface_edge, const std::string& unit);

}  // namespace palpate
