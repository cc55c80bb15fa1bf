// Writes the report as one self-contained page.
#pragma once

#include <filesystem>

#include "offline/report/report_data.hpp"

namespace palpate {

// Writes `folder`/index.html and the linked CSVs. Throws std::runtime_error where a write or gnuplot fails.
void write_report(const Report& report, const std::filesystem::path& folder);

}  // namespace palpate
