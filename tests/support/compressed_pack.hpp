// A block with sites on its whole free surface, with a dense and a compressed compliance. Most nodes are far
// from most panels, and a dense reference solve is still affordable.
#pragma once

#include <algorithm>

#include "offline/pack/pack_writer.hpp"
#include "tests/support/touched_block.hpp"

namespace palpate::test {

// A block of 10 x 10 x 10 cells on a fixed base. Every free surface node is a site; a patch has about five
// nodes.
class TouchedSurface {
 public:
  explicit TouchedSurface(int cells = 10) : block(make(cells)) {}

  AlignedBytes write(const LinearDd* linear, const CompressedCompliance* compressed,
                     const ZoneTables* zone = nullptr) const {
    PackContent content{block.model, block.scene, block.sites, linear,  nullptr,
                        false,       {},          {},          nullptr, compressed};
    content.zone = zone;
    return write_pack(content);
  }

  TouchedBlock block;
  Assembly assembly{block.model, block.model.fixed_dofs()};

 private:
  static TouchedBlock make(int cells) {
    BlockShape shape;
    shape.cells = {cells, cells, cells};
    TouchedBlock made;
    made.model = with_fixed_base(tetrahedral_block(shape));
    made.scene.max_displacement = 0.1;
    made.scene.tip_radius = 1.1 / cells;
    made.scene.max_contacts = 3;
    made.scene.output_nodes = extract_surface(made.model).nodes;
    for (const int node : made.scene.output_nodes) {
      if (made.model.positions[static_cast<size_t>(node)].z() > 1e-9) made.scene.sites.push_back(node);
    }
    std::sort(made.scene.sites.begin(), made.scene.sites.end());
    made.sites = find_contact_sites(made.scene, made.model);
    return made;
  }
};

inline const TouchedSurface& touched_surface() {
  static const TouchedSurface surface;
  return surface;
}

inline const LinearDd& dense_compliance() {
  static const LinearDd linear = compute_linear_dd(touched_surface().assembly, touched_surface().block.sites);
  return linear;
}

inline const CompressedCompliance& compressed_compliance() {
  static const CompressedCompliance compressed =
      compress_linear_dd(touched_surface().assembly, touched_surface().block.sites, kComplianceTolerance);
  return compressed;
}

inline const AlignedBytes& dense_surface_pack() {
  static const AlignedBytes bytes = touched_surface().write(&dense_compliance(), nullptr);
  return bytes;
}

inline const AlignedBytes& compressed_surface_pack() {
  static const AlignedBytes bytes = touched_surface().write(nullptr, &compressed_compliance());
  return bytes;
}

}  // namespace palpate::test
