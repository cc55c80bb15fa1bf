// The search compares outer faces with outer faces, their nodes with outer faces, and their nodes and the
// centroids of their elements with all elements. That suffices: the elements of one part fit together, so a
// region that two parts fill has outer faces of one of them as its boundary. Each search ends at its first
// find, and all together end after a number of comparisons that grows with the mesh.
#include "offline/mesh/geometry_check.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "offline/mesh/box_tree.hpp"
#include "offline/mesh/element_faces.hpp"
#include "offline/mesh/flat_triangle.hpp"
#include "offline/mesh/point_groups.hpp"

namespace palpate {
namespace {

// Tolerance as a fraction of the mean edge at a node. The digits of coordinates decide between the bounds:
// two values rounded to float32 differ by up to 2^-23 of the coordinate, in each of three axes.
constexpr double kLeastTolerance = 1e-6;
constexpr double kMostTolerance = 1e-4;
constexpr double kFloatDigits = 0x1p-22;

// Comparisons of each of the three searches for an outer triangle, on average. A sound mesh needs about 20.
constexpr long kComparisons = 100;

// A flat piece of an outer face: the face itself, or one of four pieces of a face with six nodes.
struct Piece {
  std::array<int, 3> nodes = {};
  FaceId face;
};

std::vector<Piece> outer_pieces(const Model& model) {
  std::vector<Piece> pieces;
  const std::vector<ElementFace> faces = sorted_faces(model);
  for (std::size_t i = 0; i < faces.size(); ++i) {
    const bool shared_before = i > 0 && faces[i - 1].sorted == faces[i].sorted;
    const bool shared_after = i + 1 < faces.size() && faces[i + 1].sorted == faces[i].sorted;
    if (shared_before || shared_after) continue;
    const FaceId face = {faces[i].element, faces[i].face};
    const auto& [a, b, c] = faces[i].outward;
    const auto& [ab, bc, ca] = faces[i].middles;
    if (ab < 0) {
      pieces.push_back({{a, b, c}, face});
    } else {
      for (const std::array<int, 3>& nodes :
           {std::array{a, ab, ca}, std::array{ab, b, bc}, std::array{ca, bc, c}, std::array{ab, bc, ca}})
        pieces.push_back({nodes, face});
    }
  }
  std::sort(pieces.begin(), pieces.end(),
            [](const Piece& one, const Piece& other) { return one.face < other.face; });
  return pieces;
}

class UnjoinedSearch {
 public:
  explicit UnjoinedSearch(const Model& model) : model_(model), pieces_(outer_pieces(model)) {
    scale_positions();
    list_elements_of_nodes();
    find_coincident_nodes();
    for (const Piece& piece : pieces_) {
      triangles_.emplace_back(
          std::array{points_[at(piece.nodes[0])], points_[at(piece.nodes[1])], points_[at(piece.nodes[2])]});
      tolerances_of_pieces_.push_back(
          std::min({tolerances_[at(piece.nodes[0])], tolerances_[at(piece.nodes[1])],
                    tolerances_[at(piece.nodes[2])]}));
    }
  }

  UnjoinedGeometry run() {
    search_faces();
    search_nodes();
    search_elements();
    const auto before = [](const OverlappingElement& a, const OverlappingElement& b) {
      return std::pair(a.element, a.other) < std::pair(b.element, b.other);
    };
    const auto alike = [](const OverlappingElement& a, const OverlappingElement& b) {
      return a.element == b.element;
    };
    auto& overlaps = found_.overlaps;
    std::sort(overlaps.begin(), overlaps.end(), before);
    overlaps.erase(std::unique(overlaps.begin(), overlaps.end(), alike), overlaps.end());
    return std::move(found_);
  }

 private:
  static std::size_t at(int index) { return static_cast<std::size_t>(index); }

  // Takes lengths in mean edges and places from the middle of the mesh.
  void scale_positions() {
    Box box;
    std::vector<double> edges(model_.positions.size(), 0);  // at each node: sum, then mean
    std::vector<int> num_elements(model_.positions.size(), 0);
    double mean_edge = 0;
    for (const Tetrahedron& element : model_.elements) {
      double edge = 0;
      for (std::size_t i = 0; i < 4; ++i) {
        const Eigen::Vector3d& corner = model_.positions[at(element.corners()[i])];
        box.extend(corner);
        for (std::size_t j = 0; j < i; ++j)
          edge += (corner - model_.positions[at(element.corners()[j])]).norm() / 6;
      }
      mean_edge += edge / static_cast<double>(model_.elements.size());
      for (const int node : element.nodes()) {
        edges[at(node)] += edge;
        ++num_elements[at(node)];
      }
    }
    edge_ = mean_edge;
    const double digits =
        kFloatDigits * box.min().cwiseAbs().cwiseMax(box.max().cwiseAbs()).maxCoeff() / edge_;
    for (std::size_t node = 0; node < edges.size(); ++node) {
      points_.push_back((model_.positions[node] - box.center()) / edge_);
      const double local = edges[node] / (edge_ * std::max(1, num_elements[node]));
      tolerances_.push_back(std::clamp(digits, kLeastTolerance * local, kMostTolerance * local));
    }
  }

  void list_elements_of_nodes() {
    element_start_.assign(points_.size() + 1, 0);
    for (const Tetrahedron& element : model_.elements) {
      for (const int node : element.nodes()) ++element_start_[at(node) + 1];
    }
    for (std::size_t node = 1; node < element_start_.size(); ++node)
      element_start_[node] += element_start_[node - 1];
    elements_of_nodes_.resize(at(element_start_.back()));
    std::vector<int> next(element_start_.begin(), element_start_.end() - 1);
    for (std::size_t i = 0; i < model_.elements.size(); ++i) {
      for (const int node : model_.elements[i].nodes())
        elements_of_nodes_[at(next[at(node)]++)] = static_cast<int>(i);
    }
  }

  std::span<const int> elements_of(int node) const {
    return std::span(elements_of_nodes_)
        .subspan(at(element_start_[at(node)]), at(element_start_[at(node) + 1] - element_start_[at(node)]));
  }

  bool has(int element, int node) const {
    const std::span<const int> nodes = model_.elements[at(element)].nodes();
    return std::find(nodes.begin(), nodes.end(), node) != nodes.end();
  }

  // Whether an element has all the nodes.
  bool is_shared(std::initializer_list<int> nodes) const {
    const int rarest =
        std::min(nodes, [&](int a, int b) { return elements_of(a).size() < elements_of(b).size(); });
    const std::span<const int> elements = elements_of(rarest);
    return std::any_of(elements.begin(), elements.end(), [&](int element) {
      return std::all_of(nodes.begin(), nodes.end(), [&](int node) { return has(element, node); });
    });
  }

  void find_coincident_nodes() {
    std::vector<int> used;
    std::vector<Eigen::Vector3d> points;
    double length = 0;
    place_.resize(points_.size());
    for (std::size_t node = 0; node < points_.size(); ++node) {
      place_[node] = static_cast<int>(node);
      if (elements_of(static_cast<int>(node)).empty()) continue;
      used.push_back(static_cast<int>(node));
      points.push_back(points_[node]);
      length = std::max(length, tolerances_[node]);
    }
    const std::vector<int> groups = group_points(points, length);
    double farthest = 0;
    for (std::size_t i = 0; i < used.size(); ++i) {
      const int node = used[i];
      const int first = used[at(groups[i])];
      if (node == first) continue;
      // An element with both nodes is a sliver.
      const double distance = (points_[at(node)] - points_[at(first)]).norm();
      if (distance > std::min(tolerances_[at(node)], tolerances_[at(first)]) || is_shared({node, first}))
        continue;
      found_.nodes.push_back({node, first});
      place_[at(node)] = first;
      farthest = std::max(farthest, distance);
    }
    const double least = std::floor(std::log10(kLeastTolerance * edge_));
    const double needed = farthest > 0 ? std::ceil(std::log10(1.1 * farthest * edge_)) : least;
    found_.merge_length = std::pow(10, std::max(least, needed));
  }

  void begin_search() { comparisons_left_ = kComparisons * static_cast<long>(pieces_.size() + 100); }

  // Counts a comparison. Returns false where none is left.
  bool compare() {
    if (comparisons_left_ == 0) found_.is_complete = false;
    return comparisons_left_ > 0 && comparisons_left_-- > 0;
  }

  void search_faces() {
    begin_search();
    std::vector<Box> boxes;
    for (const FlatTriangle& triangle : triangles_) {
      Box& box = boxes.emplace_back(triangle.corners[0]);
      box.extend(triangle.corners[1]);
      box.extend(triangle.corners[2]);
    }
    BoxTree tree(boxes);
    for (std::size_t i = 0; i < pieces_.size(); ++i) {
      const Eigen::Vector3d margin = Eigen::Vector3d::Constant(tolerances_of_pieces_[i]);
      const Box box(boxes[i].min() - margin, boxes[i].max() + margin);
      tree.any(box, [&](int other) {
        if (pieces_[at(other)].face.element == pieces_[i].face.element || !boxes[at(other)].intersects(box))
          return false;
        return !compare() || meets(i, at(other));
      });
    }
    piece_tree_.emplace(std::move(tree));
  }

  void search_nodes() {
    begin_search();
    std::vector<char> is_outer(points_.size(), 0);
    for (const Piece& piece : pieces_) {
      for (const int node : piece.nodes) is_outer[at(node)] = 1;
    }
    for (std::size_t node = 0; node < points_.size(); ++node) {
      if (is_outer[node] == 0) continue;
      outer_nodes_.push_back(static_cast<int>(node));
      const Eigen::Vector3d margin = Eigen::Vector3d::Constant(tolerances_[node]);
      piece_tree_->any(Box(points_[node] - margin, points_[node] + margin),
                       [&](int piece) { return !compare() || hangs(static_cast<int>(node), at(piece)); });
    }
  }

  std::array<int, 3> places(const Piece& piece) const {
    std::array<int, 3> sorted = {place_[at(piece.nodes[0])], place_[at(piece.nodes[1])],
                                 place_[at(piece.nodes[2])]};
    std::sort(sorted.begin(), sorted.end());
    return sorted;
  }

  // Records a piece that lies on another or passes through it. Returns whether it does.
  bool meets(std::size_t i, std::size_t j) {
    const Piece& piece = pieces_[i];
    const Piece& other = pieces_[j];
    const FlatTriangle& triangle = triangles_[i];
    const FlatTriangle& base = triangles_[j];
    const double tolerance = std::min(tolerances_of_pieces_[i], tolerances_of_pieces_[j]);
    const bool coincides = places(piece) == places(other);
    if (coincides || lie_in_plane(triangle, base, tolerance)) {
      // A strip as narrow as the tolerance is no overlap: the faces are neighbours.
      const double least_area = 4 * tolerance * std::min(triangle.longest_edge, base.longest_edge);
      if (!coincides && !(common_area(triangle, base) > least_area)) return false;
      if (triangle.normal.dot(base.normal) > 0) {
        found_.overlaps.push_back({piece.face.element, other.face.element});
      } else if (found_.faces.empty() || found_.faces.back().face != piece.face) {
        found_.faces.push_back({piece.face, other.face, coincides});
      } else {
        found_.faces.back().coincident = found_.faces.back().coincident && coincides;
      }
      return true;
    }
    if (!pierces(triangle, base, tolerance) && !pierces(base, triangle, tolerance)) return false;
    found_.overlaps.push_back({piece.face.element, other.face.element});
    return true;
  }

  // The plane of the wider triangle decides, as rounding turns a narrow triangle.
  static bool lie_in_plane(const FlatTriangle& one, const FlatTriangle& other, double tolerance) {
    constexpr double kParallel = 0.99;  // cosine; only a fast first test
    if (std::abs(one.normal.dot(other.normal)) < kParallel) return false;
    const bool is_one_wider = one.least_altitude > other.least_altitude;
    const FlatTriangle& wide = is_one_wider ? one : other;
    const FlatTriangle& narrow = is_one_wider ? other : one;
    return std::all_of(narrow.corners.begin(), narrow.corners.end(), [&](const Eigen::Vector3d& corner) {
      return std::abs(wide.height(corner)) <= tolerance;
    });
  }

  // Records a node that lies on a piece of another element. Returns whether it does.
  bool hangs(int node, std::size_t i) {
    const Piece& piece = pieces_[i];
    const FlatTriangle& triangle = triangles_[i];
    const double tolerance = std::min(tolerances_[at(node)], tolerances_of_pieces_[i]);
    const Eigen::Vector3d& point = points_[at(node)];
    if (has(piece.face.element, node) || std::abs(triangle.height(point)) > tolerance) return false;
    std::array<int, 3> beside{};  // the nodes of the edge or face that the node lies on
    std::size_t num_beside = 0;
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const double distance = triangle.inside_edge(point, corner);
      if (!(distance >= -tolerance)) return false;
      if (distance > tolerance) beside[num_beside++] = piece.nodes[corner];
    }
    if (num_beside < 2) return false;  // it lies at a corner
    const std::span<const int> nodes = model_.elements[at(piece.face.element)].nodes();
    if (std::any_of(nodes.begin(), nodes.end(),
                    [&](int other) { return place_[at(other)] == place_[at(node)]; }))
      return false;
    // An element with the node and the edge or face is a sliver, which joins them.
    if (num_beside == 2 ? is_shared({node, beside[0], beside[1]})
                        : is_shared({node, beside[0], beside[1], beside[2]}))
      return false;
    found_.hanging.push_back({node, piece.face});
    return true;
  }

  // Finds elements about the corners of the surface and about the centroids of its elements. A centroid may
  // lie on a face of the other element, a corner may not.
  void search_elements() {
    begin_search();
    std::vector<Box> boxes;
    for (const Tetrahedron& element : model_.elements) {
      Box& box = boxes.emplace_back(points_[at(element.corners()[0])]);
      for (const int corner : element.corners()) box.extend(points_[at(corner)]);
    }
    const BoxTree tree(boxes);
    const auto search = [&](const Eigen::Vector3d& point, double margin, int node, int own) {
      tree.any(Box(point), [&](int element) {
        if (element == own || !boxes[at(element)].contains(point)) return false;
        if (!compare()) return true;
        if ((node >= 0 && has(element, node)) || !is_inside(element, point, margin)) return false;
        found_.overlaps.push_back({own, element});
        return true;
      });
    };
    for (const int node : outer_nodes_) {
      const int own = elements_of(node).front();
      const std::span<const int, 4> corners = model_.elements[at(own)].corners();
      if (std::find(corners.begin(), corners.end(), node) == corners.end()) continue;
      search(points_[at(node)], tolerances_[at(node)], node, own);
    }
    constexpr double kRounding = 1e-12;  // mean edges
    for (std::size_t i = 0; i < pieces_.size(); ++i) {
      const int own = pieces_[i].face.element;
      if (i > 0 && pieces_[i - 1].face.element == own) continue;
      Eigen::Vector3d centroid = Eigen::Vector3d::Zero();
      for (const int corner : model_.elements[at(own)].corners()) centroid += points_[at(corner)] / 4;
      search(centroid, -kRounding, -1, own);
    }
  }

  // Whether a point lies in the tetrahedron of an element's corners, by more than a margin.
  bool is_inside(int element, const Eigen::Vector3d& point, double margin) const {
    for (int face = 0; face < 4; ++face) {
      const auto [a, b, c, ab, bc, ca] = outward_face(model_.elements[at(element)], face);
      const Eigen::Vector3d& corner = points_[at(a)];
      const Eigen::Vector3d normal = (points_[at(b)] - corner).cross(points_[at(c)] - corner);
      const double length = normal.norm();
      if (!(length > 0) || normal.dot(point - corner) > -margin * length) return false;
    }
    return true;
  }

  const Model& model_;
  std::vector<Piece> pieces_;            // by element and face
  std::vector<FlatTriangle> triangles_;  // of `pieces_`, in mean edges
  std::vector<double> tolerances_of_pieces_;
  std::vector<Eigen::Vector3d> points_;  // of the nodes, in mean edges from the middle of the mesh
  std::vector<double> tolerances_;       // of the nodes, in mean edges
  double edge_ = 1;                      // mean edge, length unit
  std::vector<int> place_;               // for each node the first node at its place
  std::vector<int> element_start_;       // rows of the nodes in `elements_of_nodes_`
  std::vector<int> elements_of_nodes_;
  std::vector<int> outer_nodes_;
  std::optional<BoxTree> piece_tree_;
  long comparisons_left_ = 0;
  UnjoinedGeometry found_;
};

}  // namespace

UnjoinedGeometry find_unjoined(const Model& model) {
  return UnjoinedSearch(model).run();
}

}  // namespace palpate
