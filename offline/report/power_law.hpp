// How something grows with a size: y = factor x^exponent.
#pragma once

#include <utility>
#include <vector>

namespace palpate {

struct PowerLaw {
  double exponent = 0;
  double factor = 0;
};

// Least squares in logarithms over the points (x, y), by rising x, beyond the middle of the range of log x, where
// what does not grow has faded, and over the last two in any case. There are two or more, and all are positive.
PowerLaw fit_power_law(const std::vector<std::pair<double, double>>& points);

}  // namespace palpate
