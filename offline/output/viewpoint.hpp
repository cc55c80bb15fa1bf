// Chooses the camera of a picture of a touched organ.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <span>

#include "offline/output/tool_shape.hpp"

namespace palpate {

// Returns a unit vector from the eye into the scene. With a tool: 50 to 65 degrees off its axis, on the outer
// side, so that a dent shows in profile. The choice prefers a visible tool, an oblique moved
// surface, an upright `up` and a wide organ. Without a tool: a three-quarter view from above. `pushed`:
// surface points after the motion; `distance`: length of each point's motion.
Eigen::Vector3d automatic_view(std::span<const Eigen::Vector3d> pushed,
                               std::span<const std::array<int, 3>> triangles,
                               std::span<const double> distance, const std::optional<PlacedTool>& tool,
                               const Eigen::Vector3d& up);

}  // namespace palpate
