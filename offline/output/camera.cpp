#include "offline/output/camera.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

Eigen::AlignedBox3d bounding_box(std::span<const Eigen::Vector3d> points) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& point : points) box.extend(point);
  if (points.empty()) box.extend(Eigen::Vector3d::Zero());
  return box;
}

}  // namespace

ScreenPoint Camera::project(const Eigen::Vector3d& point) const {
  const Eigen::Vector3d from_eye = point - eye;
  const double nearness = 1.0 / from_eye.dot(forward);
  return {centre_x + pixels_per_slope * from_eye.dot(right) * nearness,
          centre_y - pixels_per_slope * from_eye.dot(up) * nearness, nearness};
}

Eigen::Vector3d perpendicular_to(const Eigen::Vector3d& unit) {
  Eigen::Index smallest = 0;
  unit.cwiseAbs().minCoeff(&smallest);
  return unit.cross(Eigen::Vector3d::Unit(smallest)).normalized();
}

double scene_radius(std::span<const Eigen::Vector3d> points) {
  const double radius = 0.5 * bounding_box(points).sizes().norm();
  return radius > 0 ? radius : 1.0;
}

Camera fit_camera(std::span<const Eigen::Vector3d> points, const Eigen::Vector3d& view,
                  const Eigen::Vector3d& up, int width, int height, double margin) {
  Camera camera;
  camera.forward = view.normalized();
  const Eigen::Vector3d sideways = camera.forward.cross(up.normalized());
  camera.right =
      sideways.norm() > 1e-6 ? Eigen::Vector3d(sideways.normalized()) : perpendicular_to(camera.forward);
  camera.up = camera.right.cross(camera.forward);

  // A distance of five radii gives the perspective of a long lens.
  const double radius = scene_radius(points);
  camera.eye = bounding_box(points).center() - 5.0 * radius * camera.forward;

  double left = -1e-9, right = 1e-9, top = -1e-9, bottom = 1e-9;  // slopes on the screen
  for (const Eigen::Vector3d& point : points) {
    const ScreenPoint seen = camera.project(point);
    left = std::min(left, seen.x);
    right = std::max(right, seen.x);
    top = std::min(top, seen.y);
    bottom = std::max(bottom, seen.y);
  }
  camera.pixels_per_slope =
      std::min((width - 2 * margin) / (right - left), (height - 2 * margin) / (bottom - top));
  camera.centre_x = 0.5 * width - 0.5 * (left + right) * camera.pixels_per_slope;
  camera.centre_y = 0.5 * height - 0.5 * (top + bottom) * camera.pixels_per_slope;
  return camera;
}

}  // namespace palpate
