#include "offline/mesh/rigid_motion.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include "offline/mesh/element_faces.hpp"
#include "offline/numerics/decompositions.hpp"

namespace palpate {
namespace {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

// A motion is free below this smallest eigenvalue of the rows' Gram matrix, divided by the number of rows.
// Lengths are relative to the radius of the held nodes. Three nodes within a millionth of a line do not stop
// the rotation about the line; rounding is about 1e-15.
constexpr double kFreeMotion = 1e-12;

int root_of(std::vector<int>& parent, int node) {
  while (parent[static_cast<std::size_t>(node)] != node) {
    int& above = parent[static_cast<std::size_t>(node)];
    above = parent[static_cast<std::size_t>(above)];
    node = above;
  }
  return node;
}

// Describes the free motion: one of the six motions along and about the axes, where one fits.
std::string free_motion(const Matrix6d& gram) {
  const char* names[6] = {"move along x",
                          "move along y",
                          "move along z",
                          "turn about an axis along x",
                          "turn about an axis along y",
                          "turn about an axis along z"};
  const double limit = kFreeMotion;
  if (symmetric_modes(gram).values(0) > limit) return {};
  for (int motion = 0; motion < 6; ++motion) {
    if (gram(motion, motion) <= limit) return names[motion];
  }
  return "move as a whole";
}

std::string free_motion(const Model& model, const std::vector<PrescribedDisplacement>& held) {
  if (held.empty()) return "move along x";
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
  return free_motion(gram / static_cast<double>(held.size()));
}

// Numbers the parts of elements joined face to face, from 0.
std::vector<int> face_joined_parts(const Model& model) {
  std::vector<int> parent(model.elements.size());
  std::iota(parent.begin(), parent.end(), 0);
  const std::vector<ElementFace> faces = sorted_faces(model);
  for (std::size_t i = 1; i < faces.size(); ++i) {
    if (faces[i].sorted != faces[i - 1].sorted) continue;
    parent[static_cast<std::size_t>(root_of(parent, faces[i].element))] =
        root_of(parent, faces[i - 1].element);
  }
  std::vector<int> part(parent.size(), -1);
  int num_parts = 0;
  for (std::size_t element = 0; element < part.size(); ++element) {
    int& number = part[static_cast<std::size_t>(root_of(parent, static_cast<int>(element)))];
    if (number < 0) number = num_parts++;
    part[element] = number;
  }
  return part;
}

}  // namespace

std::vector<int> connected_parts(const Model& model) {
  std::vector<int> parent(model.positions.size());
  std::iota(parent.begin(), parent.end(), 0);
  std::vector<char> used(model.positions.size(), 0);
  for (const Tetrahedron& element : model.elements) {
    const int first = root_of(parent, element.nodes()[0]);
    for (const int node : element.nodes()) {
      used[static_cast<std::size_t>(node)] = 1;
      parent[static_cast<std::size_t>(root_of(parent, node))] = first;
    }
  }
  std::vector<int> part(model.positions.size(), -1);
  std::vector<int> part_of_root(model.positions.size(), -1);
  int num_parts = 0;
  for (std::size_t node = 0; node < part.size(); ++node) {
    if (used[node] == 0) continue;
    int& number = part_of_root[static_cast<std::size_t>(root_of(parent, static_cast<int>(node)))];
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
    const int where = part[static_cast<std::size_t>(dof.node)];
    if (where >= 0) held_in[static_cast<std::size_t>(where)].push_back(dof);
  }
  std::vector<LoosePart> loose;
  for (std::size_t i = 0; i < first_node.size(); ++i) {
    std::string motion = free_motion(model, held_in[i]);
    if (!motion.empty()) loose.push_back({first_node[i], std::move(motion)});
  }
  return loose;
}

std::vector<LoosePart> hinged_parts(const Model& model, const std::vector<PrescribedDisplacement>& held) {
  const std::vector<int> part_of = face_joined_parts(model);
  const int num_parts = part_of.empty() ? 0 : 1 + *std::max_element(part_of.begin(), part_of.end());
  if (num_parts < 2) return {};
  std::vector<std::set<int>> nodes(static_cast<std::size_t>(num_parts));
  for (std::size_t element = 0; element < part_of.size(); ++element) {
    const std::span<const int> own = model.elements[element].nodes();
    nodes[static_cast<std::size_t>(part_of[element])].insert(own.begin(), own.end());
  }
  const auto by_node = [](const PrescribedDisplacement& a, const PrescribedDisplacement& b) {
    return a.node < b.node;
  };
  std::vector<char> stands(nodes.size(), 0);
  std::vector<char> node_stands(model.positions.size(), 0);
  std::vector<LoosePart> hinged;
  for (bool changed = true; changed;) {
    changed = false;
    hinged.clear();
    for (std::size_t part = 0; part < nodes.size(); ++part) {
      if (stands[part]) continue;
      std::vector<PrescribedDisplacement> stopped;
      int free_node = *nodes[part].begin();
      for (const int node : nodes[part]) {
        if (node_stands[static_cast<std::size_t>(node)]) {
          for (int axis = 0; axis < 3; ++axis) stopped.push_back({node, axis, 0});
          continue;
        }
        free_node = node;
        const auto own =
            std::equal_range(held.begin(), held.end(), PrescribedDisplacement{node, 0, 0}, by_node);
        stopped.insert(stopped.end(), own.first, own.second);
      }
      std::string motion = free_motion(model, stopped);
      if (!motion.empty()) {
        hinged.push_back({free_node, std::move(motion)});
        continue;
      }
      stands[part] = 1;
      changed = true;
      for (const int node : nodes[part]) node_stands[static_cast<std::size_t>(node)] = 1;
    }
  }
  return hinged;
}

}  // namespace palpate
