// Measures what a report says of one organ.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "offline/pipeline/carried_scene.hpp"
#include "offline/pipeline/opened_pack.hpp"
#include "offline/precompute/sample_store.hpp"
#include "offline/study/organ_measurements.hpp"
#include "offline/study/report_effort.hpp"

namespace palpate {

// `organ` is what the pack was made from; `store`: where samples of it are kept, null: nowhere. Pushes come from
// `seed`; errors depend on nothing else, times on the machine. Writes the error map to `map` (PNG), where the pack
// has a surface to draw. Draws progress bars.
OrganReport measure_organ(const OpenedPack& opened, const Organ& organ, const SampleStore* store,
                          const ReportEffort& effort, std::int64_t seed, int jobs,
                          const std::filesystem::path& map);

}  // namespace palpate
