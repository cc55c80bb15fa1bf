// Pushes that the builder of a pack has not seen.
#pragma once

#include <cstdint>
#include <vector>

#include "offline/pipeline/opened_pack.hpp"
#include "offline/precompute/contact_sites.hpp"
#include "offline/precompute/scene.hpp"
#include "offline/precompute/site_survey.hpp"

namespace palpate {

// From the unit ball to the displacements that were sampled at a site, length unit.
Eigen::Matrix3d sampled_domain(const OpenedPack& opened, const Scene& scene, const ContactSites& sites,
                               size_t site);

// At sites drawn with the same chance, as many in each quarter of the range.
std::vector<Push> draw_pushes(const OpenedPack& opened, const Scene& scene, const ContactSites& sites,
                              int count, std::int64_t seed);

}  // namespace palpate
