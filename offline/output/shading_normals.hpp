// Computes normals for shading: smooth on gentle curvature, sharp across folds.
#pragma once

#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

namespace palpate {

// Unit normal of each triangle by its winding; zero for a triangle without area.
std::vector<Eigen::Vector3d> face_normals(std::span<const Eigen::Vector3d> points,
                                          std::span<const std::array<int, 3>> triangles);

// Returns a unit normal for each corner of each triangle: the mean of the faces around the point. Weights: the face's
// angle at the point, and its alignment with this triangle. Faces across a fold get no weight, so folds stay visible.
std::vector<std::array<Eigen::Vector3d, 3>> corner_normals(std::span<const Eigen::Vector3d> points,
                                                           std::span<const std::array<int, 3>> triangles);

}  // namespace palpate
