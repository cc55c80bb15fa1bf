#include "offline/report/csv_tables.hpp"

#include <fmt/format.h>

#include "offline/report/speed_plots.hpp"

namespace palpate {
namespace {

std::string cell(const std::optional<double>& number) {
  return number ? fmt::format("{:.9g}", *number) : "";
}

std::string cells(const ErrorSummary& error) {
  return fmt::format(",{:.9g},{:.9g},{:.9g}", error.median, error.p95, error.max);
}

std::string cells(const std::optional<TimeSummary>& time) {
  if (!time || time->max == 0) return ",,,,,,";
  return fmt::format(",{:.4g},{:.4g},{:.4g},{:.4g},{:.4g},{:.4g}", time->median, time->p99, time->p999,
                     time->max, time->lowest, time->highest);
}

// Joins the displacement component along `axis` of each contact by ";", in the order of the sites.
std::string components_along(const PushRow& row, size_t axis) {
  std::string text;
  for (const std::array<double, 3>& displacement : row.displacements)
    text += fmt::format("{}{:.9g}", text.empty() ? "" : ";", displacement[axis]);
  return text;
}

std::string headings(const std::string& quantity, std::initializer_list<const char*> names) {
  std::string line;
  for (const char* name : names) line += fmt::format(",{}_{}", quantity, name);
  return line;
}

}  // namespace

std::string pushes_csv(const OrganReport& organ) {
  std::string text =
      "set,push,method,contacts,sites,dx,dy,dz,size,size_over_h,part_of_max,strain,solved,displacement_error,"
      "force_error,"
      "force_error_unfloored,displacement_off,force_off,displacement_estimate,force_estimate\n";
  for (const PushRow& row : organ.pushes) {
    text += fmt::format(
        "{},{},\"{}\",{},{},{},{},{},{:.9g},{:.9g},{:.9g},{},{},{:.9g},{:.9g},{:.9g},{:.9g},{:."
        "9g},{},{}\n",
        row.set, row.push, row.name, row.contacts, row.sites, components_along(row, 0),
        components_along(row, 1), components_along(row, 2), row.size, row.size / organ.mean_edge, row.part,
        cell(row.strain), row.solved ? 1 : 0, row.displacement_error, row.force_error,
        row.force_error_unfloored, row.displacement_off, row.force_off, cell(row.displacement_estimate),
        cell(row.force_estimate));
  }
  return text;
}

std::string methods_csv(const OrganReport& organ) {
  const auto errors = {"median", "p95", "max"};
  const auto times = {"median_us", "p99_us", "p999_us", "max_us", "lowest_median_us", "highest_median_us"};
  std::string text = "method,contacts,part_of_max,size,size_over_h,size_over_thickness,pushes" +
                     headings("displacement", errors) + headings("force", errors) +
                     headings("force_unfloored", errors) + headings("displacement_off", errors) +
                     headings("force_off", errors) + headings("haptic", times) + headings("visual", times) +
                     headings("haptic_cold", times) + headings("visual_cold", times) +
                     ",front_field,front_force\n";
  const std::vector<bool> field_front = on_front(organ, SpeedError::field);
  const std::vector<bool> force_front = on_front(organ, SpeedError::force);
  for (size_t i = 0; i < organ.methods.size(); ++i) {
    const MethodRow& row = organ.methods[i];
    const double size = row.part * organ.max_displacement;
    const std::optional<double> strain =
        organ.thickness > 0 ? std::optional(size / organ.thickness) : std::nullopt;
    text += fmt::format("\"{}\",{},{:g},{:.9g},{:.9g},{},{}", row.name, row.contacts, row.part, size,
                        size / organ.mean_edge, cell(strain), row.pushes);
    for (const ErrorSummary& error :
         {row.displacement, row.force, row.force_unfloored, row.displacement_off, row.force_off})
      text += cells(error);
    text += cells(std::optional(row.haptic)) + cells(std::optional(row.visual)) + cells(row.haptic_cold) +
            cells(row.visual_cold) + fmt::format(",{},{}\n", field_front[i] ? 1 : 0, force_front[i] ? 1 : 0);
  }
  return text;
}

}  // namespace palpate
