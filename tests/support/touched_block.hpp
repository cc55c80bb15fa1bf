// A block on a fixed base with contact sites on its top: the smallest content of a pack.
#pragma once

#include <algorithm>
#include <numeric>

#include "offline/mesh/surface.hpp"
#include "offline/precompute/contact_sites.hpp"
#include "offline/precompute/scene.hpp"
#include "tests/support/tetrahedral_block.hpp"

namespace palpate::test {

struct TouchedBlock {
  Model model;
  Scene scene;
  ContactSites sites;
};

// Sites at the inner nodes of the top (z = 1), patches of radius `tip_radius`, all surface nodes packed.
inline TouchedBlock touched_block(int cells, double tip_radius, bool ten_nodes = false) {
  BlockShape shape;
  shape.cells = {cells, cells, cells};
  TouchedBlock block;
  Model mesh = tetrahedral_block(shape);
  block.model = with_fixed_base(ten_nodes ? with_middle_nodes(std::move(mesh)) : std::move(mesh));
  for (const int node : nodes_on_plane(block.model, 2, 1.0)) {
    const Eigen::Vector3d& at = block.model.positions[static_cast<std::size_t>(node)];
    if (at.x() > 1e-9 && at.x() < 1 - 1e-9 && at.y() > 1e-9 && at.y() < 1 - 1e-9)
      block.scene.sites.push_back(node);
  }
  block.scene.max_displacement = 0.15;
  block.scene.tip_radius = tip_radius;
  block.scene.output_nodes = extract_surface(block.model).nodes;
  block.sites = find_contact_sites(block.scene, block.model);
  return block;
}

// Packs all nodes of the block, interior nodes too.
inline void show_every_node(TouchedBlock& block) {
  block.scene.output_nodes.resize(static_cast<std::size_t>(block.model.num_nodes()));
  std::iota(block.scene.output_nodes.begin(), block.scene.output_nodes.end(), 0);
  block.sites = find_contact_sites(block.scene, block.model);
}

}  // namespace palpate::test
