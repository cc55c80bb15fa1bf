// A scene at some of its sites, far from one another: what a report has time for.
#pragma once

#include <vector>

#include "offline/pipeline/carried_scene.hpp"

namespace palpate {

// So many of an organ's sites, or all where there are no more.
std::vector<size_t> compared_sites(const Organ& organ, int most);

// The organ again, touchable at these of its sites; a scene, at no more than so many.
LoadedScene with_sites(const Organ& organ, const std::vector<size_t>& sites);
LoadedScene with_at_most_sites(LoadedScene scene, int most);

}  // namespace palpate
