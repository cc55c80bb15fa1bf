#include "offline/report/included_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <stdexcept>

#include "offline/output/finished_file.hpp"
#include "offline/report/html_text.hpp"

namespace palpate {
namespace {

std::string text_of(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::string text((std::istreambuf_iterator<char>(stream)), std::istreambuf_iterator<char>());
  if (!stream.is_open() || stream.bad()) throw std::runtime_error(file.string() + ": cannot be read");
  return text;
}

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

// NAME.ENDING, then NAME_*.ENDING.
std::vector<std::filesystem::path> files_beside(const std::filesystem::path& csv, const char* ending) {
  const std::string stem = csv.stem().string();
  std::vector<std::filesystem::path> found;
  const std::filesystem::path folder = csv.has_parent_path() ? csv.parent_path() : ".";
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::filesystem::path& path = entry.path();
    const std::string other = path.stem().string();
    if (path.extension() == ending && (other == stem || other.starts_with(stem + "_"))) found.push_back(path);
  }
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace

IncludedTable read_included_table(const std::string& title, const std::filesystem::path& csv) {
  IncludedTable table;
  table.title = title;
  table.name = csv.stem().string();
  table.csv = csv;
  const std::string text = text_of(csv);
  int number = 0;
  for (size_t from = 0; from < text.size();) {
    const size_t end = std::min(text.find('\n', from), text.size());
    std::string line = text.substr(from, end - from);
    from = end + 1;
    ++number;
    if (line.ends_with('\r')) line.pop_back();
    if (line.empty()) continue;
    const std::string place = fmt::format("{}:{}", csv.string(), number);
    table.rows.push_back(cells_of(line, place));
    if (table.rows.back().size() != table.rows.front().size()) {
      throw std::runtime_error(fmt::format("{}: {} cells, where the first line has {} headings", place,
                                           table.rows.back().size(), table.rows.front().size()));
    }
  }
  if (table.rows.empty())
    throw std::runtime_error(csv.string() + ": no table; its first line must have the headings");
  std::filesystem::path caption = csv;
  caption.replace_extension(".txt");
  if (std::filesystem::exists(caption)) table.caption = text_of(caption);
  table.pictures = files_beside(csv, ".svg");
  table.more = files_beside(csv, ".csv");
  std::erase_if(table.more, [&](const auto& file) { return file.filename() == csv.filename(); });
  return table;
}

std::string write_included_table(const IncludedTable& table, const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder / "plots");
  std::string html = fmt::format("<section id=\"{}\">\n<h2>{}</h2>\n<p>{}</p>\n", html_escaped(table.name),
                                 html_escaped(table.title), html_escaped(table.caption));
  for (const std::filesystem::path& picture : table.pictures) {
    const std::filesystem::path copy = folder / "plots" / picture.filename();
    write_finished_text(copy, text_of(picture));
    html += fmt::format("<figure>\n<img alt=\"{}\" src=\"{}\">\n</figure>\n", html_escaped(table.title),
                        data_uri(copy, "image/svg+xml"));
  }
  html += "<div class=\"wide\">" + html_table(table.rows) + "</div>\n";
  html += "<p class=\"links\">";
  std::vector<std::filesystem::path> files = {table.csv};
  files.insert(files.end(), table.more.begin(), table.more.end());
  for (const std::filesystem::path& file : files) {
    const std::string name = file.filename().string();
    write_finished_text(folder / name, text_of(file));
    html += fmt::format("<a href=\"{0}\">{0}</a> ", html_escaped(name));
  }
  return html + "</p>\n</section>\n";
}

}  // namespace palpate
