#include "offline/io/surface_cells.hpp"

#include <algorithm>
#include <stdexcept>

namespace palpate {
namespace {

using Triangle = std::array<int, 3>;

std::vector<Triangle> triangles_of_faces(const MeshData& mesh) {
  std::vector<Triangle> triangles;
  for (const MeshCell& cell : mesh.cells) {
    const std::array<int, 10>& n = cell.nodes;
    const bool is_quadrilateral = cell.kind == CellKind::quadrilateral;
    if (is_quadrilateral || cell.kind == CellKind::triangle) triangles.push_back({n[0], n[1], n[2]});
    if (is_quadrilateral) triangles.push_back({n[0], n[2], n[3]});
  }
  return triangles;
}

bool has_other_solids(const MeshData& mesh) {
  return std::ranges::any_of(mesh.cells, [](const MeshCell& cell) {
    return cell.kind == CellKind::pyramid || cell.kind == CellKind::wedge ||
           cell.kind == CellKind::hexahedron;
  });
}

// The faces that belong to one tetrahedron only, in the order of the cells.
std::vector<Triangle> outer_faces(const MeshData& mesh) {
  const auto sorted = [](Triangle face) {
    std::ranges::sort(face);
    return face;
  };
  std::vector<Triangle> faces, keys;
  for (const MeshCell& cell : mesh.cells) {
    if (cell.kind != CellKind::tetrahedron) continue;
    const std::array<int, 10>& n = cell.nodes;
    for (const Triangle& face : {Triangle{n[0], n[2], n[1]}, Triangle{n[0], n[1], n[3]},
                                 Triangle{n[1], n[2], n[3]}, Triangle{n[0], n[3], n[2]}}) {
      faces.push_back(face);
      keys.push_back(sorted(face));
    }
  }
  std::ranges::sort(keys);
  std::erase_if(faces, [&](const Triangle& face) {
    const auto [begin, end] = std::equal_range(keys.begin(), keys.end(), sorted(face));
    return end - begin > 1;
  });
  return faces;
}

}  // namespace

void add_polygon(std::span<const int> nodes, int line, MeshData& mesh) {
  for (std::size_t i = 1; i + 1 < nodes.size(); ++i) {
    MeshCell cell;
    cell.kind = CellKind::triangle;
    cell.num_nodes = 3;
    cell.nodes = {nodes[0], nodes[i], nodes[i + 1]};
    cell.line = line;
    mesh.cells.push_back(cell);
  }
}

void drop_whole_sets(MeshData& mesh) {
  std::erase_if(mesh.element_sets, [&](const auto& set) { return set.second.size() == mesh.cells.size(); });
}

SurfaceTriangles surface_triangles(const MeshData& mesh, const std::filesystem::path& file) {
  SurfaceTriangles surface;
  surface.triangles = triangles_of_faces(mesh);
  if (surface.triangles.empty() && !has_other_solids(mesh)) surface.triangles = outer_faces(mesh);
  if (surface.triangles.empty())
    throw std::runtime_error(file.string() +
                             ": the mesh has neither triangles nor tetrahedra alone, so it has no surface to "
                             "write; split its cells into tetrahedra first");
  std::vector<int> places(mesh.positions.size(), -1);
  for (const Triangle& triangle : surface.triangles) {
    for (const int node : triangle) places[static_cast<std::size_t>(node)] = 0;
  }
  for (std::size_t node = 0; node < places.size(); ++node) {
    if (places[node] < 0) continue;
    places[node] = static_cast<int>(surface.positions.size());
    surface.positions.push_back(mesh.positions[node]);
  }
  for (Triangle& triangle : surface.triangles) {
    for (int& node : triangle) node = places[static_cast<std::size_t>(node)];
  }
  return surface;
}

}  // namespace palpate
