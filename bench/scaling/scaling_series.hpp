// Series of a quantity over a size, with fitted exponents and plots.
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace palpate::scaling {

struct Series {
  std::string panel;                              // panel of the plot
  std::string name;                               // "linear_dd, force"
  std::string size;                               // quantity on the x axis: "nodes"
  std::string unit;                               // unit of y: "µs"
  double expected = 1;                            // exponent of the largest part, from operation counts
  std::vector<std::pair<double, double>> points;  // by rising x
};

// Writes scaling.csv, scaling_points.csv, scaling.svg and scaling.txt into `folder`.
void write_scaling(const std::vector<Series>& all, const std::string& caption,
                   const std::filesystem::path& folder);

}  // namespace palpate::scaling
