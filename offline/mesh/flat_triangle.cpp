#include "offline/mesh/flat_triangle.hpp"

#include <Eigen/Geometry>
#include <algorithm>

namespace palpate {

FlatTriangle::FlatTriangle(const std::array<Eigen::Vector3d, 3>& points) : corners(points) {
  for (std::size_t i = 0; i < 3; ++i)
    longest_edge = std::max(longest_edge, (points[(i + 1) % 3] - points[i]).norm());
  const Eigen::Vector3d cross = (points[1] - points[0]).cross(points[2] - points[0]);
  const double twice_area = cross.norm();
  normal = twice_area > 0 ? Eigen::Vector3d(cross / twice_area) : Eigen::Vector3d::Zero();
  least_altitude = longest_edge > 0 ? twice_area / longest_edge : 0;
}

double FlatTriangle::inside_edge(const Eigen::Vector3d& point, std::size_t corner) const {
  const Eigen::Vector3d& from = corners[(corner + 1) % 3];
  const Eigen::Vector3d edge = corners[(corner + 2) % 3] - from;
  return normal.dot(edge.cross(point - from)) / edge.norm();
}

// Sutherland and Hodgman 1974: each edge of `other` cuts away the area outside of it.
double common_area(const FlatTriangle& one, const FlatTriangle& other) {
  constexpr std::size_t kMostCorners = 3 + 3;  // a cut adds at most one corner to a convex polygon
  std::array<Eigen::Vector3d, kMostCorners> polygon;
  std::copy(one.corners.begin(), one.corners.end(), polygon.begin());
  std::size_t size = 3;
  for (std::size_t edge = 0; edge < 3; ++edge) {
    std::array<Eigen::Vector3d, kMostCorners> kept;
    std::size_t num_kept = 0;
    const auto keep = [&](const Eigen::Vector3d& point) {
      if (num_kept < kMostCorners) kept[num_kept++] = point;
    };
    for (std::size_t i = 0; i < size; ++i) {
      const Eigen::Vector3d& here = polygon[i];
      const Eigen::Vector3d& next = polygon[(i + 1) % size];
      const double a = other.inside_edge(here, edge);
      const double b = other.inside_edge(next, edge);
      if (a >= 0) keep(here);
      if ((a < 0) != (b < 0)) keep(here + (next - here) * (a / (a - b)));
    }
    polygon = kept;
    size = num_kept;
    if (size < 3) return 0;
  }
  Eigen::Vector3d twice_area = Eigen::Vector3d::Zero();
  for (std::size_t i = 2; i < size; ++i)
    twice_area += (polygon[i - 1] - polygon[0]).cross(polygon[i] - polygon[0]);
  return twice_area.norm() / 2;
}

bool pierces(const FlatTriangle& one, const FlatTriangle& other, double tolerance) {
  for (std::size_t i = 0; i < 3; ++i) {
    const Eigen::Vector3d& from = one.corners[i];
    const Eigen::Vector3d& to = one.corners[(i + 1) % 3];
    const double a = other.height(from);
    const double b = other.height(to);
    if (std::min(a, b) >= -tolerance || std::max(a, b) <= tolerance) continue;
    const Eigen::Vector3d point = from + (to - from) * (a / (a - b));
    if (other.inside_edge(point, 0) > tolerance && other.inside_edge(point, 1) > tolerance &&
        other.inside_edge(point, 2) > tolerance)
      return true;
  }
  return false;
}

}  // namespace palpate
