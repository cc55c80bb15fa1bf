// Fits y = factor x^exponent.
#pragma once

#include <utility>
#include <vector>

namespace palpate {

struct PowerLaw {
  double exponent = 0;
  double factor = 0;
};

// Fits by least squares in logarithms to points (x, y) with rising x. Uses the upper half of log x, where
// constant terms have faded, and at least the last two points. Needs two or more points, all positive.
PowerLaw fit_power_law(const std::vector<std::pair<double, double>>& points);

}  // namespace palpate
