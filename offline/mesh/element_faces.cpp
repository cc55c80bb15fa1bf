#include "offline/mesh/element_faces.hpp"

#include <algorithm>
#include <tuple>

#include "offline/mesh/tetrahedron_shape.hpp"

namespace palpate {
namespace {

// Corners counter-clockwise seen from outside. Abaqus' faces are 123, 142, 243, 341, counted from 1.
constexpr std::array<std::array<std::size_t, 3>, 4> kOutwardFaces = {
    {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}}};

// Returns the local number of the node between two corners of a ten-node element.
std::size_t middle_of(std::size_t a, std::size_t b) {
  std::size_t edge = 0;
  while (static_cast<std::size_t>(kTetrahedronEdges[edge][0]) != std::min(a, b) ||
         static_cast<std::size_t>(kTetrahedronEdges[edge][1]) != std::max(a, b)) {
    ++edge;
  }
  return 4 + edge;
}

bool is_even(const std::array<int, 3>& nodes) {  // as a permutation of their ascending order
  const int inversions = (nodes[0] > nodes[1]) + (nodes[0] > nodes[2]) + (nodes[1] > nodes[2]);
  return inversions % 2 == 0;
}

}  // namespace

std::array<int, 6> outward_face(const Tetrahedron& element, int face) {
  const std::span<const int> nodes = element.nodes();
  const std::array<std::size_t, 3>& corners = kOutwardFaces[static_cast<std::size_t>(face)];
  std::array<int, 6> found = {nodes[corners[0]], nodes[corners[1]], nodes[corners[2]], -1, -1, -1};
  if (nodes.size() == 10) {
    for (std::size_t i = 0; i < 3; ++i) found[3 + i] = nodes[middle_of(corners[i], corners[(i + 1) % 3])];
  }
  return found;
}

std::vector<ElementFace> sorted_faces(const Model& model) {
  // A counting sort by the smallest node leaves short runs for the final sort.
  std::vector<std::size_t> start(model.positions.size() + 1, 0);
  std::vector<ElementFace> unsorted;
  unsorted.reserve(4 * model.elements.size());
  for (std::size_t element = 0; element < model.elements.size(); ++element) {
    for (int number = 0; number < 4; ++number) {
      const auto [a, b, c, ab, bc, ca] = outward_face(model.elements[element], number);
      ElementFace face;
      face.outward = {a, b, c};
      face.sorted = face.outward;
      std::sort(face.sorted.begin(), face.sorted.end());
      face.middles = {ab, bc, ca};
      face.element = static_cast<int>(element);
      face.face = number;
      face.even = is_even(face.outward);
      ++start[static_cast<std::size_t>(face.sorted[0]) + 1];
      unsorted.push_back(face);
    }
  }
  for (std::size_t node = 1; node < start.size(); ++node) start[node] += start[node - 1];
  std::vector<ElementFace> faces(unsorted.size());
  std::vector<std::size_t> next(start.begin(), start.end() - 1);
  for (const ElementFace& face : unsorted) faces[next[static_cast<std::size_t>(face.sorted[0])]++] = face;
  const auto less = [](const ElementFace& a, const ElementFace& b) {
    return std::tie(a.sorted, a.element) < std::tie(b.sorted, b.element);
  };
  for (std::size_t node = 0; node + 1 < start.size(); ++node) {
    std::sort(faces.begin() + static_cast<std::ptrdiff_t>(start[node]),
              faces.begin() + static_cast<std::ptrdiff_t>(start[node + 1]), less);
  }
  return faces;
}

}  // namespace palpate
