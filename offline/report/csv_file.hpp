// Reads CSV files of other programs for a report.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace palpate {

struct CsvLine {
  int number = 0;  // line number in the file
  std::vector<std::string> cells;
};

// Reads non-empty lines, headings first. Quoted cells may hold commas and doubled quotes. All lines need the
// same number of cells. Throws std::runtime_error "FILE: REASON" or "FILE:LINE: REASON".
std::vector<CsvLine> read_csv(const std::filesystem::path& file);

// Throws std::runtime_error "FILE: cannot be read".
std::string read_whole_text(const std::filesystem::path& file);

// Reads FILE.txt beside FILE.csv; "" without such a file.
std::string caption_beside(const std::filesystem::path& csv);

}  // namespace palpate
