// Disjoint sets of the numbers 0 .. n - 1: nodes or elements that belong together.
#pragma once

#include <algorithm>
#include <numeric>
#include <vector>

namespace palpate {

class DisjointSets {
 public:
  explicit DisjointSets(std::size_t size) : parent_(size) { std::iota(parent_.begin(), parent_.end(), 0); }

  // Returns the smallest number of the set, and shortens the path to it.
  int root(int item) {
    while (parent(item) != item) {
      parent(item) = parent(parent(item));
      item = parent(item);
    }
    return item;
  }

  void unite(int a, int b) {
    const auto [low, high] = std::minmax({root(a), root(b)});
    parent(high) = low;
  }

 private:
  int& parent(int item) { return parent_[static_cast<std::size_t>(item)]; }

  std::vector<int> parent_;
};

}  // namespace palpate
