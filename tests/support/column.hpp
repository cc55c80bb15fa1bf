// A slender organ, which bends.
#pragma once

#include <utility>
#include <vector>

#include "tests/support/zone_block.hpp"

namespace palpate::test {

// A column of 1 x 1 x 8, held at its foot and moved at its head.
inline ZoneBlock column(const Law& law, bool shares_volumes, double max_displacement = 0.15) {
  BlockShape shape;
  shape.cells = {2, 2, 16};
  shape.size = {1, 1, 8};
  TouchedBlock block;
  block.model = with_fixed_base(tetrahedral_block(shape));
  if (shares_volumes) form_volume_patches(block.model, std::vector<int>(block.model.elements.size(), 0));
  block.model.materials.front().law = law;
  for (const int node : nodes_on_plane(block.model, 2, shape.size.z())) {
    const Eigen::Vector3d& at = block.model.positions[static_cast<size_t>(node)];
    if ((at.head<2>() - Eigen::Vector2d(0.5, 0.5)).norm() < 1e-9) block.scene.sites.push_back(node);
  }
  block.scene.max_displacement = max_displacement;
  block.scene.tip_radius = 0.6;
  show_every_node(block);
  return ZoneBlock(1, std::move(block));
}

}  // namespace palpate::test
