// Blocks of irregular tetrahedra as models in memory, without the .inp reader.
#pragma once

#include <Eigen/Core>
#include <Eigen/LU>
#include <array>
#include <cmath>
#include <map>
#include <random>
#include <stdexcept>
#include <utility>
#include <vector>

#include "offline/mesh/model.hpp"
#include "offline/mesh/tetrahedron_shape.hpp"

namespace palpate::test {

// Uniform in (-1, 1), with the same sequence on every platform.
class TestRandom {
 public:
  explicit TestRandom(unsigned seed) : engine_(seed) {}
  double operator()() { return 2.0 * (static_cast<double>(engine_()) + 0.5) / 4294967296.0 - 1.0; }
  Eigen::Vector3d vector() {
    const double x = (*this)();
    const double y = (*this)();
    return {x, y, (*this)()};
  }
  Eigen::VectorXd vector(Eigen::Index size) {
    Eigen::VectorXd values(size);
    for (double& value : values) value = (*this)();
    return values;
  }
  Eigen::MatrixXd matrix(Eigen::Index rows, Eigen::Index columns) {
    Eigen::MatrixXd values(rows, columns);
    for (double& value : values.reshaped()) value = (*this)();
    return values;
  }

 private:
  std::mt19937 engine_;
};

struct BlockShape {
  std::array<int, 3> cells = {3, 3, 3};
  Eigen::Vector3d size = {1.0, 1.0, 1.0};
  // Interior nodes move by up to this fraction of a cell along each axis. 0.15 keeps det F > 0 in every
  // element.
  double jitter = 0.15;
  unsigned seed = 1;
  Law law = CompressibleNeoHookean{0.48, 0.2};
};

// A block with a corner at the origin. Each cell is cut into six tetrahedra around a diagonal; nothing is
// fixed. Nodes run fastest along x; labels are index + 1. Interior coordinates are multiples of 2^-20 of the
// size, so that a shift by a power of two may be exact.
inline Model tetrahedral_block(const BlockShape& shape) {
  const auto [nx, ny, nz] = shape.cells;
  Model model;
  model.file = "block";
  model.materials.push_back({"TISSUE", shape.law});
  TestRandom random(shape.seed);
  const auto node_at = [nx = nx, ny = ny](int i, int j, int k) { return i + (nx + 1) * (j + (ny + 1) * k); };
  for (int k = 0; k <= nz; ++k) {
    for (int j = 0; j <= ny; ++j) {
      for (int i = 0; i <= nx; ++i) {
        Eigen::Vector3d cell(i, j, k);
        if (i > 0 && i < nx && j > 0 && j < ny && k > 0 && k < nz) cell += shape.jitter * random.vector();
        const Eigen::Vector3d part = cell.cwiseQuotient(Eigen::Vector3d(nx, ny, nz));
        model.positions.push_back((part * 0x1.0p20).array().round().matrix().cwiseProduct(shape.size) *
                                  0x1.0p-20);
        model.labels.push_back(node_at(i, j, k) + 1);
        model.label_index.emplace_back(node_at(i, j, k) + 1, node_at(i, j, k));
      }
    }
  }
  constexpr std::array<std::array<int, 4>, 6> kAroundDiagonal = {
      {{0, 1, 3, 7}, {0, 3, 2, 7}, {0, 2, 6, 7}, {0, 6, 4, 7}, {0, 4, 5, 7}, {0, 5, 1, 7}}};
  for (int k = 0; k < nz; ++k) {
    for (int j = 0; j < ny; ++j) {
      for (int i = 0; i < nx; ++i) {
        for (const std::array<int, 4>& corners : kAroundDiagonal) {
          Tetrahedron element;
          element.label = static_cast<int>(model.elements.size()) + 1;
          for (std::size_t a = 0; a < 4; ++a) {
            element.node_array[a] =
                node_at(i + (corners[a] & 1), j + ((corners[a] >> 1) & 1), k + (corners[a] >> 2));
          }
          Eigen::Matrix3d edges;
          for (int a = 0; a < 3; ++a) {
            edges.col(a) = model.positions[static_cast<std::size_t>(
                               element.node_array[static_cast<std::size_t>(a) + 1])] -
                           model.positions[static_cast<std::size_t>(element.node_array[0])];
          }
          if (!(edges.determinant() > 0)) throw std::logic_error("the jitter turned an element inside out");
          model.elements.push_back(element);
        }
      }
    }
  }
  return model;
}

// The same body with ten-node elements: a new node in the middle of every edge, moved by up to `jitter` along
// each axis. Node sets and boundary conditions stay as they are.
inline Model with_middle_nodes(Model model, double jitter = 0.0) {
  std::map<std::pair<int, int>, int> middle;
  TestRandom random(21);
  for (Tetrahedron& element : model.elements) {
    for (std::size_t edge = 0; edge < kTetrahedronEdges.size(); ++edge) {
      const int a = element.node_array[static_cast<std::size_t>(kTetrahedronEdges[edge][0])];
      const int b = element.node_array[static_cast<std::size_t>(kTetrahedronEdges[edge][1])];
      const auto [found, is_new] = middle.try_emplace(std::minmax(a, b), model.num_nodes());
      if (is_new) {
        const Eigen::Vector3d centre = 0.5 * (model.positions[static_cast<std::size_t>(a)] +
                                              model.positions[static_cast<std::size_t>(b)]);
        model.labels.push_back(model.labels.back() + 1);
        model.label_index.emplace_back(model.labels.back(), model.num_nodes());
        model.positions.push_back(centre + jitter * random.vector());
      }
      element.node_array[4 + edge] = found->second;
    }
    element.num_nodes = 10;
  }
  return model;
}

// Nodes with `value` as reference coordinate along `axis`, to rounding.
inline std::vector<int> nodes_on_plane(const Model& model, int axis, double value) {
  std::vector<int> nodes;
  for (int node = 0; node < model.num_nodes(); ++node) {
    if (std::abs(model.positions[static_cast<std::size_t>(node)][axis] - value) <= 1e-9 * std::abs(value))
      nodes.push_back(node);
  }
  return nodes;
}

// Fixes all nodes with z = 0.
inline Model with_fixed_base(Model model) {
  for (const int node : nodes_on_plane(model, 2, 0.0)) {
    for (int axis = 0; axis < 3; ++axis) model.fixed.push_back({node, axis, 0.0});
  }
  return model;
}

inline std::vector<char> no_dofs(const Model& model) {
  return std::vector<char>(static_cast<std::size_t>(model.num_dofs()), 0);
}

// u = (F - 1) X at every node.
inline Eigen::VectorXd affine_displacement(const Model& model, const Eigen::Matrix3d& deformation_gradient) {
  Eigen::VectorXd displacement(model.num_dofs());
  for (int node = 0; node < model.num_nodes(); ++node) {
    const Eigen::Vector3d& position = model.positions[static_cast<std::size_t>(node)];
    displacement.segment<3>(3 * node) = deformation_gradient * position - position;
  }
  return displacement;
}

// A rotation that leaves no axis alone, by Rodrigues' formula.
inline Eigen::Matrix3d rotation_about(const Eigen::Vector3d& axis, double angle) {
  const Eigen::Vector3d n = axis.normalized();
  Eigen::Matrix3d cross;
  cross << 0, -n.z(), n.y(), n.z(), 0, -n.x(), -n.y(), n.x(), 0;
  return Eigen::Matrix3d::Identity() + std::sin(angle) * cross + (1 - std::cos(angle)) * cross * cross;
}

}  // namespace palpate::test
