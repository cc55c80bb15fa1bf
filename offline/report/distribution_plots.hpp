// Plots the error distributions of the pack's models. Each plot is a gnuplot script with two panels:
// displacement and force.
#pragma once

#include <string>

#include "offline/report/report_data.hpp"

namespace palpate {

// Fraction of the random pushes with an error below each value.
std::string cumulative_plot(const OrganReport& organ);

// Error of each random push against |d|, and the 95th percentile of each quarter of the range.
std::string error_over_push_plot(const OrganReport& organ);

// The runtime's error estimate against the measured error of each push.
std::string coverage_plot(const OrganReport& organ);

}  // namespace palpate
