#include "offline/report/methods_elsewhere.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "offline/report/csv_file.hpp"

namespace palpate {
namespace {

// Reads the cells of one line by heading.
class Cells {
 public:
  Cells(std::string file, const CsvLine& headings, const CsvLine& line)
      : file_(std::move(file)), headings_(headings), line_(line) {}

  const std::string& text(const std::string& heading) const {
    const std::string* cell = find(heading);
    if (cell == nullptr) {
      throw std::runtime_error(
          fmt::format("{}: no column {}; its columns are to be those of the ORGAN_methods.csv that a report "
                      "writes",
                      file_, heading));
    }
    if (cell->empty()) throw std::runtime_error(fmt::format("{}: {} is empty; give it", place(), heading));
    return *cell;
  }
  double number(const std::string& heading) const { return number_of(heading, text(heading)); }
  // 0 where column or cell is absent.
  double number_if_any(const std::string& heading) const {
    const std::string* cell = find(heading);
    return cell == nullptr || cell->empty() ? 0 : number_of(heading, *cell);
  }
  // Requires at least `least`.
  int count(const std::string& heading, int least) const {
    const double value = number(heading);
    if (value < least || value != std::floor(value) || value > 1e9)
      refuse(heading, text(heading), fmt::format("a whole number from {} on", least));
    return static_cast<int>(value);
  }
  // 0 where absent.
  int count_if_any(const std::string& heading) const {
    const std::string* cell = find(heading);
    return cell == nullptr || cell->empty() ? 0 : count(heading, 0);
  }

  [[noreturn]] void refuse(const std::string& heading, const std::string& cell,
                           const std::string& what) const {
    throw std::runtime_error(fmt::format("{}: {} is \"{}\"; it must be {}", place(), heading, cell, what));
  }

 private:
  std::string place() const { return fmt::format("{}:{}", file_, line_.number); }
  const std::string* find(const std::string& heading) const {
    const auto found = std::find(headings_.cells.begin(), headings_.cells.end(), heading);
    return found == headings_.cells.end()
               ? nullptr
               : &line_.cells[static_cast<size_t>(found - headings_.cells.begin())];
  }
  double number_of(const std::string& heading, const std::string& cell) const {
    double value = 0;
    const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
    if (error != std::errc() || end != cell.data() + cell.size() || !std::isfinite(value) || value < 0)
      refuse(heading, cell, "a number, not below 0");
    return value;
  }
  std::string file_;
  const CsvLine& headings_;
  const CsvLine& line_;
};

ErrorSummary error_of(const Cells& cells, const std::string& error, bool must_be_there) {
  if (!must_be_there)
    return {cells.number_if_any(error + "_median"), cells.number_if_any(error + "_p95"),
            cells.number_if_any(error + "_max")};
  return {cells.number_if_any(error + "_median"), cells.number(error + "_p95"), cells.number(error + "_max")};
}

TimeSummary further_of(const Cells& cells, const std::string& stage, TimeSummary time) {
  time.p99 = cells.number_if_any(stage + "_p99_us");
  time.lowest = cells.number_if_any(stage + "_lowest_median_us");
  time.highest = cells.number_if_any(stage + "_highest_median_us");
  return time;
}

TimeSummary time_of(const Cells& cells, const std::string& stage) {
  TimeSummary time;
  time.median = cells.number(stage + "_median_us");
  time.p999 = cells.number(stage + "_p999_us");
  time.max = cells.number(stage + "_max_us");
  return further_of(cells, stage, time);
}

TimeSummary time_if_any(const Cells& cells, const std::string& stage) {
  TimeSummary time;
  time.median = cells.number_if_any(stage + "_median_us");
  time.p999 = cells.number_if_any(stage + "_p999_us");
  time.max = cells.number_if_any(stage + "_max_us");
  return further_of(cells, stage, time);
}

MethodRow row_of(const Cells& cells) {
  MethodRow row;
  row.kind = MethodKind::elsewhere;
  row.name = cells.text("method");
  if (row.name.find('"') != std::string::npos)
    cells.refuse("method", row.name, "a name without quotation marks");
  row.contacts = cells.count("contacts", 1);
  row.part = cells.number("part_of_max");
  row.pushes = cells.count_if_any("pushes");
  row.diverged = cells.count_if_any("diverged");
  if (row.diverged > row.pushes) cells.refuse("diverged", cells.text("diverged"), "at most its pushes");
  row.displacement = error_of(cells, "displacement", true);
  row.force = error_of(cells, "force", true);
  row.force_unfloored = error_of(cells, "force_unfloored", false);
  row.displacement_off = error_of(cells, "displacement_off", false);
  row.force_off = error_of(cells, "force_off", false);
  row.haptic = time_of(cells, "haptic");
  row.visual = time_if_any(cells, "visual");
  const auto cold = [&](const std::string& stage) {
    const TimeSummary time = time_if_any(cells, stage);
    return time.max > 0 ? std::optional(time) : std::nullopt;
  };
  row.haptic_cold = cold("haptic_cold");
  row.visual_cold = cold("visual_cold");
  return row;
}

}  // namespace

MethodsElsewhere read_methods_elsewhere(const std::filesystem::path& csv) {
  const std::vector<CsvLine> lines = read_csv(csv);
  MethodsElsewhere elsewhere{csv.string(), caption_beside(csv), {}};
  for (size_t i = 1; i < lines.size(); ++i)
    elsewhere.rows.push_back(row_of(Cells(csv.string(), lines.front(), lines[i])));
  if (elsewhere.rows.empty()) throw std::runtime_error(csv.string() + ": no method; give it a line for each");
  return elsewhere;
}

void add_methods_elsewhere(const MethodsElsewhere& elsewhere, OrganReport& organ) {
  constexpr double kSamePart = 1e-5;  // fractions have six digits in the file
  const std::vector<MethodRow> own = organ.methods;
  for (MethodRow row : elsewhere.rows) {
    const auto alike = std::find_if(own.begin(), own.end(), [&](const MethodRow& other) {
      return other.contacts == row.contacts && std::abs(other.part - row.part) < kSamePart;
    });
    if (alike == own.end()) {
      organ.notes.push_back(
          fmt::format("{}: {} with {} contact{} at {:g} of the largest |d| is left out, where this report "
                      "compares nothing with it.",
                      elsewhere.file, row.name, row.contacts, row.contacts == 1 ? "" : "s", row.part));
      continue;
    }
    row.part = alike->part;
    organ.methods.push_back(std::move(row));
  }
  if (!elsewhere.caption.empty()) organ.captions_elsewhere.push_back(elsewhere.caption);
}

}  // namespace palpate
