// The picture of a touched organ, for a README, a report or a quick look: two panels from the same eye.
//
//     +------------------------------------------------+
//     | title                                          |
//     |                                                |
//     |      (organ,               (organ, ball   |#|  |    colours of the right panel:
//     |       tissue colour)        and arrow)    |#|  |    length of the displacement
//     |       at rest                 pushed           |
//     | caption                                        |
//     +------------------------------------------------+
//
// Drawn in software, so that it needs neither screen nor graphics driver, and the same input gives the same
// bytes (with the same fonts).
#pragma once

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "offline/output/canvas.hpp"

namespace palpate {

struct PictureTool {
  Eigen::Vector3d position;      // the touched point of the surface at rest, length unit
  Eigen::Vector3d displacement;  // of that point, length unit
  double radius = 0;  // of the tool's tip, length unit; where too small to be seen, a small ball is drawn
};

struct PictureInput {
  std::vector<Eigen::Vector3d> rest;          // positions of the nodes, length unit
  std::vector<Eigen::Vector3d> displacement;  // of the same nodes, length unit
  std::vector<std::array<int, 3>> triangles;  // indices in `rest`, counter-clockwise from outside
  std::vector<PictureTool> tools;
  std::string title;  // "" for none; so too the caption
  std::string caption;
  std::string length_unit;  // "mm"; "" where the model does not say
};

struct PictureOptions {
  int width = 1600;  // pixels, 200 to 10000
  int height = 800;
  std::optional<Eigen::Vector3d>
      view_direction;  // from the eye into the scene; empty: chosen from the first tool
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();  // points up in the picture
  std::string rest_label = "at rest";
  std::string pushed_label = "pushed";
};

// The picture as pixels, and as a PNG file that appears whole or not at all.
//
// Nodes on no triangle are not drawn and do not count for the camera or the colours. What is degenerate is
// drawn as far as it goes: no triangles give empty panels, no displacement gives one colour. Throws
// std::invalid_argument where sizes or indices do not fit or a number is not finite (it names the node),
// std::runtime_error "PATH: REASON" where the file cannot be written. Cost: about 2 s for 1600 x 800 on one
// core.
PixelImage draw_before_after(const PictureInput& input, const PictureOptions& options);
void write_before_after(const PictureInput& input, const PictureOptions& options,
                        const std::filesystem::path& png);

}  // namespace palpate
