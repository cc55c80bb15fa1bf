#include "offline/output/shading_normals.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>

namespace palpate {
namespace {

// Cosines of the angle between two faces: full blending below 25 degrees, none above 65 degrees.
constexpr double kSmooth = 0.906;
constexpr double kFolded = 0.423;
constexpr double kFaceShare = 0.2;  // weight of the flat normal in every corner; keeps facets readable

std::size_t slot(int i) {
  return static_cast<std::size_t>(i);
}

}  // namespace

std::vector<Eigen::Vector3d> face_normals(std::span<const Eigen::Vector3d> points,
                                          std::span<const std::array<int, 3>> triangles) {
  std::vector<Eigen::Vector3d> normals;
  normals.reserve(triangles.size());
  for (const auto& [a, b, c] : triangles) {
    const Eigen::Vector3d ab = points[slot(b)] - points[slot(a)];
    const Eigen::Vector3d ac = points[slot(c)] - points[slot(a)];
    normals.push_back(ab.cross(ac).stableNormalized());
  }
  return normals;
}

std::vector<std::array<Eigen::Vector3d, 3>> corner_normals(std::span<const Eigen::Vector3d> points,
                                                           std::span<const std::array<int, 3>> triangles) {
  const std::vector<Eigen::Vector3d> faces = face_normals(points, triangles);

  struct Corner {
    std::size_t triangle;
    double angle;  // angle of the triangle at this point, radians
  };
  std::vector<std::vector<Corner>> corners_at(points.size());
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Eigen::Vector3d& here = points[slot(triangles[t][k])];
      const Eigen::Vector3d next = (points[slot(triangles[t][(k + 1) % 3])] - here).stableNormalized();
      const Eigen::Vector3d last = (points[slot(triangles[t][(k + 2) % 3])] - here).stableNormalized();
      corners_at[slot(triangles[t][k])].push_back({t, std::acos(std::clamp(next.dot(last), -1.0, 1.0))});
    }
  }

  std::vector<std::array<Eigen::Vector3d, 3>> normals(triangles.size());
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      for (const Corner& corner : corners_at[slot(triangles[t][k])]) {
        const double ramp =
            std::clamp((faces[t].dot(faces[corner.triangle]) - kFolded) / (kSmooth - kFolded), 0.0, 1.0);
        sum += ramp * ramp * (3.0 - 2.0 * ramp) * corner.angle * faces[corner.triangle];
      }
      const Eigen::Vector3d smooth = sum.norm() > 0 ? Eigen::Vector3d(sum.normalized()) : faces[t];
      normals[t][k] = ((1.0 - kFaceShare) * smooth + kFaceShare * faces[t]).stableNormalized();
    }
  }
  return normals;
}

}  // namespace palpate
