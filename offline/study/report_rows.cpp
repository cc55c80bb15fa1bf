#include "offline/study/report_rows.hpp"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "offline/precompute/local_thickness.hpp"

namespace palpate {
namespace {

// Summarises the pushes that have a truth.
ErrorSummary summary_of(const std::vector<MeasuredPush>& pushes, const std::vector<ContactTruth>& truths,
                        double MeasuredPush::*error) {
  std::vector<double> values;
  for (size_t i = 0; i < pushes.size(); ++i) {
    if (truths[i].solved) values.push_back(pushes[i].*error);
  }
  return {quantile(values, 0.5), quantile(values, 0.95), quantile(values, 1)};
}

}  // namespace

MethodRow method_row(const std::string& name, int contacts, const LevelTruths& level,
                     const std::vector<MeasuredPush>& pushes) {
  MethodRow row;
  row.name = name;
  row.contacts = contacts;
  row.part = level.part;
  row.pushes = static_cast<int>(std::count_if(level.truths.begin(), level.truths.end(),
                                              [](const ContactTruth& truth) { return truth.solved; }));
  row.displacement = summary_of(pushes, level.truths, &MeasuredPush::displacement_error);
  row.force = summary_of(pushes, level.truths, &MeasuredPush::force_error);
  row.force_unfloored = summary_of(pushes, level.truths, &MeasuredPush::force_error_unfloored);
  row.displacement_off = summary_of(pushes, level.truths, &MeasuredPush::displacement_off);
  row.force_off = summary_of(pushes, level.truths, &MeasuredPush::force_off);
  return row;
}

ReportRows::ReportRows(const OpenedPack& opened, const Organ& organ, OrganReport& report)
    : opened_(&opened), organ_(&organ), surface_(extract_surface(organ.model)), report_(&report) {}

std::vector<Level> ReportRows::describe_levels(const std::string& set, int contacts,
                                               std::vector<LevelTruths> levels) {
  int number = 0;
  int unsolved = 0;
  std::vector<Level> described;
  for (LevelTruths& level : levels) {
    std::vector<PushRow> push_rows = describe_pushes(set, level.truths, number);
    for (const PushRow& push : push_rows) unsolved += push.solved ? 0 : 1;
    described.push_back({std::move(level), std::move(push_rows)});
  }
  if (unsolved > 0) {
    report_->notes.push_back(fmt::format(
        "{} of {} pushes of {} contact{} reached no equilibrium in the full solve; they have no truth and "
        "are left out.",
        unsolved, number, contacts, contacts > 1 ? "s" : ""));
  }
  return described;
}

std::vector<PushRow> ReportRows::describe_pushes(const std::string& set,
                                                 const std::vector<ContactTruth>& truths, int& number) const {
  std::vector<PushRow> rows;
  for (const ContactTruth& truth : truths) {
    PushRow row;
    row.set = set;
    row.push = number++;
    row.contacts = static_cast<int>(truth.contacts.size());
    std::vector<int> labels;
    for (const LinearContact& contact : truth.contacts) {
      labels.push_back(opened_->label_of_site(contact.site));
      const Eigen::Vector3d& d = contact.displacement;
      row.displacements.push_back({d[0], d[1], d[2]});
    }
    row.sites = fmt::format("{}", fmt::join(labels, ";"));
    row.size = truth.largest_displacement();
    row.part = row.size / organ_->scene.max_displacement;
    if (row.contacts == 1) {
      const LinearContact& only = truth.contacts.front();
      const double thickness =
          local_thickness(organ_->model, surface_, organ_->sites.sites[only.site], only.displacement);
      if (std::isfinite(thickness)) row.strain = row.size / thickness;
    }
    row.solved = truth.solved;
    rows.push_back(std::move(row));
  }
  return rows;
}

void ReportRows::add_pushes(const std::vector<PushRow>& push_rows, const MethodName& method,
                            const std::vector<MeasuredPush>& pushes) {
  for (size_t i = 0; i < pushes.size(); ++i) {
    PushRow row = push_rows[i];
    row.name = method.name;
    row.kind = method.kind;
    row.displacement_error = pushes[i].displacement_error;
    row.force_error = pushes[i].force_error;
    row.force_error_unfloored = pushes[i].force_error_unfloored;
    row.displacement_off = pushes[i].displacement_off;
    row.force_off = pushes[i].force_off;
    constexpr double kNotMeasured = 1;  // the runtime's estimate where the survey has no error
    if (row.solved && pushes[i].displacement_estimate < kNotMeasured) {
      row.displacement_estimate = pushes[i].displacement_estimate;
      row.force_estimate = pushes[i].force_estimate;
    }
    report_->pushes.push_back(std::move(row));
  }
}

size_t ReportRows::add_method(const MethodName& method, int contacts, const LevelTruths& level,
                              const std::vector<MeasuredPush>& pushes) {
  report_->methods.push_back(method_row(method.name, contacts, level, pushes));
  report_->methods.back().kind = method.kind;
  return report_->methods.size() - 1;
}

}  // namespace palpate
