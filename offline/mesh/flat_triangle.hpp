// Distances, overlaps and crossings of triangles in space.
#pragma once

#include <Eigen/Core>
#include <array>

namespace palpate {

struct FlatTriangle {
  std::array<Eigen::Vector3d, 3> corners;
  Eigen::Vector3d normal;  // unit length, counter-clockwise; zero where the triangle is a line
  double longest_edge = 0;
  double least_altitude = 0;

  explicit FlatTriangle(const std::array<Eigen::Vector3d, 3>& points);

  // Returns the signed distance of a point from the plane.
  double height(const Eigen::Vector3d& point) const { return normal.dot(point - corners[0]); }

  // Returns the signed distance from the edge opposite to a corner, in the plane; positive inside.
  double inside_edge(const Eigen::Vector3d& point, std::size_t corner) const;
};

// Returns the area that two triangles of one plane have in common.
double common_area(const FlatTriangle& one, const FlatTriangle& other);

// Whether an edge of `one` passes through the inside of `other`, by more than `tolerance` on all sides.
bool pierces(const FlatTriangle& one, const FlatTriangle& other, double tolerance);

}  // namespace palpate
