// A pair of branches of a box tree is decided as a whole where its boxes are far apart, or where both fit
// into `length`. Else the larger branch is split. Points that coincide thus cost one decision in all.
#include "offline/mesh/point_groups.hpp"

#include "offline/mesh/box_tree.hpp"
#include "offline/mesh/disjoint_sets.hpp"

namespace palpate {
namespace {

class Linkage {
 public:
  Linkage(const std::vector<Eigen::Vector3d>& points, double length)
      : tree_(boxes_of(points), 1),
        squared_length_(length * length),
        is_group_(tree_.branches().size(), 0),
        groups_(points.size()) {
    if (!points.empty()) join(0, 0);
  }

  int group(int point) { return groups_.root(point); }

 private:
  static std::vector<Box> boxes_of(const std::vector<Eigen::Vector3d>& points) {
    std::vector<Box> boxes;
    boxes.reserve(points.size());
    for (const Eigen::Vector3d& point : points) boxes.emplace_back(point);
    return boxes;
  }

  const BoxTree::Branch& branch(int index) const { return tree_.branches()[static_cast<std::size_t>(index)]; }
  int first_point(int index) const { return tree_.items()[static_cast<std::size_t>(branch(index).begin)]; }

  // Makes a group of all points of a branch.
  void unite(int index) {
    char& is_group = is_group_[static_cast<std::size_t>(index)];
    if (is_group != 0) return;
    is_group = 1;
    const BoxTree::Branch& whole = branch(index);
    if (whole.left < 0) return;
    unite(whole.left);
    unite(whole.right);
    groups_.unite(first_point(whole.left), first_point(whole.right));
  }

  bool is_one_group(int a, int b) {
    return is_group_[static_cast<std::size_t>(a)] != 0 && is_group_[static_cast<std::size_t>(b)] != 0 &&
           groups_.root(first_point(a)) == groups_.root(first_point(b));
  }

  // Unites all points of two branches that are closer together than the length.
  void join(int a, int b) {
    const BoxTree::Branch& one = branch(a);
    const BoxTree::Branch& other = branch(b);
    if (one.box.squaredExteriorDistance(other.box) >= squared_length_ || is_one_group(a, b)) return;
    if (one.box.merged(other.box).diagonal().squaredNorm() < squared_length_) {
      unite(a);
      unite(b);
      groups_.unite(first_point(a), first_point(b));
      return;
    }
    const bool splits_one = one.left >= 0 && (other.left < 0 || one.box.diagonal().squaredNorm() >=
                                                                    other.box.diagonal().squaredNorm());
    if (a == b && one.left >= 0) {
      join(one.left, one.left);
      join(one.right, one.right);
      join(one.left, one.right);
    } else if (splits_one) {
      join(one.left, b);
      join(one.right, b);
    } else if (other.left >= 0) {
      join(a, other.left);
      join(a, other.right);
    }
  }

  BoxTree tree_;
  double squared_length_;
  std::vector<char> is_group_;  // for each branch: whether all its points are known to be one group
  DisjointSets groups_;
};

}  // namespace

std::vector<int> group_points(const std::vector<Eigen::Vector3d>& points, double length) {
  Linkage linkage(points, length);
  std::vector<int> groups(points.size());
  for (std::size_t i = 0; i < groups.size(); ++i) groups[i] = linkage.group(static_cast<int>(i));
  return groups;
}

}  // namespace palpate
