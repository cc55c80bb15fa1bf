// Values painted on an organ, one panel for each set of them, all seen from the same place:
//
//     +------------------------------------------------+
//     |  (organ)           |#|      (organ)        |#|  |
//     |   label                      label              |
//     +------------------------------------------------+
//
// Each panel has a scale of its own, from 0 to its largest value.
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
  std::vector<double> values;  // of each point, 0 or more
};

struct ValueMapPicture {
  std::vector<Eigen::Vector3d> points;        // length unit
  std::vector<std::array<int, 3>> triangles;  // indices in `points`, counter-clockwise from outside
  std::vector<ValueMap> maps;
  std::string bar_label;  // "% of |d|"
  Eigen::Vector3d towards =
      Eigen::Vector3d::Zero();  // about where the eye looks; zero: from the side and above
  int panel_width = 700;        // pixels
  int panel_height = 520;
};

// The file appears whole or not at all. Throws std::invalid_argument where sizes or indices do not fit or a number is
// not finite, std::runtime_error "PATH: REASON" where it cannot be written. Cost: about a second a panel.
void write_value_maps(const ValueMapPicture& picture, const std::filesystem::path& png);

}  // namespace palpate
