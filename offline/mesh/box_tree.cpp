#include "offline/mesh/box_tree.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

namespace palpate {

BoxTree::BoxTree(const std::vector<Box>& boxes, int leaf_items) : items_(boxes.size()) {
  std::iota(items_.begin(), items_.end(), 0);
  if (!boxes.empty()) build(boxes, 0, static_cast<int>(boxes.size()), leaf_items);
}

int BoxTree::build(const std::vector<Box>& boxes, int begin, int end, int leaf_items) {
  const auto box_of = [&](int item) -> const Box& { return boxes[static_cast<std::size_t>(item)]; };
  Branch branch;
  branch.begin = begin;
  branch.end = end;
  Box centres;
  for (int i = begin; i < end; ++i) {
    const Box& box = box_of(items_[static_cast<std::size_t>(i)]);
    branch.box.extend(box);
    centres.extend(box.center());
  }
  const int index = static_cast<int>(branches_.size());
  branches_.push_back(branch);
  if (end - begin <= leaf_items) return index;
  Eigen::Index axis = 0;
  centres.sizes().maxCoeff(&axis);
  const auto before = [&](int a, int b) {
    // The corners' sum is twice the centre; the number decides between equal centres.
    return std::pair(box_of(a).min()[axis] + box_of(a).max()[axis], a) <
           std::pair(box_of(b).min()[axis] + box_of(b).max()[axis], b);
  };
  const int middle = begin + (end - begin) / 2;
  std::nth_element(items_.begin() + begin, items_.begin() + middle, items_.begin() + end, before);
  const int left = build(boxes, begin, middle, leaf_items);
  const int right = build(boxes, middle, end, leaf_items);
  branches_[static_cast<std::size_t>(index)].left = left;
  branches_[static_cast<std::size_t>(index)].right = right;
  return index;
}

}  // namespace palpate
