#include "offline/output/viewpoint.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>

#include "offline/output/camera.hpp"

namespace palpate {
namespace {

constexpr int kAzimuths = 48;
constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kElevation = 0.34;  // sine of the preferred elevation of the eye
constexpr double kFacing = 0.5;      // preferred result of facing()

// Whether the ray from `origin` meets a triangle. Source: Moeller and Trumbore 1997, Fast, minimum storage
// ray-triangle intersection.
bool is_blocked(const Eigen::Vector3d& origin, const Eigen::Vector3d& ray,
                std::span<const Eigen::Vector3d> points, std::span<const std::array<int, 3>> triangles) {
  for (const auto& [a, b, c] : triangles) {
    const Eigen::Vector3d& corner = points[static_cast<std::size_t>(a)];
    const Eigen::Vector3d first = points[static_cast<std::size_t>(b)] - corner;
    const Eigen::Vector3d second = points[static_cast<std::size_t>(c)] - corner;
    const Eigen::Vector3d across = ray.cross(second);
    const double determinant = first.dot(across);
    if (determinant == 0.0) continue;
    const Eigen::Vector3d from_corner = origin - corner;
    const double u = from_corner.dot(across) / determinant;
    const Eigen::Vector3d turned = from_corner.cross(first);
    const double v = ray.dot(turned) / determinant;
    if (u >= 0 && v >= 0 && u + v <= 1 && second.dot(turned) / determinant > 0) return true;
  }
  return false;
}

// Returns the extent of the points along a unit vector, length unit.
double extent(std::span<const Eigen::Vector3d> points, const Eigen::Vector3d& along) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const Eigen::Vector3d& point : points) {
    low = std::min(low, point.dot(along));
    high = std::max(high, point.dot(along));
  }
  return points.empty() ? 0.0 : high - low;
}

// Returns the mean of max(0, cosine of normal and way to the eye), weighted with displacement and area.
double facing(std::span<const Eigen::Vector3d> points, std::span<const std::array<int, 3>> triangles,
              std::span<const double> distance, const Eigen::Vector3d& view) {
  double sum = 0, weight = 0;
  for (const auto& [a, b, c] : triangles) {
    const auto first = static_cast<std::size_t>(a), second = static_cast<std::size_t>(b),
               third = static_cast<std::size_t>(c);
    const Eigen::Vector3d area = (points[second] - points[first]).cross(points[third] - points[first]);
    const double moved = distance[first] + distance[second] + distance[third];
    sum += moved * std::max(0.0, -area.dot(view));
    weight += moved * area.norm();
  }
  return weight > 0 ? sum / weight : kFacing;
}

}  // namespace

Eigen::Vector3d automatic_view(std::span<const Eigen::Vector3d> pushed,
                               std::span<const std::array<int, 3>> triangles,
                               std::span<const double> distance, const std::optional<PlacedTool>& tool,
                               const Eigen::Vector3d& up) {
  const Eigen::Vector3d upward = up.normalized();
  if (!tool) {
    const Eigen::Vector3d aside = perpendicular_to(upward);
    return (0.75 * aside + 0.55 * upward.cross(aside) - 0.38 * upward).normalized();
  }
  const double radius = scene_radius(pushed);
  const Eigen::Vector3d inward = -tool->outward;
  const Eigen::Vector3d first = perpendicular_to(inward);
  const Eigen::Vector3d second = inward.cross(first);
  Eigen::Vector3d best = inward;
  double best_score = -std::numeric_limits<double>::infinity();
  for (int i = 0; i < 3 * kAzimuths; ++i) {
    const int ring = i / kAzimuths;
    const double off_axis = (50.0 + 7.5 * ring) * kDegree;  // 50 to 65 degrees
    const double azimuth = 2.0 * std::numbers::pi * (i % kAzimuths) / kAzimuths;
    const Eigen::Vector3d view =
        std::cos(off_axis) * inward +
        std::sin(off_axis) * (std::cos(azimuth) * first + std::sin(azimuth) * second);
    // Visibility of ball and arrow dominates all other criteria.
    double seen = 0;
    for (const double place : {0.5, 1.0, 2.0})
      if (!is_blocked(tool->contact + place * tool->ball_radius * tool->outward, -view, pushed, triangles))
        seen += 1;
    const double elevation = -view.dot(upward) - kElevation;
    const Eigen::Vector3d sideways = view.cross(upward);
    const double width =
        sideways.norm() > 1e-6 ? extent(pushed, sideways.normalized()) / (2.0 * radius) : 0.0;
    const double facing_error = facing(pushed, triangles, distance, view) - kFacing;
    const double score = seen - 1.5 * elevation * elevation - 4.0 * facing_error * facing_error + 0.6 * width;
    if (score > best_score) {
      best_score = score;
      best = view;
    }
  }
  return best;
}

}  // namespace palpate
