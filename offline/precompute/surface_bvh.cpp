#include "offline/precompute/surface_bvh.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>
#include <tuple>
#include <utility>

namespace palpate {
namespace {

using Eigen::Vector3d;

std::size_t at(int index) {
  return static_cast<std::size_t>(index);
}

// ---- Primitives

// Triangles with sites at all corners, then single sites without such a triangle.
struct Primitives {
  std::vector<std::array<std::uint32_t, 3>> corners;  // sites; a single site is all three corners
  std::vector<int> surface_triangle;                  // in Surface::triangles; -1: a single site
};

Primitives find_primitives(const Model& model, const Surface& surface, const ContactSites& sites) {
  constexpr std::uint32_t kNoSite = 0xffffffff;
  std::vector<std::uint32_t> site_of(model.positions.size(), kNoSite);
  for (std::size_t site = 0; site < sites.sites.size(); ++site)
    site_of[at(sites.sites[site].node)] = static_cast<std::uint32_t>(site);
  Primitives primitives;
  std::vector<char> covered(sites.sites.size(), 0);
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    std::array<std::uint32_t, 3> corners;
    for (std::size_t k = 0; k < 3; ++k) corners[k] = site_of[at(surface.triangles[t][k])];
    if (std::find(corners.begin(), corners.end(), kNoSite) != corners.end()) continue;
    for (const std::uint32_t site : corners) covered[site] = 1;
    primitives.corners.push_back(corners);
    primitives.surface_triangle.push_back(static_cast<int>(t));
  }
  for (std::uint32_t site = 0; site < covered.size(); ++site) {
    if (covered[site]) continue;
    primitives.corners.push_back({site, site, site});
    primitives.surface_triangle.push_back(-1);
  }
  return primitives;
}

// ---- Normals

// A sum of unit normals below this length has no direction: the faces are opposed.
constexpr double kNoDirection = 1e-9;

// Normalises `sum`; falls back to `otherwise`, then to the z axis, as on a surface folded onto itself.
Vector3d direction(const Vector3d& sum, const Vector3d& otherwise) {
  if (sum.norm() > kNoDirection) return sum.normalized();
  if (otherwise.norm() > kNoDirection) return otherwise.normalized();
  return Vector3d::UnitZ();
}

PackedNormal packed(const Vector3d& normal) {
  return {static_cast<float>(normal[0]), static_cast<float>(normal[1]), static_cast<float>(normal[2])};
}

// Baerentzen and Aanaes 2005: the pseudonormal of an edge is the mean of the normals of its faces. The
// pseudonormal of a vertex is the sum of the normals weighted by the angles of the faces.
class Pseudonormals {
 public:
  Pseudonormals(const Model& model, const Surface& surface)
      : triangles_(surface.triangles),
        area_weighted_(outward_normals(model, surface)),
        at_nodes_(model.positions.size(), Vector3d::Zero()) {
    for (std::size_t t = 0; t < triangles_.size(); ++t) {
      std::array<Vector3d, 3> corners;
      for (std::size_t k = 0; k < 3; ++k) corners[k] = model.positions[at(triangles_[t][k])];
      faces_.push_back((corners[1] - corners[0]).cross(corners[2] - corners[0]).stableNormalized());
      for (std::size_t k = 0; k < 3; ++k) {
        const Vector3d next = corners[(k + 1) % 3] - corners[k];
        const Vector3d last = corners[(k + 2) % 3] - corners[k];
        at_nodes_[at(triangles_[t][k])] +=
            std::atan2(next.cross(last).norm(), next.dot(last)) * faces_.back();
        edges_.push_back(edge(t, k));
      }
    }
    std::sort(edges_.begin(), edges_.end());
  }

  Vector3d of_node(int node) const { return direction(at_nodes_[at(node)], area_weighted_[at(node)]); }

  Vector3d of_face(std::size_t t) const {
    const auto [a, b, c] = triangles_[t];
    return direction(faces_[t], of_node(a) + of_node(b) + of_node(c));
  }

  // Returns the pseudonormal of the edge opposite corner k of triangle t.
  Vector3d of_edge(std::size_t t, std::size_t k) const {
    const auto [from, to, self] = edge(t, k);
    Vector3d sum = Vector3d::Zero();
    auto neighbour = std::lower_bound(edges_.begin(), edges_.end(), Edge{from, to, 0});
    for (; neighbour != edges_.end() && std::get<0>(*neighbour) == from && std::get<1>(*neighbour) == to;
         ++neighbour) {
      sum += faces_[std::get<2>(*neighbour)];
    }
    return direction(sum, of_face(self));
  }

 private:
  using Edge = std::tuple<int, int, std::size_t>;  // two nodes, the smaller first; a triangle at the edge

  Edge edge(std::size_t t, std::size_t k) const {
    const auto [from, to] = std::minmax(triangles_[t][(k + 1) % 3], triangles_[t][(k + 2) % 3]);
    return {from, to, t};
  }

  const std::vector<std::array<int, 3>>& triangles_;
  std::vector<Vector3d> faces_;  // unit; zero without an area
  std::vector<Vector3d> area_weighted_;
  std::vector<Vector3d> at_nodes_;  // sums weighted by angles
  std::vector<Edge> edges_;         // sorted: triangles of an edge are adjacent
};

// ---- Tree

// Primitives of a leaf: the size with the fastest searches.
constexpr std::size_t kLeafPrimitives = 2;
static_assert(kLeafPrimitives <= pack::kMostLeafPrimitives);

// These functions round to the next float32 below and above: a box contains its primitives.
float rounded_down(double value) {
  const auto nearest = static_cast<float>(value);
  return static_cast<double>(nearest) > value
             ? std::nextafter(nearest, -std::numeric_limits<float>::infinity())
             : nearest;
}
float rounded_up(double value) {
  return -rounded_down(-value);
}

double half_area(const Eigen::AlignedBox3d& box) {
  const Vector3d size = box.sizes();
  return size[0] * size[1] + size[1] * size[2] + size[2] * size[0];
}

class TreeBuilder {
 public:
  explicit TreeBuilder(const std::vector<Eigen::AlignedBox3d>& boxes) : boxes_(boxes), order_(boxes.size()) {
    std::iota(order_.begin(), order_.end(), std::uint32_t{0});
    add_subtree(0, boxes.size(), 0);
  }

  std::vector<std::uint32_t> take_order() { return std::move(order_); }
  std::vector<pack::BvhNode> take_nodes() { return std::move(nodes_); }

 private:
  // Whether repeated halving reduces `count` primitives at `depth` to leaves within the depth limit.
  static bool fits(std::size_t count, std::uint32_t depth) {
    const std::size_t leaves = (count + kLeafPrimitives - 1) / kLeafPrimitives;
    return depth + static_cast<std::uint32_t>(std::bit_width(leaves - 1)) <= pack::kMostBvhDepth;
  }

  void sort_along(int axis, std::size_t begin, std::size_t end) {
    std::sort(order_.begin() + static_cast<std::ptrdiff_t>(begin),
              order_.begin() + static_cast<std::ptrdiff_t>(end), [&](std::uint32_t i, std::uint32_t j) {
                const double x = boxes_[i].min()[axis] + boxes_[i].max()[axis];
                const double y = boxes_[j].min()[axis] + boxes_[j].max()[axis];
                return x != y ? x < y : i < j;
              });
  }

  // Sorts [begin, end) and returns the start of the right part. Among the splits whose parts both fit, the
  // choice has the least sum of area times primitives. The split in the middle always fits.
  std::size_t split(std::size_t begin, std::size_t end, std::uint32_t depth) {
    const std::size_t count = end - begin;
    // Compare costs, then imbalance: collinear sites have zero costs.
    std::pair<double, std::size_t> least = {std::numeric_limits<double>::infinity(), count};
    std::size_t best = begin + count / 2;
    int best_axis = 0;
    std::vector<double> right_area(count);
    for (int axis = 0; axis < 3; ++axis) {
      sort_along(axis, begin, end);
      Eigen::AlignedBox3d right;
      for (std::size_t i = count; i-- > 1;) {
        right.extend(boxes_[order_[begin + i]]);
        right_area[i] = half_area(right);
      }
      Eigen::AlignedBox3d left;
      for (std::size_t i = 1; i < count; ++i) {
        left.extend(boxes_[order_[begin + i - 1]]);
        const double cost =
            half_area(left) * static_cast<double>(i) + right_area[i] * static_cast<double>(count - i);
        const std::pair candidate = {cost, std::max(i, count - i)};
        if (candidate < least && fits(i, depth + 1) && fits(count - i, depth + 1)) {
          least = candidate;
          best = begin + i;
          best_axis = axis;
        }
      }
    }
    sort_along(best_axis, begin, end);
    return best;
  }

  void add_subtree(std::size_t begin, std::size_t end, std::uint32_t depth) {
    Eigen::AlignedBox3d box;
    for (std::size_t i = begin; i < end; ++i) box.extend(boxes_[order_[i]]);
    pack::BvhNode node = {};
    for (int axis = 0; axis < 3; ++axis) {
      node.min[axis] = rounded_down(box.min()[axis]);
      node.max[axis] = rounded_up(box.max()[axis]);
    }
    const std::size_t index = nodes_.size();
    if (end - begin <= kLeafPrimitives) {
      node.first = static_cast<std::uint32_t>(begin);
      node.count = static_cast<std::uint32_t>(end - begin);
      nodes_.push_back(node);
      return;
    }
    nodes_.push_back(node);
    const std::size_t middle = split(begin, end, depth);
    add_subtree(begin, middle, depth + 1);
    nodes_[index].first = static_cast<std::uint32_t>(nodes_.size());
    add_subtree(middle, end, depth + 1);
  }

  const std::vector<Eigen::AlignedBox3d>& boxes_;
  std::vector<std::uint32_t> order_;
  std::vector<pack::BvhNode> nodes_;
};

}  // namespace

SurfaceBvh build_surface_bvh(const Model& model, const Surface& surface, const ContactSites& sites) {
  const Primitives primitives = find_primitives(model, surface, sites);
  std::vector<Eigen::AlignedBox3d> boxes(primitives.corners.size());
  for (std::size_t p = 0; p < boxes.size(); ++p) {
    for (const std::uint32_t site : primitives.corners[p])
      boxes[p].extend(model.positions[at(sites.sites[site].node)]);
  }
  TreeBuilder tree(boxes);

  SurfaceBvh bvh;
  bvh.nodes = tree.take_nodes();
  const Pseudonormals normals(model, surface);
  for (const ContactSite& site : sites.sites) bvh.site_normals.push_back(packed(normals.of_node(site.node)));
  for (const std::uint32_t p : tree.take_order()) {
    const std::array<std::uint32_t, 3>& corners = primitives.corners[p];
    bvh.primitives.push_back(corners);
    if (primitives.surface_triangle[p] < 0) {
      const PackedNormal& normal = bvh.site_normals[corners[0]];
      bvh.primitive_normals.push_back({normal, normal, normal, normal});
      continue;
    }
    const std::size_t t = at(primitives.surface_triangle[p]);
    bvh.primitive_normals.push_back({packed(normals.of_face(t)), packed(normals.of_edge(t, 0)),
                                     packed(normals.of_edge(t, 1)), packed(normals.of_edge(t, 2))});
  }
  return bvh;
}

}  // namespace palpate
