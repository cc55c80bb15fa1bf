// Plots speed against error with the Pareto front, as gnuplot scripts.
#pragma once

#include <string>
#include <vector>

#include "offline/report/report_data.hpp"

namespace palpate {

enum class SpeedError {
  field,  // time of haptic and visual frame, displacement error
  force   // time of the haptic frame, force error
};

// One panel for each |d| with `contacts` contacts: 95th percentile of the error against the median time.
std::string speed_error_plot(const OrganReport& organ, SpeedError what, int contacts);

// Returns the points (time, error) that no other point beats in both, by rising time.
std::vector<size_t> pareto_front(const std::vector<std::array<double, 2>>& points);

// For each row of `organ.methods`: whether it is on the front of its number of contacts and its |d|.
std::vector<bool> on_front(const OrganReport& organ, SpeedError what);

}  // namespace palpate
