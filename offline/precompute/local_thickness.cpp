#include "offline/precompute/local_thickness.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <limits>

namespace palpate {

// Solves origin + t ray = a + v (b - a) + w (c - a) for `hit` = (t, v, w) at each triangle a, b, c.
double local_thickness(const Model& model, const Surface& surface, const ContactSite& site,
                       const Eigen::Vector3d& direction) {
  const Eigen::Vector3d& origin = model.positions[static_cast<size_t>(site.node)];
  const Eigen::Vector3d ray =
      direction.dot(site.inward) < 0 ? -direction.normalized() : Eigen::Vector3d(direction.normalized());
  constexpr double kNowhere = std::numeric_limits<double>::infinity();
  constexpr double kOnEdge = 1e-9;  // relative: a ray through an edge must meet a triangle beside the edge
  double nearest = kNowhere;
  bool leaves = false;
  for (const std::array<int, 3>& triangle : surface.triangles) {
    if (std::find(triangle.begin(), triangle.end(), site.node) != triangle.end()) continue;
    const auto corner = [&](size_t k) { return model.positions[static_cast<size_t>(triangle[k])]; };
    Eigen::Matrix3d system;
    system << ray, corner(0) - corner(1), corner(0) - corner(2);
    if (system.determinant() == 0) continue;
    const Eigen::Vector3d hit = system.inverse() * (corner(0) - origin);
    if (hit[0] <= 0 || hit[0] >= nearest || hit[1] < -kOnEdge || hit[2] < -kOnEdge ||
        hit[1] + hit[2] > 1 + kOnEdge)
      continue;
    nearest = hit[0];
    leaves = system.col(1).cross(system.col(2)).dot(ray) > 0;  // the ray leaves along the outward normal
  }
  return leaves ? nearest : kNowhere;
}

}  // namespace palpate
