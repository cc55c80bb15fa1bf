#include "offline/report/csv_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "offline/mesh/text_file.hpp"

namespace palpate {
namespace {

std::vector<std::string> cells_of(const std::string& line, const std::string& place) {
  std::vector<std::string> cells(1);
  bool quoted = false;
  for (size_t i = 0; i < line.size(); ++i) {
    if (line[i] == '"' && quoted && i + 1 < line.size() && line[i + 1] == '"') {
      cells.back() += line[++i];
    } else if (line[i] == '"') {
      quoted = !quoted;
    } else if (line[i] == ',' && !quoted) {
      cells.emplace_back();
    } else {
      cells.back() += line[i];
    }
  }
  if (quoted) throw std::runtime_error(place + ": a quote is not closed; end it on its line");
  return cells;
}

}  // namespace

std::vector<CsvLine> read_csv(const std::filesystem::path& file) {
  const std::string text = read_whole_text(file);
  std::vector<CsvLine> lines;
  int number = 0;
  for (size_t from = 0; from < text.size();) {
    const size_t end = std::min(text.find('\n', from), text.size());
    std::string line = text.substr(from, end - from);
    from = end + 1;
    ++number;
    if (line.ends_with('\r')) line.pop_back();
    if (line.empty()) continue;
    const std::string place = fmt::format("{}:{}", file.string(), number);
    lines.push_back({number, cells_of(line, place)});
    if (lines.back().cells.size() != lines.front().cells.size()) {
      throw std::runtime_error(fmt::format("{}: {} cells, where the first line has {} headings", place,
                                           lines.back().cells.size(), lines.front().cells.size()));
    }
  }
  if (lines.empty())
    throw std::runtime_error(file.string() + ": no table; its first line must have the headings");
  return lines;
}

std::string read_whole_text(const std::filesystem::path& file) {
  std::string text;
  const std::string unreadable = read_text_file(file, text);
  if (!unreadable.empty()) throw std::runtime_error(file.string() + ": " + unreadable);
  return text;
}

std::string caption_beside(const std::filesystem::path& csv) {
  std::filesystem::path caption = csv;
  caption.replace_extension(".txt");
  return std::filesystem::exists(caption) ? read_whole_text(caption) : "";
}

}  // namespace palpate
