#include "offline/mesher/closed_surface.hpp"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/bbox.h>
#include <CGAL/Polygon_mesh_processing/border.h>
#include <CGAL/Polygon_mesh_processing/connected_components.h>
#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/orientation.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polygon_mesh_processing/repair_degeneracies.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Polygon_mesh_processing/triangulate_hole.h>
#include <CGAL/Surface_mesh.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <set>
#include <utility>

#include "offline/mesh/input_error.hpp"
#include "offline/mesher/surface_repair.hpp"

namespace palpate {
namespace closed_surface {

namespace PMP = CGAL::Polygon_mesh_processing;
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;
using Face = Mesh::Face_index;
using Halfedge = Mesh::Halfedge_index;

Eigen::Vector3d position(const Mesh& mesh, Mesh::Vertex_index vertex) {
  const Kernel::Point_3& point = mesh.point(vertex);
  return {point.x(), point.y(), point.z()};
}

Mesh mesh_of(const SurfaceTriangles& surface) {
  std::vector<Kernel::Point_3> points;
  points.reserve(surface.positions.size());
  for (const Eigen::Vector3d& p : surface.positions) points.emplace_back(p[0], p[1], p[2]);
  std::vector<std::vector<std::size_t>> polygons;
  polygons.reserve(surface.triangles.size());
  for (const std::array<int, 3>& triangle : surface.triangles)
    polygons.emplace_back(triangle.begin(), triangle.end());
  // Splits nodes at which parts touch in a point.
  PMP::orient_polygon_soup(points, polygons);
  Mesh mesh;
  PMP::polygon_soup_to_polygon_mesh(points, polygons, mesh);
  return mesh;
}

struct Hole {
  Halfedge border;
  int num_edges = 0;
  double around = 0;
  Eigen::Vector3d centre;
};

std::vector<Hole> holes_of(const Mesh& mesh) {
  std::vector<Halfedge> borders;
  PMP::extract_boundary_cycles(mesh, std::back_inserter(borders));
  std::vector<Hole> holes;
  for (const Halfedge border : borders) {
    Hole hole = {border, 0, 0, Eigen::Vector3d::Zero()};
    for (const Halfedge edge : CGAL::halfedges_around_face(border, mesh)) {
      const Eigen::Vector3d from = position(mesh, mesh.source(edge)), to = position(mesh, mesh.target(edge));
      ++hole.num_edges;
      hole.around += (to - from).norm();
      hole.centre += from;
    }
    hole.centre /= hole.num_edges;
    holes.push_back(hole);
  }
  std::ranges::stable_sort(holes, std::greater(), &Hole::around);
  return holes;
}

std::string hole_text(const Hole& hole) {
  return fmt::format("{} edges, {:.4g} around, about {}", hole.num_edges, hole.around,
                     place_text(hole.centre));
}

// Fills the holes, and returns the new triangles.
std::set<Face> close_holes(double size, const std::string& file, Mesh& mesh,
                           std::vector<std::string>& remarks) {
  const std::vector<Hole> holes = holes_of(mesh);
  std::set<Face> filled;
  if (holes.empty()) return filled;
  const CGAL::Bbox_3 box = PMP::bbox(mesh);
  const double diagonal = std::hypot(box.x_span(), box.y_span(), box.z_span());
  const double largest = std::min(kLargestHole * size, diagonal);
  if (holes.front().around > largest)
    throw InputError(
        {file, 0},
        fmt::format("is open: {} holes, the largest with {}; holes up to {:.4g} around are closed here. "
                    "Close it in the program that made the surface",
                    holes.size(), hole_text(holes.front()), largest));
  for (const Hole& hole : holes) {
    std::vector<Face> faces;
    PMP::triangulate_hole(mesh, hole.border, std::back_inserter(faces));
    if (faces.empty())
      throw InputError({file, 0}, "has a hole that cannot be closed, with " + hole_text(hole) +
                                      "; close it in the program that made the surface");
    filled.insert(faces.begin(), faces.end());
  }
  remarks.push_back(
      fmt::format("closed {} holes, the largest with {}", holes.size(), hole_text(holes.front())));
  return filled;
}

std::string triangle_text(const Mesh& mesh, Face face) {
  std::string text;
  for (const Mesh::Vertex_index vertex : CGAL::vertices_around_face(mesh.halfedge(face), mesh))
    text += (text.empty() ? "" : " ") + place_text(position(mesh, vertex));
  return text;
}

void check_crossings(const Mesh& mesh, const std::set<Face>& filled, const std::string& file) {
  std::vector<std::pair<Face, Face>> pairs;
  PMP::self_intersections(mesh, std::back_inserter(pairs));
  if (pairs.empty()) return;
  const auto [one, other] = *std::ranges::min_element(pairs);
  const bool is_at_hole = filled.contains(one) || filled.contains(other);
  throw InputError(
      {file, 0},
      fmt::format("{} pairs of triangles cross or touch, the first {} with {}; {}", pairs.size(),
                  triangle_text(mesh, one), triangle_text(mesh, other),
                  is_at_hole ? "a hole was closed there: close it in the program that made the surface"
                             : "mend the surface: unite overlapping parts, or remesh it, for instance in "
                               "Blender (Voxel Remesh) or MeshLab"));
}

// Finds area, volume, parts and cavities. Tetrahedra for the volume end at the middle of the surface, since
// those that end at a far origin lose their digits.
void measure(Mesh& mesh, ClosedSurface& closed) {
  const auto part = mesh.add_property_map<Face, std::size_t>("f:part", 0).first;
  std::vector<double> volumes(PMP::connected_components(mesh, part), 0.0);
  const Eigen::Vector3d centre = box_of(closed.surface).center();
  std::size_t next = 0;  // triangles_of() keeps the order of the faces
  for (const Face face : mesh.faces()) {
    const auto& [i, j, k] = closed.surface.triangles[next++];
    const auto at = [&](int node) { return closed.surface.positions[static_cast<std::size_t>(node)]; };
    const Eigen::Vector3d normal = (at(j) - at(i)).cross(at(k) - at(i));
    closed.area += normal.norm() / 2;
    volumes[part[face]] += normal.dot(at(i) - centre) / 6;
  }
  for (const double volume : volumes) {
    closed.volume += volume;
    ++(volume < 0 ? closed.num_cavities : closed.num_parts);  // the surface of a cavity faces the cavity
  }
}

void check_walls(const ClosedSurface& closed, double size, const std::string& file) {
  // Two sides share a wall.
  const double thickness = 2 * closed.volume / closed.area;
  if (thickness >= kThinnestWall * size) return;
  throw InputError(
      {file, 0},
      fmt::format("is about {:.3g} thick, too thin for --size {:g}; {}", thickness, size,
                  thickness > 1e-3 * size ? fmt::format("take --size {:.2g} or less", thickness)
                                          : "give the closed surface of a solid, for this is a sheet"));
}

SurfaceTriangles triangles_of(const Mesh& mesh) {
  SurfaceTriangles surface;
  std::vector<int> place(mesh.num_vertices(), -1);
  for (const Mesh::Vertex_index vertex : mesh.vertices()) {
    if (mesh.is_isolated(vertex)) continue;
    place[vertex] = static_cast<int>(surface.positions.size());
    surface.positions.push_back(position(mesh, vertex));
  }
  for (const Face face : mesh.faces()) {
    std::array<int, 3> triangle{};
    std::size_t next = 0;
    for (const Mesh::Vertex_index vertex : CGAL::vertices_around_face(mesh.halfedge(face), mesh))
      triangle[next++] = place[vertex];
    surface.triangles.push_back(triangle);
  }
  return surface;
}

}  // namespace closed_surface

ClosedSurface close_surface(const SurfaceTriangles& surface, double size, const std::string& file) {
  using namespace closed_surface;
  ClosedSurface closed;
  Mesh mesh = mesh_of(surface);
  std::vector<Face> needles;
  PMP::degenerate_faces(mesh, std::back_inserter(needles));
  if (needles.size() == mesh.number_of_faces())  // their removal would crash
    throw InputError({file, 0}, "has no triangles with an area; give the closed surface of a solid");
  if (!needles.empty()) {
    PMP::remove_degenerate_faces(mesh);
    closed.remarks.push_back(fmt::format("removed {} triangles whose corners lie on a line", needles.size()));
  }
  const std::set<Face> filled = close_holes(size, file, mesh, closed.remarks);
  check_crossings(mesh, filled, file);
  PMP::orient_to_bound_a_volume(mesh);
  mesh.collect_garbage();
  closed.surface = triangles_of(mesh);
  measure(mesh, closed);
  check_walls(closed, size, file);
  return closed;
}

}  // namespace palpate
