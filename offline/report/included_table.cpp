#include "offline/report/included_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "offline/output/finished_file.hpp"
#include "offline/report/csv_file.hpp"
#include "offline/report/html_text.hpp"

namespace palpate {
namespace {

// Lists NAME.ENDING, then NAME_*.ENDING.
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
  for (CsvLine& line : read_csv(csv)) table.rows.push_back(std::move(line.cells));
  table.caption = caption_beside(csv);
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
    write_finished_text(copy, read_whole_text(picture));
    html += fmt::format("<figure>\n<img alt=\"{}\" src=\"{}\">\n</figure>\n", html_escaped(table.title),
                        data_uri(copy, "image/svg+xml"));
  }
  html += "<div class=\"wide\">" + html_table(table.rows) + "</div>\n";
  html += "<p class=\"links\">";
  std::vector<std::filesystem::path> files = {table.csv};
  files.insert(files.end(), table.more.begin(), table.more.end());
  for (const std::filesystem::path& file : files) {
    const std::string name = file.filename().string();
    write_finished_text(folder / name, read_whole_text(file));
    html += fmt::format("<a href=\"{0}\">{0}</a> ", html_escaped(name));
  }
  return html + "</p>\n</section>\n";
}

}  // namespace palpate
