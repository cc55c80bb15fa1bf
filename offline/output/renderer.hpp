// Draws lit triangle meshes: visibility at 4 x 4 samples a pixel, shading once for each pixel and triangle.
#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>
#include <span>
#include <vector>

#include "offline/output/camera.hpp"
#include "offline/output/colour_map.hpp"

namespace palpate {

struct LitSurface {
  std::vector<Eigen::Vector3d> points;        // length unit
  std::vector<std::array<int, 3>> triangles;  // counter-clockwise from outside
  std::vector<double> values;                 // one for each point; interpolated before the map `colour`
  std::function<Colour(double)> colour;       // linear colour of a value
  double gloss = 0;                           // strength of the key light's highlight
  double mesh_lines = 0;                      // darkness of the lines along triangle edges, 0 to 1
};

// Linear red, green, blue, premultiplied by coverage, and coverage.
struct LinearImage {
  int width = 0;
  int height = 0;
  std::vector<std::array<double, 4>> pixels;
};

// Renders the surfaces. An empty scene gives zero coverage. Equal input gives equal bits.
LinearImage render(std::span<const LitSurface> surfaces, const Camera& camera, int width, int height);

}  // namespace palpate
