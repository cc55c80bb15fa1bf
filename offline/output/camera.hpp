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

  // Nearness is 1 / depth, linear over a projected triangle.
  ScreenPoint project(const Eigen::Vector3d& point) const;
};

// Returns a camera along `view` (nonzero) that shows all points as large as the screen allows. `margin`
// pixels stay free on each side. `up` points up on the screen as far as possible; a parallel `up` is replaced
// by another direction. One point or none is valid.
Camera fit_camera(std::span<const Eigen::Vector3d> points, const Eigen::Vector3d& view,
                  const Eigen::Vector3d& up, int width, int height, double margin);

// Returns a unit vector perpendicular to `unit`, deterministically.
Eigen::Vector3d perpendicular_to(const Eigen::Vector3d& unit);

// Half the diagonal of the bounding box, or 1 where all points coincide: the length scale of the picture.
double scene_radius(std::span<const Eigen::Vector3d> points);

}  // namespace palpate
