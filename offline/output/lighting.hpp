// Computes the light at points of the scene from many distant lamps with shadows.
//
// A dome of faint lamps is the sky and darkens fissures (ambient occlusion). A tight bunch is the key light
// with soft shadows; a bunch from behind, the rim light, lights the silhouette. Cost: lamps * points.
#pragma once

#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

#include "offline/output/colour_map.hpp"

namespace palpate {

struct Camera;

struct Lamp {
  Eigen::Vector3d towards;  // unit vector from the scene to the lamp
  Colour light;             // linear
  bool is_key = false;
};

// Returns the studio: key light over the viewer's left shoulder, all lamps turned with the camera. A white
// matt surface half-way between viewer and key light receives a little more than 1.
std::vector<Lamp> studio_lamps(const Camera& camera);
Eigen::Vector3d key_direction(const Camera& camera);  // unit vector from the scene towards the key light

struct LitPoint {
  Eigen::Vector3d position;
  Eigen::Vector3d normal;       // for shading, unit, on the viewer's side
  Eigen::Vector3d face_normal;  // normal of the flat triangle, unit, on the viewer's side
};

struct ReceivedLight {
  Colour diffuse = {0, 0, 0};  // linear; lamps weighted with the cosine
  double key_visibility = 0;   // fraction of the key light's lamps that the point sees, 0 to 1
};

// Returns the light at each point of `lit`. `points` and `triangles` cast the shadows.
std::vector<ReceivedLight> receive_light(std::span<const LitPoint> lit, std::span<const Lamp> lamps,
                                         std::span<const Eigen::Vector3d> points,
                                         std::span<const std::array<int, 3>> triangles);

}  // namespace palpate
