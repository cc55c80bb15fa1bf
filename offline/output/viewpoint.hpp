// The automatic camera: from where a picture of a touched organ tells most.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <span>

#include "offline/output/tool_shape.hpp"

namespace palpate {

// Unit vector from the eye into the scene. With a tool: 50 to 65 degrees off its axis, on the outer side, so
// that a dent shows in near-profile; within that the place from which the tool is not hidden, the moved
// surface is seen obliquely, `up` stays up and the organ looks wide. Without: a three-quarter view from
// slightly above. `pushed` are the surface points after the motion, `distance` how far each has moved.
Eigen::Vector3d automatic_view(std::span<const Eigen::Vector3d> pushed,
                               std::span<const std::array<int, 3>> triangles,
                               std::span<const double> distance, const std::optional<PlacedTool>& tool,
                               const Eigen::Vector3d& up);

}  // namespace palpate
