// Files that something else has written for a report.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace palpate {

struct CsvLine {
  int number = 0;  // in its file
  std::vector<std::string> cells;
};

// Lines that are not empty, the headings first: quoted cells may hold commas, and quotes twice; each line has as many
// cells as the first. Throws std::runtime_error "FILE: REASON" or "FILE:LINE: REASON" where it is no such table.
std::vector<CsvLine> read_csv(const std::filesystem::path& file);

// All of it. Throws std::runtime_error "FILE: cannot be read".
std::string read_whole_text(const std::filesystem::path& file);

// Of FILE.txt beside FILE.csv; "" where there is none.
std::string caption_beside(const std::filesystem::path& csv);

}  // namespace palpate
