// Inclusions, and the full solve of an organ that contains one.
#pragma once

#include "tests/support/zone_block.hpp"

namespace palpate::test {

inline pal_inclusion ball(const Eigen::Vector3d& centre, double radius, double stiffness) {
  return {sizeof(pal_inclusion), 0, {centre[0], centre[1], centre[2]}, radius, stiffness};
}

// The definition in palpate.h: a cubic over an edge, with half of the change at the radius.
inline double stiffness_at(const pal_inclusion& inclusion, double edge, const Eigen::Vector3d& point) {
  const double depth = (inclusion.radius - (point - Eigen::Vector3d(inclusion.centre)).norm()) / edge;
  const double t = std::clamp(depth + 0.5, 0.0, 1.0);
  return 1 + (inclusion.stiffness - 1) * (3 * t * t - 2 * t * t * t);
}

// The full solve of an organ in which each element has its own stiffness.
inline ContactAnswer solve_with(const ZoneBlock& organ, const pal_inclusion& inclusion,
                                const std::vector<pal_contact>& contacts) {
  TouchedBlock block = organ.block;
  const Material tissue = block.model.materials.front();
  block.model.materials.clear();
  for (Tetrahedron& element : block.model.elements) {
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    for (size_t k = 0; k < 4; ++k)
      centre += 0.25 * block.model.positions[static_cast<size_t>(element.nodes()[k])];
    const double part = stiffness_at(inclusion, block.sites.mean_surface_edge, centre);
    element.material = static_cast<int>(block.model.materials.size());
    Material own = tissue;
    own.law = CompressibleNeoHookean{part * kTissue.mu, part * kTissue.lambda};
    block.model.materials.push_back(own);
  }
  const Assembly assembly(block.model, block.model.fixed_dofs());
  return solve_contacts(block, assembly, organ.rest, contacts);
}

}  // namespace palpate::test
