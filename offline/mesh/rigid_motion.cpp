#include "offline/mesh/rigid_motion.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <set>

#include "offline/mesh/disjoint_sets.hpp"
#include "offline/mesh/element_faces.hpp"
#include "offline/numerics/decompositions.hpp"

namespace palpate {
namespace {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

// A motion is free if the smallest eigenvalue of the rows' Gram matrix, divided by the number of rows, is at
// most this. Lengths are relative to the radius of the held nodes. Three nodes within a millionth of a line
// do not stop the rotation about the line; rounding is about 1e-15.
constexpr double kFreeMotion = 1e-12;

// Describes the motions that the rows (rigid_motion.hpp) of Gram matrix `gram` leave free: those along and
// about an axis by name, then others, one for each further eigenvalue of 0. Empty if the rows leave none.
std::vector<std::string> free_motions(Matrix6d gram) {
  const char* names[6] = {"move along x",
                          "move along y",
                          "move along z",
                          "turn about an axis along x",
                          "turn about an axis along y",
                          "turn about an axis along z"};
  std::vector<std::string> motions;
  for (int motion = 0; motion < 6; ++motion) {
    if (gram(motion, motion) > kFreeMotion) continue;
    motions.emplace_back(names[motion]);
    gram(motion, motion) = 1;  // no eigenvalue of 0 any more
  }
  const auto& values = symmetric_modes(gram).values;
  for (int mode = 0; mode < 6 && values(mode) <= kFreeMotion; ++mode) motions.emplace_back("move as a whole");
  return motions;
}

// Describes the rigid motions that the held degrees of freedom leave free; empty if they stop all six.
std::vector<std::string> free_motions(const Model& model, const std::vector<PrescribedDisplacement>& held) {
  if (held.empty()) return free_motions(Matrix6d::Zero());
  const auto position = [&](const PrescribedDisplacement& dof) -> const Eigen::Vector3d& {
    return model.positions[static_cast<std::size_t>(dof.node)];
  };
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  for (const PrescribedDisplacement& dof : held) centre += position(dof);
  centre /= static_cast<double>(held.size());
  double radius = 0;
  for (const PrescribedDisplacement& dof : held) radius = std::max(radius, (position(dof) - centre).norm());
  if (radius == 0) radius = 1;
  Matrix6d gram = Matrix6d::Zero();
  for (const PrescribedDisplacement& dof : held) {
    const Eigen::Vector3d axis = Eigen::Vector3d::Unit(dof.axis);
    Vector6d row;
    // axis . (w x r) = w . (r x axis)
    row << axis, ((position(dof) - centre) / radius).cross(axis);
    gram += row * row.transpose();
  }
  return free_motions(gram / static_cast<double>(held.size()));
}

// Returns the block of each element (hinged_parts()), numbered from 0.
std::vector<int> number_blocks(const Model& model) {
  DisjointSets joined(model.elements.size());
  const std::vector<ElementFace> faces = sorted_faces(model);
  for (std::size_t i = 1; i < faces.size(); ++i) {
    if (faces[i].sorted == faces[i - 1].sorted) joined.unite(faces[i].element, faces[i - 1].element);
  }
  std::vector<int> block_of_root(model.elements.size(), -1);
  std::vector<int> block(model.elements.size());
  int num_blocks = 0;
  for (std::size_t element = 0; element < block.size(); ++element) {
    int& number = block_of_root[static_cast<std::size_t>(joined.root(static_cast<int>(element)))];
    if (number < 0) number = num_blocks++;
    block[element] = number;
  }
  return block;
}

std::vector<std::set<int>> nodes_of_blocks(const Model& model) {
  const std::vector<int> block = number_blocks(model);
  const int num_blocks = block.empty() ? 0 : 1 + *std::max_element(block.begin(), block.end());
  std::vector<std::set<int>> nodes(static_cast<std::size_t>(num_blocks));
  for (std::size_t element = 0; element < block.size(); ++element) {
    const std::span<const int> of_element = model.elements[element].nodes();
    nodes[static_cast<std::size_t>(block[element])].insert(of_element.begin(), of_element.end());
  }
  return nodes;
}

// Appends to `stopped` the entries of `held` at the node. `held` is sorted by node.
void append_held(int node, const std::vector<PrescribedDisplacement>& held,
                 std::vector<PrescribedDisplacement>& stopped) {
  const auto by_node = [](const PrescribedDisplacement& a, const PrescribedDisplacement& b) {
    return a.node < b.node;
  };
  const auto [begin, end] =
      std::equal_range(held.begin(), held.end(), PrescribedDisplacement{node, 0, 0}, by_node);
  stopped.insert(stopped.end(), begin, end);
}

}  // namespace

std::vector<int> connected_parts(const Model& model) {
  DisjointSets joined(model.positions.size());
  std::vector<char> used(model.positions.size(), 0);
  for (const Tetrahedron& element : model.elements) {
    for (const int node : element.nodes()) {
      used[static_cast<std::size_t>(node)] = 1;
      joined.unite(element.nodes()[0], node);
    }
  }
  std::vector<int> part(model.positions.size(), -1);
  std::vector<int> part_of_root(model.positions.size(), -1);
  int num_parts = 0;
  for (std::size_t node = 0; node < part.size(); ++node) {
    if (used[node] == 0) continue;
    int& number = part_of_root[static_cast<std::size_t>(joined.root(static_cast<int>(node)))];
    if (number < 0) number = num_parts++;
    part[node] = number;
  }
  return part;
}

std::vector<LoosePart> loose_parts(const Model& model, const std::vector<PrescribedDisplacement>& held) {
  const std::vector<int> part = connected_parts(model);
  std::vector<int> first_node;
  for (std::size_t node = 0; node < part.size(); ++node) {
    if (part[node] == static_cast<int>(first_node.size())) first_node.push_back(static_cast<int>(node));
  }
  std::vector<std::vector<PrescribedDisplacement>> held_in(first_node.size());
  for (const PrescribedDisplacement& dof : held) {
    const int of_dof = part[static_cast<std::size_t>(dof.node)];
    if (of_dof >= 0) held_in[static_cast<std::size_t>(of_dof)].push_back(dof);
  }
  std::vector<LoosePart> loose;
  for (std::size_t i = 0; i < first_node.size(); ++i) {
    std::vector<std::string> motions = free_motions(model, held_in[i]);
    if (!motions.empty()) loose.push_back({first_node[i], std::move(motions)});
  }
  return loose;
}

// A fixed block stops its nodes, and these nodes may fix a neighbouring block. Passes over the blocks end
// when a pass fixes no more of them.
std::vector<LoosePart> hinged_parts(const Model& model, const std::vector<PrescribedDisplacement>& held) {
  const std::vector<std::set<int>> nodes = nodes_of_blocks(model);
  if (nodes.size() < 2) return {};
  std::vector<char> is_block_fixed(nodes.size(), 0);
  std::vector<char> is_node_fixed(model.positions.size(), 0);
  std::vector<LoosePart> hinged;
  for (bool changed = true; changed;) {
    changed = false;
    hinged.clear();
    for (std::size_t block = 0; block < nodes.size(); ++block) {
      if (is_block_fixed[block]) continue;
      std::vector<PrescribedDisplacement> stopped;
      int free_node = *nodes[block].begin();
      for (const int node : nodes[block]) {
        if (is_node_fixed[static_cast<std::size_t>(node)]) {
          for (int axis = 0; axis < 3; ++axis) stopped.push_back({node, axis, 0});
        } else {
          free_node = node;
          append_held(node, held, stopped);
        }
      }
      std::vector<std::string> motions = free_motions(model, stopped);
      if (!motions.empty()) {
        hinged.push_back({free_node, std::move(motions)});
        continue;
      }
      is_block_fixed[block] = 1;
      changed = true;
      for (const int node : nodes[block]) is_node_fixed[static_cast<std::size_t>(node)] = 1;
    }
  }
  return hinged;
}

}  // namespace palpate
