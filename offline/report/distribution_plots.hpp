// Plots of how errors of a pack's own models are distributed. Scripts for gnuplot; two panels each, displacement and
// force.
#pragma once

#include <string>

#include "offline/report/report_data.hpp"

namespace palpate {

// How many of the random pushes are answered with less than an error.
std::string cumulative_plot(const OrganReport& organ);

// Error of each random push over |d|, and the 95th percentile of each quarter of its range.
std::string error_over_push_plot(const OrganReport& organ);

// What the runtime estimated for each push, and what it was.
std::string coverage_plot(const OrganReport& organ);

// 95th percentiles over |d| as part of the organ's thickness; all pushes of one contact.
std::string strain_plot(const OrganReport& organ);

}  // namespace palpate
