// Groups points that lie close together.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace palpate {

// Returns the lowest index in the group of each point. A chain of points, each closer than `length` to the
// next, is one group (single linkage). Cost: O(n log n) for the nodes of a mesh, also where points coincide.
std::vector<int> group_points(const std::vector<Eigen::Vector3d>& points, double length);

}  // namespace palpate
