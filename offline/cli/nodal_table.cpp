#include "offline/cli/nodal_table.hpp"

#include <fmt/core.h>
#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <sstream>
#include <string_view>

#include "offline/io/finished_file.hpp"
#include "offline/mesh/input_error.hpp"
#include "offline/mesh/text_file.hpp"

namespace palpate {
namespace {

constexpr const char* kHeader = "node,x,y,z,ux,uy,uz,fx,fy,fz";
constexpr size_t kFields = 10;

std::vector<std::string_view> fields_of(std::string_view line) {
  std::vector<std::string_view> fields;
  for (size_t comma = line.find(','); comma != std::string_view::npos; comma = line.find(',')) {
    fields.push_back(line.substr(0, comma));
    line.remove_prefix(comma + 1);
  }
  fields.push_back(line);
  return fields;
}

// Parses a number; the number must fill the whole field.
template <typename Number>
bool read_number(std::string_view field, Number& value) {
  const std::from_chars_result result = std::from_chars(field.data(), field.data() + field.size(), value);
  return result.ec == std::errc() && result.ptr == field.data() + field.size();
}

}  // namespace

std::vector<NodalRow> nodal_rows(const Model& model, const Eigen::VectorXd& displacement,
                                 const Eigen::VectorXd& force) {
  std::vector<NodalRow> rows;
  for (int node = 0; node < model.num_nodes(); ++node) {
    NodalRow row;
    row.label = model.labels[static_cast<size_t>(node)];
    row.position = model.positions[static_cast<size_t>(node)];
    row.displacement = displacement.segment<3>(3 * node);
    row.force = force.segment<3>(3 * node);
    rows.push_back(row);
  }
  return rows;
}

void write_nodal_table(const std::filesystem::path& file, const std::vector<NodalRow>& rows) {
  fmt::memory_buffer text;
  fmt::format_to(std::back_inserter(text), "{}\n", kHeader);
  for (const NodalRow& row : rows) {
    fmt::format_to(std::back_inserter(text), "{},{:.12g},{:.12g},{:.12g},{:.12g},{:.12g},{:.12g},", row.label,
                   row.position[0], row.position[1], row.position[2], row.displacement[0],
                   row.displacement[1], row.displacement[2]);
    if (row.force) {
      fmt::format_to(std::back_inserter(text), "{:.12g},{:.12g},{:.12g}\n", (*row.force)[0], (*row.force)[1],
                     (*row.force)[2]);
    } else {
      fmt::format_to(std::back_inserter(text), ",,\n");
    }
  }
  write_finished_text(file, fmt::to_string(text));
}

std::vector<NodalRow> read_nodal_table(const std::filesystem::path& file) {
  std::string text;
  const std::string unreadable = read_text_file(file, text);
  if (!unreadable.empty()) throw InputError({file.string(), 0}, unreadable);
  std::istringstream stream(text);
  std::string line;
  std::getline(stream, line);
  if (line != kHeader) throw InputError({file.string(), 1}, fmt::format("the header is not '{}'", kHeader));
  std::vector<NodalRow> rows;
  for (int number = 2; std::getline(stream, line); ++number) {
    const std::vector<std::string_view> fields = fields_of(line);
    const auto fail = [&](const std::string& reason) { throw InputError({file.string(), number}, reason); };
    if (fields.size() != kFields) fail(fmt::format("there must be {} fields", kFields));
    const bool has_force = !fields[7].empty();
    NodalRow row;
    std::array<double, kFields> values = {};
    bool read = read_number(fields[0], row.label);
    for (size_t i = 1; i < (has_force ? kFields : 7) && read; ++i)
      read = read_number(fields[i], values[i]) && std::isfinite(values[i]);
    if (!read) fail("a field is not a number");
    row.position = {values[1], values[2], values[3]};
    row.displacement = {values[4], values[5], values[6]};
    if (has_force) row.force = Eigen::Vector3d(values[7], values[8], values[9]);
    rows.push_back(row);
  }
  return rows;
}

}  // namespace palpate
