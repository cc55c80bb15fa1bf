// Computes the mean pressure under a tool from the force of its patch.
#pragma once

#include <optional>

#include "offline/pipeline/opened_pack.hpp"

namespace palpate {

// p = -f . n / A, from f = t A (Zhong et al. 2005 eq. (7)). A traction t, constant over the patch, gives each
// node t times a third of the area of its triangles. Unit: model force / length^2, on the mesh at rest.
// Returns nothing where the pack shows no triangle at a node of the patch.
std::optional<double> patch_pressure(const OpenedPack& opened, std::uint32_t site, const double force[3]);

}  // namespace palpate
