// How far a site's patch can move before an element without a free node inverts.
//
// All nodes of such an element belong to the patch or are fixed. The solver has no choice there: a
// displacement d of the patch gives, at each integration point,
//   F = 1 + d g^T,   g = sum of dN_a/dX over the nodes a of the patch,   det F = 1 + d . g.
#pragma once

#include <vector>

#include "offline/precompute/contact_sites.hpp"

namespace palpate {

// Returns for each site the least |d| where det F falls to kLeastSampledJacobian: length unit; infinite where
// no element sets a limit. Laws at small strain set none. Ignores the sag under gravity.
std::vector<double> patch_reaches(const Scene& scene, const Model& model, const ContactSites& sites);

}  // namespace palpate
