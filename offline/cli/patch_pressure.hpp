// Computes the mean pressure under a tool from the force of its patch.
#pragma once

#include <optional>

#include "offline/pipeline/opened_pack.hpp"

namespace palpate {

// p = -f . n / A, from f = t A (Zhong et al. 2005 eq. (7)). A is the sum over nodes of a third of the area of
// their triangles, n the mean outward normal of these triangles. Unit: model force / length^2, on the mesh
// without load. Returns nothing where the pack has no triangle at a node of the patch.
std::optional<double> patch_pressure(const OpenedPack& opened, std::uint32_t site, const double force[3]);

}  // namespace palpate
