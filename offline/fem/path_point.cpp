#include "offline/fem/path_point.hpp"

#include <cstddef>

namespace palpate {

std::vector<double> limit_load_factors(const std::vector<PathPoint>& path) {
  std::vector<double> found;
  for (std::size_t i = 2; i < path.size(); ++i) {
    const PathPoint& a = path[i - 2];
    const PathPoint& b = path[i - 1];
    const PathPoint& c = path[i];
    const double slope_before = (b.load_factor - a.load_factor) / (b.arc_length - a.arc_length);
    const double slope_after = (c.load_factor - b.load_factor) / (c.arc_length - b.arc_length);
    if ((slope_before < 0) == (slope_after < 0)) continue;
    // l = l_b + slope (s - s_b) + curvature (s - s_b)^2
    const double curvature = (slope_after - slope_before) / (c.arc_length - a.arc_length);
    const double slope = slope_before + curvature * (b.arc_length - a.arc_length);
    found.push_back(b.load_factor - slope * slope / (4 * curvature));
  }
  return found;
}

}  // namespace palpate
