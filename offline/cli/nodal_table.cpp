#include "offline/cli/nodal_table.hpp"

#include <fmt/core.h>
#include <fmt/format.h>
#include <unistd.h>

#include <charconv>
#include <cmath>
#include <cstdio>
#include <fstream>

#include "offline/mesh/input_error.hpp"
#include "offline/output/finished_file.hpp"

namespace palpate {
namespace {

constexpr const char* kHeader = "node,x,y,z,ux,uy,uz,fx,fy,fz";

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
  std::ifstream stream(file);
  if (!stream) throw InputError({file.string(), 0}, "cannot be read");
  std::string line;
  std::getline(stream, line);
  if (line != kHeader) throw InputError({file.string(), 1}, fmt::format("the header is not '{}'", kHeader));
  std::vector<NodalRow> rows;
  for (int number = 2; std::getline(stream, line); ++number) {
    double fields[10];
    const char* place = line.data();
    const char* const end = line.data() + line.size();
    for (int i = 0; i < 10; ++i) {
      fields[i] = std::nan("");
      const std::from_chars_result result = std::from_chars(place, end, fields[i]);
      if (result.ec != std::errc() && i < 7)
        throw InputError({file.string(), number}, fmt::format("field {} is not a number", i + 1));
      place = result.ptr;
      if (i < 9 && (place == end || *place++ != ','))
        throw InputError({file.string(), number}, "there must be 10 fields");
    }
    NodalRow row;
    row.label = static_cast<int>(fields[0]);
    row.position = {fields[1], fields[2], fields[3]};
    row.displacement = {fields[4], fields[5], fields[6]};
    if (std::isfinite(fields[7])) row.force = Eigen::Vector3d(fields[7], fields[8], fields[9]);
    rows.push_back(row);
  }
  return rows;
}

void write_finished_text(const std::filesystem::path& file, const std::string& text) {
  write_finished_file(file, [&](const std::filesystem::path& temporary) {
    std::ofstream stream(temporary, std::ios::binary);
    stream << text;
    stream.close();
    if (!stream) throw std::runtime_error(file.string() + ": cannot be written");
  });
}

void SolveProgress::show(const IterationRecord& record) {
  if (isatty(STDERR_FILENO) != 1) return;
  drawn_ = true;
  fmt::print(stderr,
             "\r\033[Kstep {}  load {:5.1f} %  increment {}  iteration {}  residual {:.1e}  min J {:.3f}",
             step_, 100 * record.load_factor, record.increment, record.iteration, record.residual,
             record.min_jacobian);
  std::fflush(stderr);
}

void SolveProgress::finish() {
  if (drawn_) fmt::print(stderr, "\r\033[K");
}

}  // namespace palpate
