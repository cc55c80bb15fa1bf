// Adds methods measured by other software to an organ's report.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "offline/report/report_data.hpp"

namespace palpate {

struct MethodsElsewhere {
  std::string file;
  std::string caption;  // content of FILE.txt beside FILE.csv, where present
  std::vector<MethodRow> rows;
};

// Reads a CSV with columns of methods_csv() (csv_tables.hpp). Required: name, contacts, fraction of the
// largest |d|, p95 and maximum errors, median, p99.9 and maximum times. Throws std::runtime_error "FILE:
// REASON; REMEDY" or "FILE:LINE: REASON; REMEDY".
MethodsElsewhere read_methods_elsewhere(const std::filesystem::path& csv);

// Adds the methods to the organ. Leaves out, with a note, methods whose contacts or |d| no method of the organ shares.
void add_methods_elsewhere(const MethodsElsewhere& elsewhere, OrganReport& organ);

}  // namespace palpate
