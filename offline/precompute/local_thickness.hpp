// The organ's thickness under a contact: strain is |d| / thickness, as in Zhong et al. 2005.
#pragma once

#include "offline/mesh/surface.hpp"
#include "offline/precompute/contact_sites.hpp"

namespace palpate {

// Returns the distance from the site to the exit from the organ along +`direction` or -`direction` (nonzero),
// the inward sign: length unit. Infinite where the ray does not pass through tissue.
double local_thickness(const Model& model, const Surface& surface, const ContactSite& site,
                       const Eigen::Vector3d& direction);

}  // namespace palpate
