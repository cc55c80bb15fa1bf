// The shape of a tool in a picture: a ball at the tissue and an arrow along its motion.
//
//   push:   ====>O|tissue          pull:   <====O|tissue       both are drawn outside of the tissue
#pragma once

#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

#include "offline/output/renderer.hpp"

namespace palpate {

// A tool after its motion.
struct PlacedTool {
  Eigen::Vector3d contact;      // the touched point after the motion, length unit
  Eigen::Vector3d outward;      // unit, away from the tissue: against a push, along a pull
  Eigen::Vector3d direction;    // unit, of the motion; zero where the tool has not moved
  double ball_radius = 0;       // length unit
  Eigen::Vector3d ball_centre;  // the ball's surface touches `contact`
  double arrow_length = 0;      // length unit; equal for all tools, since an arrow shows direction only
};

// Places the tool that touches `position` at rest and moves by `displacement`. A displacement against the
// outward normal of the nearest node is a push. `scale`: radius of the scene; tiny balls are enlarged.
PlacedTool place_tool(const Eigen::Vector3d& position, const Eigen::Vector3d& displacement, double radius,
                      std::span<const Eigen::Vector3d> rest, std::span<const std::array<int, 3>> triangles,
                      double scale);

// Returns ball and arrow as a surface to draw, in `colour` (linear).
LitSurface tool_surface(const PlacedTool& tool, const Colour& colour);

}  // namespace palpate
