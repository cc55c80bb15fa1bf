// The reference of a report: Newton's method on the full model, from the state of the frame before.
#pragma once

#include <cstdint>
#include <vector>

#include "offline/pipeline/carried_scene.hpp"
#include "offline/study/organ_measurements.hpp"

namespace palpate {

// Times frames in which all contacts at `sites` move together on a path at |d| = `part` times the largest
// |d|. The patches must share no node. Throws std::runtime_error where a frame has no equilibrium.
TimeSummary time_full_newton(const Organ& organ, const std::vector<std::uint32_t>& sites, double part,
                             int frames);

}  // namespace palpate
