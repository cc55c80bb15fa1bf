// Paints values on an organ, one panel for each set of values, all from the same eye:
//
//     +------------------------------------------------+
//     |  (organ)           |#|      (organ)        |#|  |
//     |   label                      label              |
//     +------------------------------------------------+
//
// Each panel has its own scale, from 0 to its largest value.
#pragma once

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "offline/output/canvas.hpp"

namespace palpate {

struct ValueMap {
  std::string label;
  std::vector<double> values;  // one for each point, at least 0
};

struct ValueMapPicture {
  std::vector<Eigen::Vector3d> points;        // length unit
  std::vector<std::array<int, 3>> triangles;  // indices in `points`, counter-clockwise from outside
  std::vector<ValueMap> maps;
  std::string bar_label;                              // "% of |d|"
  Eigen::Vector3d towards = Eigen::Vector3d::Zero();  // direction of view; zero: from the side and above
  int panel_width = 700;                              // pixels
  int panel_height = 520;
};

// Writes the whole file or none. Throws std::invalid_argument where sizes or indices do not match or a number
// is not finite. Throws std::runtime_error "PATH: REASON" where the file cannot be written.
void write_value_maps(const ValueMapPicture& picture, const std::filesystem::path& png);

}  // namespace palpate
