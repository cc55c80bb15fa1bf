// The pressure under a tool, from the force of its patch.
#pragma once

#include <optional>

#include "offline/pipeline/opened_pack.hpp"

namespace palpate {

// Source: Zhong et al. 2005 eq. (7). A traction t that is constant over the patch gives each of its nodes t N dS of the
// triangles around it, a third of their area: together f = t A. The pressure is the part of t into the surface, on
// the surface of the mesh: model force unit / length unit^2. None where the pack shows no triangle at a node of the
// patch.
std::optional<double> patch_pressure(const OpenedPack& opened, std::uint32_t site, const double force[3]);

}  // namespace palpate
