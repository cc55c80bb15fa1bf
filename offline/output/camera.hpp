// Places the eye and projects points on the screen.
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
  double pixels_per_slope = 1;  // pixels between rays whose slopes against `forward` differ by 1
  double centre_x = 0;          // the point of `forward` on the screen, pixels
  double centre_y = 0;

  // Returns pixels and the nearness 1 / depth, which is linear over a projected triangle.
  ScreenPoint project(const Eigen::Vector3d& point) const;
};

// Returns a camera along `view` (nonzero) that shows all points as large as the screen allows. `margin`
// pixels stay free on each side. `up` points up on the screen as far as possible; another direction replaces
// an `up` parallel to `view`. `points` may be empty.
Camera fit_camera(std::span<const Eigen::Vector3d> points, const Eigen::Vector3d& view,
                  const Eigen::Vector3d& up, int width, int height, double margin);

// Returns a unit vector perpendicular to `unit`, deterministically.
Eigen::Vector3d perpendicular_to(const Eigen::Vector3d& unit);

// Returns half the diagonal of the bounding box, the length scale of a picture; 1 where all points coincide.
double scene_radius(std::span<const Eigen::Vector3d> points);

}  // namespace palpate
