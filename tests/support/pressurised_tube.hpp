// A thick tube of nearly incompressible tissue under internal pressure: a quarter, in plane strain.
//
//   y ^
//     |####___          inner radius 1, outer 2, one unit deep; z is held everywhere
//     |###     \        x is held on the plane x = 0, y on y = 0
//     +  \ p     \      p follows the inner face
//         |#######|--> x
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "offline/mesh/element_faces.hpp"
#include "tests/support/locking_scenes.hpp"

namespace palpate::test {

inline constexpr double kTubeInner = 1.0;
inline constexpr double kTubeOuter = 2.0;

// Pressure of an incompressible neo-Hookean tube with shear modulus mu (Rivlin 1949). Every material circle
// keeps r^2 - R^2 = c. With L = r / R, equilibrium is d sigma_r / dr = mu (L^2 - L^-2) / r:
//   p / mu = ln(L_a / L_b) + c / 2 (1 / a^2 - 1 / b^2),   a, b: current inner and outer radius.
inline double tube_pressure(double shear, double inner_displacement) {
  const double a = kTubeInner + inner_displacement;
  const double c = a * a - kTubeInner * kTubeInner;
  const double b = std::sqrt(kTubeOuter * kTubeOuter + c);
  return shear * (std::log(a / kTubeInner * kTubeOuter / b) + 0.5 * c * (1 / (a * a) - 1 / (b * b)));
}

struct Tube {
  Model model;  // held on its symmetry planes, with the volume patches of `elements`
  std::vector<std::pair<int, int>> inside;  // (element, face)
  std::vector<int> inner_nodes;
};

// `cells` through the wall, twice as many around, one deep. Middle nodes lie on the circles.
inline Tube pressurised_tube(int cells, Elements elements, const Law& law) {
  BlockShape shape;
  shape.cells = {cells, 2 * cells, 1};
  shape.jitter = 0;
  shape.law = law;
  Tube tube;
  Model block = in_nodes_of(elements, tetrahedral_block(shape));
  tube.inner_nodes = nodes_on_plane(block, 0, 0.0);
  std::vector<PrescribedDisplacement> fixed;
  fixed.reserve(static_cast<size_t>(2 * block.num_nodes()));
  for (int node = 0; node < block.num_nodes(); ++node) fixed.push_back({node, 2, 0.0});
  for (const int node : nodes_on_plane(block, 1, 0.0)) fixed.push_back({node, 1, 0.0});
  for (const int node : nodes_on_plane(block, 1, 1.0)) fixed.push_back({node, 0, 0.0});
  for (Eigen::Vector3d& position : block.positions) {
    const double radius = kTubeInner + (kTubeOuter - kTubeInner) * position.x();
    const double angle = 0.5 * std::numbers::pi * position.y();
    position = {radius * std::cos(angle), radius * std::sin(angle), position.z()};
  }
  block.fixed = std::move(fixed);
  tube.model = share_volumes(elements, std::move(block));
  for (int element = 0; element < static_cast<int>(tube.model.elements.size()); ++element) {
    for (int face = 0; face < 4; ++face) {
      const std::array<int, 6> nodes =
          outward_face(tube.model.elements[static_cast<std::size_t>(element)], face);
      if (std::all_of(nodes.begin(), nodes.begin() + 3, [&](int node) {
            return std::binary_search(tube.inner_nodes.begin(), tube.inner_nodes.end(), node);
          }))
        tube.inside.emplace_back(element, face);
    }
  }
  return tube;
}

// The mean radial displacement of the inner face's nodes.
inline double tube_opening(const Tube& tube, const Eigen::VectorXd& displacement) {
  double sum = 0;
  for (const int node : tube.inner_nodes) {
    const Eigen::Vector3d& at = tube.model.positions[static_cast<std::size_t>(node)];
    sum += at.head<2>().normalized().dot(displacement.segment<2>(3 * node));
  }
  return sum / static_cast<double>(tube.inner_nodes.size());
}

}  // namespace palpate::test
