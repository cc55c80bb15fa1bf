// Figure 6 of Zhong et al. 2005: three panels of an organ whose probe touches at T and was prepared for S.
//
//     +----------------------------------------------------+
//     | title                                              |
//     |    (field, S and    (field, S    (field, S   |#|   |     all panels from the same eye, with the
//     |     probe at T)      and T)       and T)     |#|   |     same colours: length of the displacement
//     |   label            label         label             |
//     +----------------------------------------------------+
#pragma once

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <string>
#include <vector>

namespace palpate::peers {

struct ElsewherePicture {
  std::vector<Eigen::Vector3d> rest;          // positions of the nodes, length unit
  std::vector<std::array<int, 3>> triangles;  // indices in `rest`, counter-clockwise from outside
  struct Panel {
    std::vector<Eigen::Vector3d> displacement;  // for each node, length unit
    std::string label;
  };
  std::array<Panel, 3> panels;
  int prepared = 0;            // S: a node
  int touched = 0;             // T: a node
  Eigen::Vector3d probe = {};  // displacement of the probe at T, length unit
  std::string title;
  std::string length_unit;
};

// Writes the file whole or not at all. Throws std::runtime_error "PATH: REASON".
void write_elsewhere_picture(const ElsewherePicture& picture, const std::filesystem::path& png);

}  // namespace palpate::peers
