// The organ's thickness under a contact: strain is |d| / thickness, as in Zhong et al. 2005.
#pragma once

#include "offline/mesh/surface.hpp"
#include "offline/precompute/contact_sites.hpp"

namespace palpate {

// Returns the distance from the site along the inward one of +-`direction` (nonzero) to the organ's exit:
// length unit. Infinite where the line leaves at once. Cost: all triangles of the surface.
double local_thickness(const Model& model, const Surface& surface, const ContactSite& site,
                       const Eigen::Vector3d& direction);

}  // namespace palpate
