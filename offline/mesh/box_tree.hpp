// A binary tree of boxes, which finds the items near a place without a look at all of them.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <vector>

namespace palpate {

using Box = Eigen::AlignedBox3d;

class BoxTree {
 public:
  // A part of the items; the children halve it.
  struct Branch {
    Box box;
    int begin = 0;  // in items()
    int end = 0;
    int left = -1;  // index of a branch, or -1 in a leaf
    int right = -1;
  };

  // Branches with at most `leaf_items` items are leaves. Cost: O(n log n), also where all boxes are equal.
  explicit BoxTree(const std::vector<Box>& boxes, int leaf_items = 4);

  const std::vector<Branch>& branches() const { return branches_; }  // the root first; empty without boxes
  const std::vector<int>& items() const { return items_; }

  // Calls `visit` for each item of every leaf that meets `box`, until it returns true. Returns whether it
  // did.
  template <typename Visit>
  bool any(const Box& box, Visit&& visit) const {
    if (branches_.empty()) return false;
    std::array<int, 64> open{};  // halving keeps the depth below 32
    std::size_t num_open = 1;
    while (num_open > 0) {
      const Branch& branch = branches_[static_cast<std::size_t>(open[--num_open])];
      if (!branch.box.intersects(box)) continue;
      if (branch.left >= 0) {
        open[num_open++] = branch.right;
        open[num_open++] = branch.left;
        continue;
      }
      for (int i = branch.begin; i < branch.end; ++i) {
        if (visit(items_[static_cast<std::size_t>(i)])) return true;
      }
    }
    return false;
  }

 private:
  int build(const std::vector<Box>& boxes, int begin, int end, int leaf_items);

  std::vector<Branch> branches_;
  std::vector<int> items_;
};

}  // namespace palpate
