#include "offline/report/power_law.hpp"

#include <cmath>

namespace palpate {

PowerLaw fit_power_law(const std::vector<std::pair<double, double>>& points) {
  const double middle = std::sqrt(points.front().first * points.back().first);
  const size_t last_two = points.size() - 2;
  double sum_x = 0;
  double sum_y = 0;
  double sum_xx = 0;
  double sum_xy = 0;
  int count = 0;
  for (size_t i = 0; i < points.size(); ++i) {
    if (points[i].first < middle && i < last_two) continue;
    const double x = std::log(points[i].first);
    const double y = std::log(points[i].second);
    sum_x += x;
    sum_y += y;
    sum_xx += x * x;
    sum_xy += x * y;
    ++count;
  }
  const double exponent = (count * sum_xy - sum_x * sum_y) / (count * sum_xx - sum_x * sum_x);
  return {exponent, std::exp((sum_y - exponent * sum_x) / count)};
}

}  // namespace palpate
