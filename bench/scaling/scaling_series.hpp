// How something grows: points over a size, the exponent that they follow, and plots of them.
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace palpate::scaling {

struct Series {
  std::string panel;                              // of the plot, that it is drawn in
  std::string name;                               // "linear_dd, force"
  std::string size;                               // what x counts: "nodes"
  std::string unit;                               // of y: "µs"
  double expected = 1;                            // exponent of its largest part, from the operations
  std::vector<std::pair<double, double>> points;  // by rising x
};

// scaling.csv, scaling_points.csv, scaling.svg and scaling.txt, what they show, in `folder`.
void write_scaling(const std::vector<Series>& all, const std::string& caption,
                   const std::filesystem::path& folder);

}  // namespace palpate::scaling
