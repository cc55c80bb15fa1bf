// Surfaces, and nearest points by brute force as reference.
#pragma once

#include "runtime/src/pack/surface_bvh.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>

#include "offline/mesh/inp_reader.hpp"
#include "tests/support/sanitizer.hpp"
#include "tests/support/tetrahedral_block.hpp"
#include "tests/support/touchable_surface.hpp"

namespace palpate::test::surface_bvh_fixture {

using Eigen::Vector3d;
using Precise = Eigen::Matrix<long double, 3, 1>;
// float64 rounding, relative to the distance plus the surface's size.
inline constexpr double kTolerance = 1e-12;

// ---- Surfaces

inline const TouchableSurface& block() {
  static const TouchableSurface surface(tetrahedral_block({}));
  return surface;
}

// Sites too far apart to form a triangle.
inline const TouchableSurface& single_sites() {
  static const TouchableSurface surface(tetrahedral_block({}), {0, 3, 10, 51, 63});
  return surface;
}

inline const TouchableSurface& brain() {
  static const TouchableSurface surface(
      read_inp(std::filesystem::path(PALPATE_SOURCE_DIR) / "models/brain/brain.inp"));
  return surface;
}

inline Eigen::AlignedBox3d box_of(const TouchableSurface& surface) {
  Eigen::AlignedBox3d box;
  for (std::size_t i = 0; i < surface.positions.size(); i += 3) box.extend(Vector3d(&surface.positions[i]));
  return box;
}

inline double size_of(const TouchableSurface& surface) {
  return box_of(surface).diagonal().norm();
}

// ---- Reference

inline SurfaceHit nearest(const pal_pack& pack, const Vector3d& position, uint32_t start = 0) {
  SurfaceHit hit = {};
  EXPECT_TRUE(find_nearest_surface_point(pack, position.data(), start, hit));
  return hit;
}

// The nearest point of an edge, and the nearest point of a triangle from its plane and its edges.
inline Precise nearest_on_edge(const Precise& p, const Precise& a, const Precise& b) {
  const Precise edge = b - a;
  const long double square = edge.squaredNorm();
  const long double t = square > 0 ? std::clamp((p - a).dot(edge) / square, 0.0L, 1.0L) : 0.0L;
  return a + t * edge;
}

inline long double distance_to(const Precise& p, const std::array<Precise, 3>& corners) {
  Precise offset = p - corners[0];  // from the nearest point of the triangle's edges
  for (std::size_t k = 0; k < 3; ++k) {
    const Precise other = p - nearest_on_edge(p, corners[k], corners[(k + 1) % 3]);
    if (other.norm() < offset.norm()) offset = other;
  }
  const Precise normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
  const bool over = normal.norm() > 0 && (corners[1] - corners[0]).cross(p - corners[0]).dot(normal) >= 0 &&
                    (corners[2] - corners[1]).cross(p - corners[1]).dot(normal) >= 0 &&
                    (corners[0] - corners[2]).cross(p - corners[2]).dot(normal) >= 0;
  return over ? std::abs(offset.dot(normal.normalized())) : offset.norm();
}

inline std::array<Precise, 3> corners_of(const pal_pack& pack, uint32_t primitive) {
  std::array<Precise, 3> corners;
  for (std::size_t k = 0; k < 3; ++k) {
    const uint32_t node = pack.site_nodes[pack.primitives[3 * primitive + k]];
    corners[k] = Vector3d(pack.positions + 3 * node).cast<long double>();
  }
  return corners;
}

inline double brute_force(const pal_pack& pack, const Vector3d& position) {
  long double distance = std::numeric_limits<long double>::infinity();
  for (uint32_t primitive = 0; primitive < pack.num_primitives; ++primitive) {
    distance = std::min(distance, distance_to(position.cast<long double>(), corners_of(pack, primitive)));
  }
  return static_cast<double>(distance);
}

// Checks that a hit's point, distance, primitive and weights agree with one another.
inline void expect_consistent(const pal_pack& pack, const Vector3d& position, const SurfaceHit& hit,
                              double size) {
  ASSERT_LT(hit.primitive, pack.num_primitives);
  const std::array<Precise, 3> corners = corners_of(pack, hit.primitive);
  Precise point = Precise::Zero();
  double sum = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_EQ(hit.sites[k], pack.primitives[3 * hit.primitive + k]);
    EXPECT_GE(hit.weights[k], 0);
    sum += hit.weights[k];
    point += static_cast<long double>(hit.weights[k]) * corners[k];
  }
  EXPECT_NEAR(sum, 1, 1e-15);
  EXPECT_LE((point.cast<double>() - Vector3d(hit.point)).norm(),
            1e-15 * (size + point.cast<double>().norm()));
  const double distance = (Vector3d(hit.point) - position).norm();
  EXPECT_NEAR(distance, std::abs(hit.distance), kTolerance * (size + distance));
  EXPECT_NEAR(Vector3d(hit.normal).norm(), 1, 1e-15);
}

inline void expect_same(const SurfaceHit& a, const SurfaceHit& b) {
  EXPECT_EQ(a.primitive, b.primitive);
  for (int k = 0; k < 3; ++k) {
    EXPECT_EQ(a.sites[k], b.sites[k]);
    EXPECT_EQ(a.weights[k], b.weights[k]);
    EXPECT_EQ(a.point[k], b.point[k]);
    EXPECT_EQ(a.normal[k], b.normal[k]);
  }
  EXPECT_EQ(a.distance, b.distance);
}

}  // namespace palpate::test::surface_bvh_fixture
