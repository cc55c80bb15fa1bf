// Draws a touched organ for a README, a report or a quick look: two panels from the same eye.
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
// Drawn in software: needs no screen or graphics driver. Equal input and fonts give equal bytes.
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
  Eigen::Vector3d displacement;  // displacement of the touched point, length unit
  double radius = 0;             // radius of the tool's tip, length unit; a tiny radius is drawn larger
};

struct PictureInput {
  std::vector<Eigen::Vector3d> rest;          // positions of the nodes, length unit
  std::vector<Eigen::Vector3d> displacement;  // displacement of each node, length unit
  std::vector<std::array<int, 3>> triangles;  // indices in `rest`, counter-clockwise from outside
  std::vector<PictureTool> tools;
  std::string title;  // "" for none; also the caption
  std::string caption;
  std::string length_unit;  // "mm"; "" where the model states none
};

struct PictureOptions {
  int width = 1600;  // pixels, 200 to 10000
  int height = 800;
  std::optional<Eigen::Vector3d>
      view_direction;  // from the eye into the scene; empty: derived from the first tool
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();  // points up in the picture
  std::string rest_label = "at rest";
  std::string pushed_label = "pushed";
};

// Returns the picture as pixels, or writes a whole PNG file.
//
// Nodes without triangles influence neither camera nor colours. No triangles give empty panels; no
// displacement gives one colour. Throws std::invalid_argument, with the node, where sizes or indices do not
// match or a number is not finite. Throws std::runtime_error "PATH: REASON" where the file cannot be written.
PixelImage draw_before_after(const PictureInput& input, const PictureOptions& options);
void write_before_after(const PictureInput& input, const PictureOptions& options,
                        const std::filesystem::path& png);

}  // namespace palpate
