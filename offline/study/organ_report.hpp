// Measures an organ for a report.
#pragma once

#include <cstdint>
#include <filesystem>

#include "offline/pipeline/carried_scene.hpp"
#include "offline/pipeline/opened_pack.hpp"
#include "offline/study/organ_measurements.hpp"
#include "offline/study/report_effort.hpp"

namespace palpate {

// `organ` is the pack's source. `seed` draws the pushes and alone determines errors. Writes the error map to
// `map` (PNG) where the pack has a surface. Draws progress bars.
OrganReport measure_organ(const OpenedPack& opened, const Organ& organ, const ReportEffort& effort,
                          std::int64_t seed, int jobs, const std::filesystem::path& map);

}  // namespace palpate
