// Methods that something else has measured on an organ, other software for one, beside those of its report.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "offline/report/report_data.hpp"

namespace palpate {

struct MethodsElsewhere {
  std::string file;
  std::string caption;  // of FILE.txt beside FILE.csv, where there is one
  std::vector<MethodRow> rows;
};

// From a CSV with columns of methods_csv (csv_tables.hpp): what a method is called, its contacts and its part of the
// largest |d|, p95 and maximum of its errors, median, p99.9 and maximum of its frames; others where it has them. Throws
// std::runtime_error "FILE: REASON; REMEDY" or "FILE:LINE: REASON; REMEDY".
MethodsElsewhere read_methods_elsewhere(const std::filesystem::path& csv);

// Adds them to the organ's methods; in a note, those are left out that nothing can be compared with, as the organ's
// own methods were asked with other contacts or at another |d|.
void add_methods_elsewhere(const MethodsElsewhere& elsewhere, OrganReport& organ);

}  // namespace palpate
