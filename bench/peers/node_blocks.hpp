// A symmetric matrix over nodes of three equations each, stored by rows of 3 x 3 blocks.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "bench/peers/held_contacts.hpp"

namespace palpate::peers {

class NodeBlocks {
 public:
  // Equations must be ordered by node.
  explicit NodeBlocks(const Sparse& matrix) : starts_{0} {
    // block of a column's node in the current row; a lower index than starts_.back() is of an earlier row
    std::vector<int> block_of(static_cast<size_t>(matrix.rows() / 3), -1);
    for (Eigen::Index node = 0; node < matrix.rows() / 3; ++node) {
      for (int axis = 0; axis < 3; ++axis) {
        for (Sparse::InnerIterator it(matrix, 3 * node + axis); it; ++it) {
          int& block = block_of[static_cast<size_t>(it.col() / 3)];
          if (block < starts_.back()) {
            block = static_cast<int>(blocks_.size());
            nodes_.push_back(static_cast<int>(it.col() / 3));
            blocks_.emplace_back(Eigen::Matrix3d::Zero());
          }
          blocks_[static_cast<size_t>(block)](axis, it.col() % 3) = it.value();
        }
      }
      starts_.push_back(static_cast<int>(blocks_.size()));
    }
  }

  int num_nodes() const { return static_cast<int>(starts_.size()) - 1; }
  std::span<const int> neighbours(int node) const {
    return {nodes_.data() + start(node), nodes_.data() + start(node + 1)};
  }
  Eigen::Matrix3d diagonal(int node) const {
    for (size_t block = start(node); block < start(node + 1); ++block) {
      if (nodes_[block] == node) return blocks_[block];
    }
    return Eigen::Matrix3d::Zero();
  }
  // Multiplies the node's three rows by x.
  Eigen::Vector3d times(int node, const Eigen::VectorXd& x) const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (size_t block = start(node); block < start(node + 1); ++block)
      sum += blocks_[block] * x.segment<3>(3 * static_cast<Eigen::Index>(nodes_[block]));
    return sum;
  }

 private:
  size_t start(int node) const { return static_cast<size_t>(starts_[static_cast<size_t>(node)]); }

  std::vector<int> starts_;  // start of each node's row in the two arrays below, and the end
  std::vector<int> nodes_;
  std::vector<Eigen::Matrix3d> blocks_;
};

}  // namespace palpate::peers
