// Plots of speed: against error, with the front marked, and of frames alone. Scripts for gnuplot.
#pragma once

#include <string>
#include <vector>

#include "offline/report/report_data.hpp"

namespace palpate {

enum class SpeedError {
  field,  // haptic and visual frame against the displacement error
  force   // haptic frame against the force error
};

// One panel for each |d|, methods with so many contacts: 95th percentile of the error over the median of the time.
std::string speed_error_plot(const OrganReport& organ, SpeedError what, int contacts);

// What of `points` (time, error) no other is both as fast and as good as, by rising time.
std::vector<size_t> pareto_front(const std::vector<std::array<double, 2>>& points);

// Of each row of `organ.methods`, whether it is on the front of those of as many contacts and as far a push.
std::vector<bool> on_front(const OrganReport& organ, SpeedError what);

// Haptic and visual frames of the pack's own models: median to p99.9, maximum, cold, and memcpy beside.
std::string frame_plot(const OrganReport& organ);
int frame_plot_height(const OrganReport& organ);

}  // namespace palpate
