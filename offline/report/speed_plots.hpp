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

// Plots the p95 of the error against the median time for `contacts` contacts, in a panel for each |d|.
std::string speed_error_plot(const OrganReport& organ, SpeedError quantity, int contacts);

// Returns the indices of the points (time, error) that no other point beats in both, by rising time.
std::vector<size_t> pareto_front(const std::vector<std::array<double, 2>>& points);

// Returns for each row of `organ.methods` whether the row is on the front of its number of contacts and |d|.
std::vector<bool> on_front(const OrganReport& organ, SpeedError quantity);

}  // namespace palpate
