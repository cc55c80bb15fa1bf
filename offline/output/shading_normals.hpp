// Computes normals for shading: smooth on gentle curvature, sharp across folds.
#pragma once

#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

namespace palpate {

// Returns the unit normal of each triangle by its winding; zero for a triangle without area.
std::vector<Eigen::Vector3d> face_normals(std::span<const Eigen::Vector3d> points,
                                          std::span<const std::array<int, 3>> triangles);

// Returns a unit normal for each corner of each triangle: the weighted mean of the faces around the corner.
// The weight is a face's angle times its alignment with this triangle. Faces across a fold weigh 0.
std::vector<std::array<Eigen::Vector3d, 3>> corner_normals(std::span<const Eigen::Vector3d> points,
                                                           std::span<const std::array<int, 3>> triangles);

}  // namespace palpate
