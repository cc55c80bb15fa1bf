// The report as one page that needs nothing beside it.
#pragma once

#include <filesystem>

#include "offline/report/report_data.hpp"

namespace palpate {

// Writes `folder`/index.html, with plots and pictures in it, and the CSVs that it links to. Throws std::runtime_error
// where a file cannot be written or gnuplot complains.
void write_report(const Report& report, const std::filesystem::path& folder);

}  // namespace palpate
