// Models with every kind of element, and tolerances, for the tests of assembly.
#pragma once

#include "offline/fem/assembly.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "offline/mesh/volume_patches.hpp"
#include "tests/support/tetrahedral_block.hpp"

namespace palpate::assembly_fixture {

using test::affine_displacement;
using test::BlockShape;
using test::no_dofs;
using test::rotation_about;
using test::TestRandom;
using test::tetrahedral_block;
// Rounding of sums of a few dozen products.
inline constexpr double kRounding = 1e-13;

// Central differences with steps of 1e-5 of the block. Truncation: 1e-10 times higher derivatives of the
// energy. Rounding: eps / 1e-5 = 2e-11.
inline constexpr double kStep = 1e-5;

inline constexpr double kDifference = 1e-7;

// "Sharing": four-node elements in volume patches, or ten-node elements that are each a patch (C3D10H).
enum class Kind { four_nodes, ten_nodes, four_nodes_sharing, ten_nodes_sharing };

inline constexpr std::array kKinds = {Kind::four_nodes, Kind::ten_nodes, Kind::four_nodes_sharing,
                                      Kind::ten_nodes_sharing};

inline bool has_ten_nodes(Kind kind) {
  return kind == Kind::ten_nodes || kind == Kind::ten_nodes_sharing;
}

inline bool shares_volume(Kind kind) {
  return kind == Kind::four_nodes_sharing || kind == Kind::ten_nodes_sharing;
}

// Converts a four-node `model` to `kind`. A positive `jitter` curves the edges of ten-node elements.
inline Model in_kind(Kind kind, Model model, double jitter = 0.0) {
  if (has_ten_nodes(kind)) model = test::with_middle_nodes(std::move(model), jitter);
  if (!shares_volume(kind)) return model;
  std::vector<int> groups;
  for (const Tetrahedron& element : model.elements) groups.push_back(element.material);
  form_volume_patches(model, groups);
  return model;
}

inline Model several_materials(Kind kind = Kind::four_nodes) {
  BlockShape shape;
  shape.cells = {2, 2, 2};
  shape.size = {1.0, 1.25, 0.75};
  Model model = tetrahedral_block(shape);
  model.materials.push_back({"STIFF", CompressibleNeoHookean{2.4, 10.0}});
  // One material for each way to assemble a tangent: H alone, F and H (YEOH), and all 81 coefficients.
  model.materials.push_back({"YEOH", InvariantLaw{0.5, 0.0, 0.2, 0.05, {{0.8}}}});
  model.materials.push_back({"MOONEY-RIVLIN", InvariantLaw{0.4, 0.2, 0.0, 0.0, {{0.9}}}});
  // Volume patches do not cross materials, so elements that share volumes get longer runs of one material.
  const size_t in_a_row = shares_volume(kind) ? 12 : 1;
  if (shares_volume(kind)) model.materials[2].law = Ogden{{{0.7, 1.5}, {0.2, -2.5}}, {{0.8, 0.3, 0.1}}};
  for (size_t e = 0; e < model.elements.size(); ++e)
    model.elements[e].material = static_cast<int>(e / in_a_row % 4);
  return in_kind(kind, std::move(model), 0.02);
}

// A state of large shear, stretch and rotation, with a random displacement added at every node.
inline Eigen::VectorXd distorted(const Model& model) {
  Eigen::Matrix3d F;
  F << 1.2, 0.4, -0.1, 0.05, 0.8, 0.2, 0.1, -0.15, 0.9;
  // Ten-node elements have half the node spacing.
  const double noise = model.elements.front().num_nodes == 4 ? 0.05 : 0.01;
  return affine_displacement(model, rotation_about({1, 2, 3}, 1.1) * F) +
         noise * TestRandom(5).vector(model.num_dofs());
}

inline Eigen::MatrixXd dense_of(const Assembly::SparseLower& lower) {
  const Eigen::MatrixXd half(lower);
  return half.selfadjointView<Eigen::Lower>();
}

inline double stored_energy(const Assembly& assembly, const Eigen::VectorXd& displacement) {
  Eigen::VectorXd force;
  double energy = 0;
  assembly.internal_force(displacement, force, &energy);
  return energy;
}

}  // namespace palpate::assembly_fixture
