// The checked finite element model: what a model file means, with every name resolved to an index.
//
// A Model is only ever made by a reader (inp_reader.hpp) that has checked it: every node an element names
// exists, every element has a positive volume and a material, every set is known, every free part is held.
// Everything behind the readers may rely on that.
#pragma once

#include <Eigen/Core>
#include <array>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "offline/material/law.hpp"

namespace palpate {

// Where a thing was said, for messages: "liver.inp:214".
struct SourceLine {
  std::string file;
  int line = 0;
};

struct Material {
  std::string name;
  Law law;
};

// A tetrahedron of four nodes (C3D4) or of ten (C3D10: the corners, then the middles of the edges 01 12 02 03
// 13 23). It is upright: (x1-x0) . ((x2-x0) x (x3-x0)) > 0, and so is the map of ten nodes at its integration
// points.
struct Tetrahedron {
  int label = 0;
  int material = 0;  // index in Model::materials
  int num_nodes = 4;
  std::array<int, 10> node_array = {};  // indices in Model::positions, num_nodes of them

  std::span<const int> nodes() const { return {node_array.data(), static_cast<std::size_t>(num_nodes)}; }
  std::span<int> nodes() { return {node_array.data(), static_cast<std::size_t>(num_nodes)}; }
  std::span<const int, 4> corners() const { return std::span<const int, 10>(node_array).first<4>(); }
};

// One degree of freedom held at a value at the end of the step (length unit).
struct PrescribedDisplacement {
  int node = 0;
  int axis = 0;  // 0, 1, 2 = x, y, z
  double value = 0;
};

// A concentrated force at the end of the step (force unit).
struct NodalForce {
  int node = 0;
  int axis = 0;
  double value = 0;
};

// One *STEP. Loads and displacements ramp linearly from the end of the step before to the values here, which
// are the state at its end: what an earlier step prescribed and this one does not mention is carried over
// already.
struct Step {
  int max_increments = 100;      // *STEP, INC=
  double first_increment = 1.0;  // fraction of the step, from the *STATIC data line
  double smallest_increment = 1e-5;
  double largest_increment = 1.0;                  // never below first_increment
  std::vector<PrescribedDisplacement> prescribed;  // sorted by (node, axis), unique; Model::fixed is in it,
                                                   // at zero unless a step moves it
  std::vector<NodalForce> forces;                  // sorted by (node, axis), unique
  SourceLine source;
};

struct Model {
  std::string heading;
  std::string file;
  std::vector<std::string> files;          // every file it was read from: `file` first, then what it includes
  std::vector<int> labels;                 // node label of each node, in the order of the file
  std::vector<Eigen::Vector3d> positions;  // reference configuration, length unit
  std::vector<Tetrahedron> elements;
  std::vector<Material> materials;
  std::map<std::string, std::vector<int>> node_sets;     // upper-case name -> sorted node indices
  std::map<std::string, std::vector<int>> element_sets;  // upper-case name -> sorted element indices
  std::vector<PrescribedDisplacement>
      fixed;  // the homogeneous *BOUNDARY before the first *STEP, sorted by (node, axis)
  std::vector<Step> steps;
  std::vector<std::string> warnings;  // e.g. output requests that were passed over, "file:line: ..."

  int num_nodes() const { return static_cast<int>(positions.size()); }
  int num_dofs() const { return 3 * num_nodes(); }

  // For each degree of freedom (num_dofs) and each node (num_nodes), whether `fixed` holds it, or any of it.
  std::vector<char> fixed_dofs() const;
  std::vector<char> fixed_nodes() const;

  // Index of the node with this label, or -1. Cost: O(log nodes).
  int find_node(int label) const;

  std::vector<std::pair<int, int>> label_index;  // (label, node index), sorted by label; see find_node
};

}  // namespace palpate
