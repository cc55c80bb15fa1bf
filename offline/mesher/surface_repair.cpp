#include "offline/mesher/surface_repair.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>

#include "offline/mesh/input_error.hpp"
#include "offline/mesh/point_groups.hpp"

namespace palpate {
namespace {

using Triangle = std::array<int, 3>;
using Edge = std::pair<int, int>;  // the lower node first

constexpr double kWeldLength = 1e-6;  // of the diagonal: some digits above the noise of float coordinates

// A triangle beside an edge.
struct Side {
  int triangle = 0;
  bool is_forward = false;  // the triangle runs along the edge from the lower node to the higher
};
using EdgeSides = std::map<Edge, std::vector<Side>>;

// CGAL fails in silence, hangs or crashes where powers of lengths leave the range of a double.
void check_lengths(const Eigen::AlignedBox3d& box, const std::string& file) {
  constexpr double kLongest = 1e12;
  const double longest = box.sizes().maxCoeff(),
               furthest = std::max(-box.min().minCoeff(), box.max().maxCoeff());
  if (furthest < kLongest && longest > 1 / kLongest) return;
  throw InputError({file, 0},
                   fmt::format("is {:.3g} long, with coordinates up to {:.3g}; scale it, since lengths "
                               "from {:g} to {:g} can be meshed",
                               longest, furthest, 1 / kLongest, kLongest));
}

void check_not_flat(const Eigen::AlignedBox3d& box, const std::string& file) {
  Eigen::Index axis = 0;
  if (box.sizes().minCoeff(&axis) > kWeldLength * box.diagonal().norm()) return;
  throw InputError({file, 0},
                   fmt::format("is flat, all of it at {} = {:g}; give the closed surface of a solid",
                               "xyz"[axis], box.min()[axis]));
}

// Gives equal points one node. Returns the number of points that are gone.
std::size_t weld(double length, SurfaceTriangles& surface) {
  const std::vector<int> group = group_points(surface.positions, length);
  std::size_t num_gone = 0;
  for (std::size_t node = 0; node < group.size(); ++node) {
    if (group[node] != static_cast<int>(node)) ++num_gone;
  }
  for (Triangle& triangle : surface.triangles) {
    for (int& node : triangle) node = group[static_cast<std::size_t>(node)];
  }
  return num_gone;
}

std::size_t drop_degenerate(std::vector<Triangle>& triangles) {
  return std::erase_if(triangles,
                       [](const Triangle& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; });
}

// The nodes in rising order, and whether this takes an even number of exchanges.
std::pair<Triangle, bool> sorted_nodes(const Triangle& triangle) {
  Triangle sorted = triangle;
  std::ranges::sort(sorted);
  const auto first = std::ranges::find(triangle, sorted[0]) - triangle.begin();
  return {sorted, triangle[static_cast<std::size_t>(first + 1) % 3] == sorted[1]};
}

// Keeps one of several equal triangles, and none where as many face one way as the other. Returns the number
// of triangles that are gone.
std::size_t drop_copies(std::vector<Triangle>& triangles) {
  std::map<Triangle, int> num_even;  // minus those that face the other way
  for (const Triangle& triangle : triangles) {
    const auto [nodes, is_even] = sorted_nodes(triangle);
    num_even[nodes] += is_even ? 1 : -1;
  }
  return std::erase_if(triangles, [&](const Triangle& triangle) {
    const auto [nodes, is_even] = sorted_nodes(triangle);
    int& left = num_even.at(nodes);
    const bool is_kept = is_even ? left > 0 : left < 0;
    if (is_kept) left = 0;
    return !is_kept;
  });
}

EdgeSides sides_of_edges(const std::vector<Triangle>& triangles) {
  EdgeSides sides;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      const int from = triangles[i][k], to = triangles[i][(k + 1) % 3];
      sides[std::minmax(from, to)].push_back({static_cast<int>(i), from < to});
    }
  }
  return sides;
}

void check_manifold_edges(const EdgeSides& sides, const SurfaceTriangles& surface, const std::string& file) {
  const auto is_joint = [](const auto& edge) { return edge.second.size() > 2; };
  const auto first = std::ranges::find_if(sides, is_joint);
  if (first == sides.end()) return;
  const auto at = [&](int node) { return place_text(surface.positions[static_cast<std::size_t>(node)]); };
  throw InputError(
      {file, 0},
      fmt::format("{} edges have three or more triangles, the first from {} to {}; remove inner "
                  "walls, and pull parts that touch there apart or unite them",
                  std::ranges::count_if(sides, is_joint), at(first->first.first), at(first->first.second)));
}

// Turns the triangles of each part the way of most of them. Returns the number of those turned.
std::size_t turn_alike(const EdgeSides& sides, SurfaceTriangles& surface, const std::string& file) {
  struct Neighbour {
    int triangle = 0;
    bool is_opposed = false;  // runs along the common edge in the same direction
  };
  std::vector<std::vector<Neighbour>> neighbours(surface.triangles.size());
  for (const auto& [edge, pair] : sides) {
    if (pair.size() != 2) continue;
    for (std::size_t i = 0; i < 2; ++i)
      neighbours[static_cast<std::size_t>(pair[i].triangle)].push_back(
          {pair[1 - i].triangle, pair[0].is_forward == pair[1].is_forward});
  }
  constexpr int kUnknown = -1;
  std::vector<int> is_turned(surface.triangles.size(), kUnknown);
  std::size_t num_turned = 0;
  for (std::size_t seed = 0; seed < is_turned.size(); ++seed) {
    if (is_turned[seed] != kUnknown) continue;
    std::vector<int> part = {static_cast<int>(seed)};
    is_turned[seed] = 0;
    for (std::size_t next = 0; next < part.size(); ++next) {
      const auto triangle = static_cast<std::size_t>(part[next]);
      for (const Neighbour& neighbour : neighbours[triangle]) {
        int& other = is_turned[static_cast<std::size_t>(neighbour.triangle)];
        const int wanted = neighbour.is_opposed ? 1 - is_turned[triangle] : is_turned[triangle];
        if (other == kUnknown) part.push_back(neighbour.triangle);
        if (other != kUnknown && other != wanted) {
          const auto corner = static_cast<std::size_t>(surface.triangles[triangle][0]);
          throw InputError({file, 0}, "is one-sided, as a Moebius strip, near " +
                                          place_text(surface.positions[corner]) +
                                          "; give the closed surface of a solid");
        }
        other = wanted;
      }
    }
    const auto turned = std::ranges::count_if(
        part, [&](int triangle) { return is_turned[static_cast<std::size_t>(triangle)] == 1; });
    const bool is_rest = 2 * static_cast<std::size_t>(turned) > part.size();
    for (const int triangle : part) {
      if ((is_turned[static_cast<std::size_t>(triangle)] == 1) == is_rest) continue;
      Triangle& nodes = surface.triangles[static_cast<std::size_t>(triangle)];
      std::swap(nodes[1], nodes[2]);
      ++num_turned;
    }
  }
  return num_turned;
}

// Removes positions that no triangle uses.
void drop_unused(SurfaceTriangles& surface) {
  std::vector<int> place(surface.positions.size(), -1);
  for (const Triangle& triangle : surface.triangles) {
    for (const int node : triangle) place[static_cast<std::size_t>(node)] = 0;
  }
  int num_used = 0;
  for (std::size_t node = 0; node < place.size(); ++node) {
    if (place[node] < 0) continue;
    surface.positions[static_cast<std::size_t>(num_used)] = surface.positions[node];
    place[node] = num_used++;
  }
  surface.positions.resize(static_cast<std::size_t>(num_used));
  for (Triangle& triangle : surface.triangles) {
    for (int& node : triangle) node = place[static_cast<std::size_t>(node)];
  }
}

}  // namespace

std::string place_text(const Eigen::Vector3d& point) {
  return fmt::format("({:.5g} {:.5g} {:.5g})", point[0], point[1], point[2]);
}

Eigen::AlignedBox3d box_of(const SurfaceTriangles& surface) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& position : surface.positions) box.extend(position);
  return box;
}

RepairedSurface repair_surface(SurfaceTriangles surface, const std::string& file) {
  const Eigen::AlignedBox3d box = box_of(surface);
  check_lengths(box, file);
  check_not_flat(box, file);
  RepairedSurface repaired;
  const auto remark = [&](std::size_t count, const char* what) {
    if (count > 0) repaired.remarks.push_back(fmt::format(fmt::runtime(what), count));
  };
  remark(weld(kWeldLength * box.diagonal().norm(), surface), "welded {} points to others at the same place");
  remark(drop_degenerate(surface.triangles), "dropped {} triangles without an area");
  remark(drop_copies(surface.triangles), "dropped {} triangles that stood there twice, or back to back");
  if (surface.triangles.empty())
    throw InputError({file, 0}, "has no triangles that bound a solid; give a closed surface");
  const EdgeSides sides = sides_of_edges(surface.triangles);
  check_manifold_edges(sides, surface, file);
  remark(turn_alike(sides, surface, file), "turned {} triangles around, which faced the other way");
  drop_unused(surface);
  repaired.surface = std::move(surface);
  return repaired;
}

}  // namespace palpate
