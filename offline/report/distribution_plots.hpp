// Plots error distributions of a pack's models, as gnuplot scripts with panels of displacement and force.
#pragma once

#include <string>

#include "offline/report/report_data.hpp"

namespace palpate {

// Plots for each error the fraction of the random pushes with no larger error.
std::string cumulative_plot(const OrganReport& organ);

// Plots the error of each random push against |d|, and the 95th percentile of each quarter of the range.
std::string error_over_push_plot(const OrganReport& organ);

// Plots the measured error of each push against the runtime's estimate.
std::string coverage_plot(const OrganReport& organ);

}  // namespace palpate
