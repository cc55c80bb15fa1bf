// Reduces a scene to a few distant sites, to bound the time of a report.
#pragma once

#include <vector>

#include "offline/pipeline/carried_scene.hpp"

namespace palpate {

// Chooses `most` sites of an organ, or all sites where the organ has fewer.
std::vector<size_t> compared_sites(const Organ& organ, int most);

// Returns the scene with at most `most` sites.
LoadedScene with_at_most_sites(LoadedScene scene, int most);

}  // namespace palpate
