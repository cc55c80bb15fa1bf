// Includes a table of another program as a section of a report.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace palpate {

struct IncludedTable {
  std::string title;
  std::string name;                             // stem of its files
  std::string caption;                          // content of NAME.txt beside the CSV, where present
  std::vector<std::vector<std::string>> rows;   // headings first
  std::vector<std::filesystem::path> pictures;  // NAME.svg and NAME_*.svg beside the CSV, by name
  std::filesystem::path csv;
  std::vector<std::filesystem::path> more;  // NAME_*.csv beside the CSV, as further data
};

// Throws std::runtime_error like read_csv().
IncludedTable read_included_table(const std::string& title, const std::filesystem::path& csv);

// Copies CSVs and pictures into `folder` and returns HTML that contains them.
std::string write_included_table(const IncludedTable& table, const std::filesystem::path& folder);

}  // namespace palpate
