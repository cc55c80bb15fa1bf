// Reduces a scene to a few distant sites, to bound the time of a report.
#pragma once

#include <vector>

#include "offline/pipeline/carried_scene.hpp"

namespace palpate {

// Chooses `count` sites of an organ, or all sites where the organ has fewer.
std::vector<size_t> compared_sites(const Organ& organ, int most);

// Returns the organ with only these sites; returns the scene with at most `count` sites.
LoadedScene with_sites(const Organ& organ, const std::vector<size_t>& sites);
LoadedScene with_at_most_sites(LoadedScene scene, int most);

}  // namespace palpate
