// How thick the organ is under a contact: what |d| is divided by to be a strain, as in Zhong et al. 2005.
#pragma once

#include "offline/mesh/surface.hpp"
#include "offline/precompute/contact_sites.hpp"

namespace palpate {

// From the site along `direction` (any length but zero), or against it where that leads inward, to where the line
// leaves the organ: length unit. Infinite where it leads out of it at once. Cost: all triangles of the surface.
double local_thickness(const Model& model, const Surface& surface, const ContactSite& site,
                       const Eigen::Vector3d& direction);

}  // namespace palpate
