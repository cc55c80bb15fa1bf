#include "offline/io/organ_check.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <span>
#include <utility>

#include "offline/mesh/disjoint_sets.hpp"
#include "offline/mesh/element_faces.hpp"
#include "offline/mesh/model_check.hpp"
#include "offline/mesh/surface.hpp"

namespace palpate {
namespace {

// Returns the angles, degrees, between the faces of a tetrahedron at its six edges.
std::array<double, 6> dihedral_angles(const Model& model, const Tetrahedron& element) {
  std::array<Eigen::Vector3d, 4> normals;
  for (int face = 0; face < 4; ++face) {
    const std::array<int, 6> nodes = outward_face(element, face);
    const auto at = [&](size_t i) { return model.positions[static_cast<size_t>(nodes[i])]; };
    normals[static_cast<size_t>(face)] = (at(1) - at(0)).cross(at(2) - at(0)).normalized();
  }
  std::array<double, 6> angles;
  size_t next = 0;
  for (size_t a = 0; a < 4; ++a) {
    for (size_t b = a + 1; b < 4; ++b) {
      const double cosine = std::clamp(-normals[a].dot(normals[b]), -1.0, 1.0);
      angles[next++] = std::acos(cosine) * 180 / std::numbers::pi;
    }
  }
  return angles;
}

void count_angles(const Model& model, OrganCheck& check) {
  std::vector<std::pair<double, int>> smallest;  // (angle, label)
  for (const Tetrahedron& element : model.elements) {
    const std::array<double, 6> angles = dihedral_angles(model, element);
    for (const double angle : angles) ++check.angles[std::min<size_t>(17, static_cast<size_t>(angle / 10))];
    const auto [least, largest] = std::minmax_element(angles.begin(), angles.end());
    check.least_angle = std::min(check.least_angle, *least);
    check.largest_angle = std::max(check.largest_angle, *largest);
    if (*least < kSliverAngle) smallest.emplace_back(*least, element.label);
  }
  check.num_slivers = static_cast<int>(smallest.size());
  std::sort(smallest.begin(), smallest.end());
  for (const auto& [angle, label] : smallest) {
    if (check.slivers.size() < kMostListed) check.slivers.push_back(label);
  }
}

// Returns the number of parts that faces of neighbours join.
int count_components(const Model& model) {
  DisjointSets parts(model.elements.size());
  const std::vector<ElementFace> faces = sorted_faces(model);
  for (size_t i = 1; i < faces.size(); ++i) {
    if (faces[i].sorted == faces[i - 1].sorted) parts.unite(faces[i].element, faces[i - 1].element);
  }
  int count = 0;
  for (int element = 0; element < static_cast<int>(model.elements.size()); ++element)
    count += parts.root(element) == element ? 1 : 0;
  return count;
}

// Returns the number of edges that do not have exactly two triangles.
int count_open_edges(const Surface& surface) {
  std::vector<std::pair<int, int>> edges;
  for (const std::array<int, 3>& triangle : surface.triangles) {
    for (size_t i = 0; i < 3; ++i) edges.push_back(std::minmax(triangle[i], triangle[(i + 1) % 3]));
  }
  std::sort(edges.begin(), edges.end());
  int open = 0;
  for (size_t i = 0; i < edges.size();) {
    size_t end = i;
    while (end < edges.size() && edges[end] == edges[i]) ++end;
    open += end - i == 2 ? 0 : 1;
    i = end;
  }
  return open;
}

}  // namespace

OrganCheck check_organ(const Model& model) {
  OrganCheck check;
  check.num_nodes = model.num_nodes();
  check.num_elements = static_cast<int>(model.elements.size());
  for (const Eigen::Vector3d& position : model.positions) check.box.extend(position);
  for (const Tetrahedron& element : model.elements) {
    check.num_quadratic += element.num_nodes == 10 ? 1 : 0;
    check.volume += signed_volume(model, element);
  }
  const Surface surface = extract_surface(model);
  check.num_surface_nodes = static_cast<int>(surface.nodes.size());
  check.mean_edge = surface.mean_edge;
  check.num_open_edges = count_open_edges(surface);
  check.num_components = count_components(model);
  count_angles(model, check);
  return check;
}

}  // namespace palpate
