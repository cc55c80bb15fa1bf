// Points of an equilibrium path, and the limit points between them.
#pragma once

#include <vector>

namespace palpate {

// An equilibrium on the path.
struct PathPoint {
  int increment = 0;
  double arc_length = 0;  // s of arc_length.hpp
  double load_factor = 0;
  double current_stiffness = 1;  // S of current_stiffness.hpp
  int negative_pivots = 0;  // of K, or of its symmetric part under pressures; 0 = stable under given loads
  double min_jacobian = 1;  // smallest det F
};

// Returns the load factors at the limit points of the load: vertices of parabolas through three points, of
// third order in the increments.
std::vector<double> limit_load_factors(const std::vector<PathPoint>& path);

}  // namespace palpate
