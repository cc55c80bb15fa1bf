// Normals for shading: smooth over gentle curvature, sharp across folds.
#pragma once

#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

namespace palpate {

// Unit normal of each triangle, by its winding; zero for a triangle without area.
std::vector<Eigen::Vector3d> face_normals(std::span<const Eigen::Vector3d> points,
                                          std::span<const std::array<int, 3>> triangles);

// A unit normal for each corner of each triangle: the mean of the faces around that point, weighted by their
// angle there, and by how nearly they face the same way as this triangle. Faces across a fold (a fissure of a
// brain, the rim of a dent) drop out, so folds stay visible.
std::vector<std::array<Eigen::Vector3d, 3>> corner_normals(std::span<const Eigen::Vector3d> points,
                                                           std::span<const std::array<int, 3>> triangles);

}  // namespace palpate
