#include "offline/mesher/solid_fill.hpp"

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Mesh_complex_3_in_triangulation_3.h>
#include <CGAL/Mesh_criteria_3.h>
#include <CGAL/Mesh_triangulation_3.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polyhedral_mesh_domain_with_features_3.h>
#include <CGAL/exude_mesh_3.h>
#include <CGAL/make_mesh_3.h>
#include <CGAL/perturb_mesh_3.h>
#include <CGAL/refine_mesh_3.h>

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>

#include "offline/mesh/disjoint_sets.hpp"
#include "offline/mesh/input_error.hpp"

namespace palpate {
namespace solid_fill {

namespace parameters = CGAL::parameters;
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using Polyhedron = CGAL::Mesh_polyhedron_3<Kernel>::type;
using Domain = CGAL::Polyhedral_mesh_domain_with_features_3<Kernel>;
using Triangulation = CGAL::Mesh_triangulation_3<Domain>::type;
using Complex =
    CGAL::Mesh_complex_3_in_triangulation_3<Triangulation, Domain::Corner_index, Domain::Curve_index>;
using Criteria = CGAL::Mesh_criteria_3<Triangulation>;
using TriangleTree = CGAL::AABB_tree<CGAL::AABB_traits<
    Kernel, CGAL::AABB_triangle_primitive<Kernel, std::vector<Kernel::Triangle_3>::iterator>>>;

constexpr double kSharpAngle = 60;   // degrees between the normals of two triangles
constexpr double kBentAngle = 30;    // with more edges above than sharp ones, the surface is an organ's
constexpr double kShortestLine = 6;  // of sharp edges, in --size: shorter ones are noise
constexpr double kDensestLines =
    0.5;  // length of sharp edges by --size per area: denser ones are steps of voxels
constexpr double kLeastFaceAngle = 25;  // degrees, of the triangles of the surface; Mesh_3 ends for up to 30
constexpr double kRadiusOverEdge = 2;   // of an element's ball to its shortest edge; Mesh_3 ends from 2 on
constexpr double kRepairedAngle = 10;   // degrees: the perturbation works on elements below
constexpr double kSurfaceDistance =
    0.05;  // between the middle of a triangle and the surface, in h; corners of the input double it
// The mesher bounds radii. These factors give edges of mean length h.
constexpr double kFaceRadius = 0.75;
constexpr double kElementRadius = 0.85;

Eigen::Vector3d vector_of(const Point& point) {
  return {point.x(), point.y(), point.z()};
}

Point point_of(const Eigen::Vector3d& position) {
  return {position[0], position[1], position[2]};
}

Polyhedron polyhedron_of(const SurfaceTriangles& surface) {
  std::vector<Point> points;
  points.reserve(surface.positions.size());
  for (const Eigen::Vector3d& position : surface.positions) points.push_back(point_of(position));
  Polyhedron polyhedron;
  CGAL::Polygon_mesh_processing::polygon_soup_to_polygon_mesh(points, surface.triangles, polyhedron);
  return polyhedron;
}

using Vertex = Polyhedron::Vertex_const_handle;

std::map<Vertex, int> indices_of(const Polyhedron& polyhedron) {
  std::map<Vertex, int> index;
  for (auto vertex = polyhedron.vertices_begin(); vertex != polyhedron.vertices_end(); ++vertex)
    index.emplace(vertex, static_cast<int>(index.size()));
  return index;
}

// The angle between the normals of the triangles beside an edge, in degrees.
double bend(Polyhedron::Halfedge_const_handle edge) {
  const auto normal = [](Polyhedron::Halfedge_const_handle side) {
    const Eigen::Vector3d a = vector_of(side->vertex()->point()),
                          b = vector_of(side->next()->vertex()->point()),
                          c = vector_of(side->prev()->vertex()->point());
    return Eigen::Vector3d((b - a).cross(c - a).normalized());
  };
  const double cosine = normal(edge).dot(normal(edge->opposite()));
  return std::acos(std::clamp(cosine, -1.0, 1.0)) * 180 / std::numbers::pi;
}

double length_of(Polyhedron::Halfedge_const_handle edge) {
  return (vector_of(edge->vertex()->point()) - vector_of(edge->opposite()->vertex()->point())).norm();
}

// Marks the sharp edges that the mesh is to follow, and returns their length. These are closed lines between
// smooth faces, such as rims of a cylinder. Folds of an organ and steps of voxels would force bad elements.
double mark_sharp_edges(double area, double size, Polyhedron& polyhedron) {
  const std::map<Vertex, int> index = indices_of(polyhedron);
  const auto ends = [&](Polyhedron::Halfedge_const_handle edge) {
    return std::pair(index.at(edge->vertex()), index.at(edge->opposite()->vertex()));
  };
  std::vector<Polyhedron::Halfedge_handle> sharp;
  double bent = 0;
  for (auto edge = polyhedron.edges_begin(); edge != polyhedron.edges_end(); ++edge) {
    const double angle = bend(edge);
    if (angle > kSharpAngle) sharp.push_back(edge);
    if (angle > kBentAngle && angle <= kSharpAngle) bent += length_of(edge);
  }
  // An edge with a loose end goes, then those that have become loose.
  std::size_t before = 0;
  do {
    before = sharp.size();
    std::vector<int> num_edges(index.size(), 0);
    const auto count = [&](int vertex) -> int& { return num_edges[static_cast<std::size_t>(vertex)]; };
    for (const Polyhedron::Halfedge_handle edge : sharp) {
      ++count(ends(edge).first);
      ++count(ends(edge).second);
    }
    std::erase_if(sharp, [&](Polyhedron::Halfedge_handle edge) {
      return count(ends(edge).first) == 1 || count(ends(edge).second) == 1;
    });
  } while (sharp.size() < before);
  DisjointSets joined(index.size());
  for (const Polyhedron::Halfedge_handle edge : sharp) joined.unite(ends(edge).first, ends(edge).second);
  std::map<int, double> lengths;
  for (const Polyhedron::Halfedge_handle edge : sharp)
    lengths[joined.root(ends(edge).first)] += length_of(edge);
  std::erase_if(lengths, [&](const auto& line) { return line.second < kShortestLine * size; });
  double total = 0;
  for (const auto& [line, length] : lengths) total += length;
  if (total < bent || total * size > kDensestLines * area) return 0;
  for (const Polyhedron::Halfedge_handle edge : sharp) {
    if (lengths.contains(joined.root(ends(edge).first))) edge->set_feature_edge(true);
  }
  return total;
}

// Inserts some points of each part of the surface: the refinement of the whole would not find a part without
// any. `away`: points keep this distance from sharp edges, which have their own.
void insert_first_points(double away, const Domain& domain, Complex& complex) {
  constexpr int kPointsOfPart = 12;
  const Polyhedron& surface = domain.polyhedra().front();
  const std::map<Vertex, int> index = indices_of(surface);
  DisjointSets joined(index.size());
  std::vector<Eigen::Vector3d> features;
  for (auto edge = surface.edges_begin(); edge != surface.edges_end(); ++edge) {
    joined.unite(index.at(edge->vertex()), index.at(edge->opposite()->vertex()));
    if (edge->is_feature_edge()) features.push_back(vector_of(edge->vertex()->point()));
  }
  std::map<int, std::vector<Vertex>> parts;
  for (auto vertex = surface.vertices_begin(); vertex != surface.vertices_end(); ++vertex)
    parts[joined.root(index.at(vertex))].push_back(vertex);
  for (const auto& [root, vertices] : parts) {
    // Each point is the vertex furthest from those before it.
    std::vector<double> distance(vertices.size(), std::numeric_limits<double>::max());
    const auto pass = [&](const Eigen::Vector3d& point) {
      for (std::size_t i = 0; i < vertices.size(); ++i)
        distance[i] = std::min(distance[i], (vector_of(vertices[i]->point()) - point).norm());
    };
    for (const Eigen::Vector3d& feature : features) pass(feature);
    for (int i = 0; i < kPointsOfPart; ++i) {
      const auto furthest = static_cast<std::size_t>(std::ranges::max_element(distance) - distance.begin());
      if (distance[furthest] < (features.empty() ? 0 : away) || distance[furthest] == 0) break;
      const Vertex vertex = vertices[furthest];
      pass(vector_of(vertex->point()));
      const Triangulation::Vertex_handle inserted =
          complex.triangulation().insert(Triangulation::Weighted_point(vertex->point()));
      if (inserted == Triangulation::Vertex_handle()) continue;
      complex.set_dimension(inserted, 2);
      complex.set_index(inserted,
                        domain.index_from_surface_patch_index(vertex->halfedge()->face()->patch_id()));
    }
  }
}

// The wanted edge length as the mesher asks for it, times a factor.
class Field {
 public:
  using FT = double;
  using Point_3 = Point;
  using Index = Domain::Index;

  Field(const SizeField& sizes, const Domain& domain, double factor)
      : sizes_(&sizes), domain_(&domain), factor_(factor) {}

  double operator()(const Point& point, int dimension, const Index& /*index*/) const {
    const Eigen::Vector3d place = vector_of(point);
    if (dimension < 3) return factor_ * sizes_->at_surface(place);
    return factor_ * sizes_->inside(place, std::sqrt(domain_->aabb_tree().squared_distance(point)));
  }

 private:
  const SizeField* sizes_;
  const Domain* domain_;
  double factor_;
};

void refine(const SizeField& sizes, std::size_t most_nodes, bool has_features, const std::string& file,
            const Domain& domain, Complex& complex) {
  const Criteria criteria(parameters::edge_size = Field(sizes, domain, 1),
                          parameters::facet_angle = kLeastFaceAngle,
                          parameters::facet_size = Field(sizes, domain, kFaceRadius),
                          parameters::facet_distance = Field(sizes, domain, kSurfaceDistance),
                          parameters::cell_radius_edge_ratio = kRadiusOverEdge,
                          parameters::cell_size = Field(sizes, domain, kElementRadius));
  CGAL::Mesh_error_code error = CGAL::CGAL_MESH_3_NO_ERROR;
  if (has_features)
    CGAL::Mesh_3::internal::init_c3t3_with_features(complex, domain, criteria, false, most_nodes, &error);
  insert_first_points(1.5 * sizes.size(), domain, complex);
  parameters::internal::Mesh_3_options options;
  options.maximal_number_of_vertices = most_nodes;
  options.pointer_to_error_code = &error;
  CGAL::refine_mesh_3(complex, domain, criteria, options, parameters::no_perturb(), parameters::no_exude(),
                      parameters::no_reset_c3t3());
  if (error != CGAL::CGAL_MESH_3_NO_ERROR)
    throw InputError({file, 0},
                     fmt::format("needs more than {} nodes, for it has thin walls or sharp folds; smooth the "
                                 "surface, or take another --size",
                                 most_nodes));
}

// Copies the tetrahedra, and the nodes that they use, in the order of the triangulation.
MeshData mesh_of(const Complex& complex) {
  MeshData mesh;
  std::map<Triangulation::Vertex_handle, int> index;
  for (auto cell = complex.cells_in_complex_begin(); cell != complex.cells_in_complex_end(); ++cell) {
    MeshCell tetrahedron;
    tetrahedron.num_nodes = 4;
    for (int i = 0; i < 4; ++i) {
      const auto [place, is_new] =
          index.try_emplace(cell->vertex(i), static_cast<int>(mesh.positions.size()));
      if (is_new)
        mesh.positions.push_back(vector_of(
            complex.triangulation().geom_traits().construct_point_3_object()(cell->vertex(i)->point())));
      tetrahedron.nodes[static_cast<std::size_t>(i)] = place->second;
    }
    mesh.cells.push_back(tetrahedron);
  }
  number_from_one(mesh);
  return mesh;
}

// The largest distance from corners and centres of the triangles of `from` to those of `to`.
double largest_distance(const SurfaceTriangles& from, const SurfaceTriangles& to) {
  std::vector<Kernel::Triangle_3> triangles;
  const auto corner = [](const SurfaceTriangles& surface, int node) {
    return surface.positions[static_cast<std::size_t>(node)];
  };
  for (const auto& [a, b, c] : to.triangles)
    triangles.emplace_back(point_of(corner(to, a)), point_of(corner(to, b)), point_of(corner(to, c)));
  TriangleTree tree(triangles.begin(), triangles.end());
  tree.accelerate_distance_queries();
  double square = 0;
  const auto visit = [&](const Eigen::Vector3d& point) {
    square = std::max(square, tree.squared_distance(point_of(point)));
  };
  for (const Eigen::Vector3d& point : from.positions) visit(point);
  for (const auto& [a, b, c] : from.triangles)
    visit((corner(from, a) + corner(from, b) + corner(from, c)) / 3);
  return std::sqrt(square);
}

}  // namespace solid_fill

FilledSolid fill_solid(const ClosedSurface& closed, const SizeField& sizes, std::size_t most_nodes,
                       const std::string& file) {
  using namespace solid_fill;
  CGAL::get_default_random() = CGAL::Random(0);  // else seeded by the clock
  FilledSolid solid;
  Polyhedron surface = polyhedron_of(closed.surface);
  solid.sharp_length = mark_sharp_edges(closed.area, sizes.size(), surface);
  Domain domain(surface);
  domain.detect_borders();  // takes the marked edges; the surface has no borders
  Complex complex;
  refine(sizes, most_nodes, solid.sharp_length > 0, file, domain, complex);
  if (complex.number_of_cells_in_complex() == 0)  // the perturbation would crash
    throw InputError({file, 0}, "gave no tetrahedra: it is smaller than --size; take a smaller one");
  // Without limits of time, for equal output.
  CGAL::perturb_mesh_3(complex, domain, parameters::time_limit = 0,
                       parameters::sliver_bound = kRepairedAngle);
  CGAL::exude_mesh_3(complex, parameters::time_limit = 0, parameters::sliver_bound = kRepairedAngle);
  solid.mesh = mesh_of(complex);
  const SurfaceTriangles outer = surface_triangles(solid.mesh, file);
  solid.deviation =
      std::max(largest_distance(outer, closed.surface), largest_distance(closed.surface, outer));
  return solid;
}

}  // namespace palpate
