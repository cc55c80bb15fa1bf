// Draws pushes that the builder of a pack has not seen.
#pragma once

#include <cstdint>
#include <vector>

#include "offline/pipeline/opened_pack.hpp"
#include "offline/precompute/contact_sites.hpp"
#include "offline/precompute/scene.hpp"
#include "offline/precompute/site_survey.hpp"

namespace palpate {

// Returns the matrix that maps the unit ball to the sampled displacements of a site: length unit.
Eigen::Matrix3d sampled_domain(const OpenedPack& opened, const Scene& scene, const ContactSites& sites,
                               size_t site);

// Draws sites with equal probability and the same number of pushes in each quarter of the range.
std::vector<Push> draw_pushes(const OpenedPack& opened, const Scene& scene, const ContactSites& sites,
                              int count, std::int64_t seed);

}  // namespace palpate
