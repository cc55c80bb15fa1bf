// Measures an organ for a report.
#pragma once

#include <cstdint>
#include <filesystem>

#include "offline/pipeline/carried_scene.hpp"
#include "offline/pipeline/opened_pack.hpp"
#include "offline/study/organ_measurements.hpp"
#include "offline/study/report_effort.hpp"

namespace palpate {

// Measures errors and times of a pack's models and of full Newton. `organ`: the scene that the pack was built
// from. Equal seeds give equal errors. Writes the error map `map` (PNG) where the pack has a surface.
OrganReport measure_organ(const OpenedPack& opened, const Organ& organ, const ReportEffort& effort,
                          std::int64_t seed, int jobs, const std::filesystem::path& map);

}  // namespace palpate
