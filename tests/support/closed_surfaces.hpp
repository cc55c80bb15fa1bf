// Surfaces for the mesher: spheres and boxes of triangles, outward.
#pragma once

#include <Eigen/Core>
#include <array>
#include <map>
#include <utility>

#include "offline/io/surface_cells.hpp"

namespace palpate::test {

// An icosahedron whose triangles are split in four `levels` times, with nodes on the sphere.
inline SurfaceTriangles sphere_surface(double radius, int levels,
                                       const Eigen::Vector3d& centre = Eigen::Vector3d::Zero()) {
  constexpr double kGolden = 1.6180339887498949;
  SurfaceTriangles sphere;
  for (const double one : {-1.0, 1.0}) {
    for (const double golden : {-kGolden, kGolden}) {
      sphere.positions.emplace_back(0, one, golden);
      sphere.positions.emplace_back(one, golden, 0);
      sphere.positions.emplace_back(golden, 0, one);
    }
  }
  // Three nodes at mutual distance 2 are a face.
  const auto is_edge = [&](int a, int b) {
    const auto at = [&](int node) { return sphere.positions[static_cast<std::size_t>(node)]; };
    return std::abs((at(a) - at(b)).norm() - 2) < 1e-9;
  };
  for (int a = 0; a < 12; ++a) {
    for (int b = a + 1; b < 12; ++b) {
      for (int c = b + 1; c < 12; ++c) {
        if (!is_edge(a, b) || !is_edge(b, c) || !is_edge(c, a)) continue;
        Eigen::Matrix3d corners;
        corners << sphere.positions[static_cast<std::size_t>(a)],
            sphere.positions[static_cast<std::size_t>(b)], sphere.positions[static_cast<std::size_t>(c)];
        sphere.triangles.push_back(corners.determinant() > 0 ? std::array<int, 3>{a, b, c}
                                                             : std::array<int, 3>{a, c, b});
      }
    }
  }
  for (int level = 0; level < levels; ++level) {
    std::map<std::pair<int, int>, int> middles;
    const auto middle = [&](int a, int b) {
      const auto [place, is_new] =
          middles.try_emplace(std::minmax(a, b), static_cast<int>(sphere.positions.size()));
      if (is_new)
        sphere.positions.push_back(sphere.positions[static_cast<std::size_t>(a)].normalized() +
                                   sphere.positions[static_cast<std::size_t>(b)].normalized());
      return place->second;
    };
    std::vector<std::array<int, 3>> finer;
    for (const auto& [a, b, c] : sphere.triangles) {
      const int ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
    }
    sphere.triangles = finer;
  }
  for (Eigen::Vector3d& position : sphere.positions) position = centre + radius * position.normalized();
  return sphere;
}

// A box with two triangles a side.
inline SurfaceTriangles box_surface(const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  SurfaceTriangles box;
  for (int i = 0; i < 8; ++i)
    box.positions.emplace_back((i & 1) ? high[0] : low[0], (i & 2) ? high[1] : low[1],
                               (i & 4) ? high[2] : low[2]);
  box.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                   {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return box;
}

// Both surfaces in one.
inline SurfaceTriangles both(SurfaceTriangles one, const SurfaceTriangles& other) {
  const int shift = static_cast<int>(one.positions.size());
  one.positions.insert(one.positions.end(), other.positions.begin(), other.positions.end());
  for (const auto& [a, b, c] : other.triangles) one.triangles.push_back({a + shift, b + shift, c + shift});
  return one;
}

// For the writers of mesh formats.
inline MeshData mesh_of(const SurfaceTriangles& surface) {
  MeshData mesh;
  mesh.positions = surface.positions;
  for (const std::array<int, 3>& triangle : surface.triangles) add_polygon(triangle, 0, mesh);
  number_from_one(mesh);
  return mesh;
}

}  // namespace palpate::test
