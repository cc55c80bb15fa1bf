// A table that something else has measured, as a section of a report's page.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace palpate {

struct IncludedTable {
  std::string title;
  std::string name;                             // of its files, without ending
  std::string caption;                          // of NAME.txt beside the CSV, where there is one
  std::vector<std::vector<std::string>> rows;   // the headings first
  std::vector<std::filesystem::path> pictures;  // NAME.svg and NAME_*.svg beside it, by name
  std::filesystem::path csv;
  std::vector<std::filesystem::path> more;  // NAME_*.csv beside it, what else there is to read
};

// Throws std::runtime_error as read_csv does.
IncludedTable read_included_table(const std::string& title, const std::filesystem::path& csv);

// Copies its CSVs and pictures into `folder`, and returns HTML that carries them.
std::string write_included_table(const IncludedTable& table, const std::filesystem::path& folder);

}  // namespace palpate
