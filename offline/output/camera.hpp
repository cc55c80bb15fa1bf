// Where the eye stands and what it is pointed at.
//
//            up
//            |   / forward (into the scene)
//            |  /
//     eye -> + ----- right          screen: x to the right, y down, in pixels from the upper left corner
#pragma once

#include <Eigen/Core>
#include <span>

#include "offline/output/rasteriser.hpp"

namespace palpate {

struct Camera {
  Eigen::Vector3d eye = Eigen::Vector3d::Zero();  // length unit
  Eigen::Vector3d right = Eigen::Vector3d::UnitX();
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  Eigen::Vector3d forward = Eigen::Vector3d::UnitY();
  double pixels_per_slope = 1;  // screen distance of two rays whose slopes against `forward` differ by one
  double centre_x = 0;          // where `forward` meets the screen, pixels
  double centre_y = 0;

  // Nearness is 1 / depth: linear over a projected triangle.
  ScreenPoint project(const Eigen::Vector3d& point) const;
};

// A camera that looks along `view` (any length but zero) and shows every one of `points` as large as a screen
// of width x height pixels allows, with `margin` pixels free on each side. `up` points up on the screen as
// far as it can; where it is parallel to `view`, another direction stands in. One point, or none, is shown
// too.
Camera fit_camera(std::span<const Eigen::Vector3d> points, const Eigen::Vector3d& view,
                  const Eigen::Vector3d& up, int width, int height, double margin);

// A unit vector perpendicular to `unit`, the same on every call.
Eigen::Vector3d perpendicular_to(const Eigen::Vector3d& unit);

// Half the diagonal of the bounding box, or 1 where all points coincide: the scale of everything drawn.
double scene_radius(std::span<const Eigen::Vector3d> points);

}  // namespace palpate
