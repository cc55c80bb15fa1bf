#include "offline/study/organ_report.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "offline/output/progress_bar.hpp"
#include "offline/pipeline/held_out_pushes.hpp"
#include "offline/pipeline/measured_push.hpp"
#include "offline/pipeline/scene_sites.hpp"
#include "offline/pipeline/survey_validation.hpp"
#include "offline/study/compared_methods.hpp"
#include "offline/study/error_map.hpp"
#include "offline/study/full_newton.hpp"
#include "offline/study/method_timing.hpp"
#include "offline/study/report_pushes.hpp"
#include "offline/study/report_rows.hpp"

namespace palpate {
namespace {

// Collects the rows of an organ's report.
class Measurement {
 public:
  Measurement(const OpenedPack& opened, const Organ& organ, const ReportEffort& effort, std::int64_t seed,
              int jobs)
      : opened_(opened),
        organ_(organ),
        effort_(effort),
        seed_(seed),
        jobs_(jobs),
        rows_(opened, organ, report_) {}
  Measurement(const Measurement&) = delete;  // rows_ refers to report_
  Measurement& operator=(const Measurement&) = delete;

  OrganReport run(const std::filesystem::path& map) {
    describe();
    validate_survey(map);
    compare_at_levels();
    compare_several();
    time_all();
    time_smallest_copy();
    return std::move(report_);
  }

 private:
  struct Timed {
    std::vector<size_t> rows;  // indices in report_.methods; all get the times of `timer`
    MethodTimer timer;
  };

  void describe() {
    const pal_pack_info info = opened_.info();
    report_.length_unit = opened_.length_unit();
    report_.force_unit = opened_.force_unit();
    report_.metres_per_length_unit = info.metres_per_length_unit;
    report_.newtons_per_force_unit = info.newtons_per_force_unit;
    report_.nodes = organ_.model.num_nodes();
    report_.elements = static_cast<int>(organ_.model.elements.size());
    report_.shown_nodes = static_cast<int>(info.num_nodes);
    report_.sites = static_cast<int>(info.num_sites);
    report_.pack_megabytes = 1e-6 * static_cast<double>(opened_.bytes().size());
    report_.mean_edge = organ_.sites.mean_surface_edge;
    report_.max_displacement = organ_.scene.max_displacement;
    report_.max_contacts = organ_.scene.max_contacts;
    const double thickness = median_thickness(organ_);
    report_.thickness = std::isfinite(thickness) ? thickness : 0;
    parts_ = compared_parts(organ_);
  }

  // Validates the pack's survey by random pushes at all sites, and records the distribution of errors.
  void validate_survey(const std::filesystem::path& map) {
    const std::vector<Push> pushes =
        draw_pushes(opened_, organ_.scene, organ_.sites, effort_.random_pushes, seed_);
    std::vector<SurveySample> samples;
    {
      ProgressBar bar("solving random pushes", 1000);
      samples = solve_pushes(
          organ_.assembly, organ_.sites, pushes, jobs_,
          [&](int done, int total) { bar.show(1000 * done / total); }, organ_.rest);
    }
    const std::vector<ContactTruth> truths = truths_of(samples);
    int number = 0;
    const std::vector<PushRow> push_rows = rows_.describe_pushes("random", truths, number);
    report_.unsolved = static_cast<int>(
        std::count_if(truths.begin(), truths.end(), [](const ContactTruth& truth) { return !truth.solved; }));
    std::vector<NodeErrors> worst;
    for (const ComparedMethod& method : carried_methods(opened_)) {
      NodeErrors& method_errors = worst.emplace_back(NodeErrors{method.name, {}});
      const std::vector<MeasuredPush> measured = measure_pushes(
          truths, [&] { return runtime_method(opened_, method.model, 1, method.rings); }, jobs_, {},
          &method_errors.largest);
      rows_.add_pushes(push_rows, method, measured);
    }
    for (const SurveyValidation& validation :
         judge_pack(opened_, samples, organ_.scene.max_displacement, jobs_)) {
      if (validation.measured.errors.empty()) continue;  // no push was at a site of this model
      const SurveyBin& found = validation.measured.table.overall;
      report_.promises.push_back({validation.model, found.samples, validation.claimed.displacement.p95,
                                  found.displacement.p95, validation.claimed.force.p95, found.force.p95,
                                  validation.displacement_coverage(), validation.force_coverage(),
                                  validation.agrees()});
    }
    if (draw_error_map(opened_, organ_, std::move(worst), map)) report_.error_map = map;
  }

  void compare_at_levels() {
    const std::vector<size_t> sites = compared_sites(organ_, effort_.most_sites);
    report_.sites_compared = static_cast<int>(sites.size());
    const std::vector<Level> levels = rows_.describe_levels(
        "levels", 1, solve_levels(opened_, organ_, parts_, sites, effort_.pushes_at_level, seed_, jobs_));
    std::vector<std::vector<std::uint32_t>> site_sets;
    for (size_t i = 0; i < std::min(effort_.timed_sets, sites.size()); ++i)
      site_sets.push_back({static_cast<std::uint32_t>(sites[i])});
    compare(levels, site_sets);
  }

  void compare_several() {
    const int contacts = std::min({3, organ_.scene.max_contacts, report_.sites});
    if (contacts < 2) return;
    const std::vector<Level> levels = rows_.describe_levels(
        "several", contacts, solve_several(opened_, organ_, parts_, contacts, effort_.several, seed_, jobs_));
    if (levels.empty()) {
      report_.notes.push_back(fmt::format(
          "No {} sites have patches that share no node; one contact at a time is compared.", contacts));
      return;
    }
    std::vector<std::uint32_t> sites;
    for (const LinearContact& contact : levels.back().truths.truths.front().contacts)
      sites.push_back(static_cast<std::uint32_t>(contact.site));
    compare(levels, {sites});
  }

  // Compares all methods at each level. Times frames at all `site_sets`, the slow full Newton at the first.
  void compare(const std::vector<Level>& levels, const std::vector<std::vector<std::uint32_t>>& site_sets) {
    const auto contacts = static_cast<std::uint32_t>(site_sets.front().size());
    std::vector<ComparedMethod> methods = carried_methods(opened_);
    // Polynomials support one contact only.
    if (contacts > 1)
      std::erase_if(methods, [](const auto& one) { return one.kind == MethodKind::polynomial; });
    const auto steps = static_cast<int>(methods.size() + levels.size());
    ProgressBar bar(contacts > 1 ? "methods, several contacts" : "methods", steps);
    int done = 0;
    for (const ComparedMethod& method : methods) {
      add_rows(method, contacts, levels, site_sets);
      bar.show(++done);
    }
    for (const Level& level : levels) {
      time_newton(level.truths.part, site_sets.front());
      bar.show(++done);
    }
  }

  // Measures the errors of a method and prepares its timers. A zone gets a timer for each level. Other
  // methods get one timer for all levels, since their frame time does not depend on |d|.
  void add_rows(const ComparedMethod& method, std::uint32_t contacts, const std::vector<Level>& levels,
                const std::vector<std::vector<std::uint32_t>>& site_sets) {
    std::vector<size_t> rows;
    for (const Level& level : levels) {
      const std::vector<MeasuredPush> measured = measure_pushes(
          level.truths.truths, [&] { return runtime_method(opened_, method.model, contacts, method.rings); },
          jobs_);
      rows_.add_pushes(level.push_rows, method, measured);
      rows.push_back(rows_.add_method(method, static_cast<int>(contacts), level.truths, measured));
      if (method.kind != MethodKind::zone && &level != &levels.back()) continue;
      timers_.push_back({std::exchange(rows, {}),
                         MethodTimer(opened_, method.model, method.rings, site_sets, level.truths.part)});
    }
  }

  // Adds a row of full Newton, whose errors stay 0: full Newton is the truth.
  void time_newton(double part, const std::vector<std::uint32_t>& sites) {
    MethodRow row;
    row.kind = MethodKind::newton;
    row.name = "full Newton, warm";
    row.contacts = static_cast<int>(sites.size());
    row.part = part;
    try {
      row.haptic = time_full_newton(organ_, sites, part, effort_.newton_frames);
      report_.methods.push_back(row);
    } catch (const std::runtime_error& error) {
      report_.notes.push_back(
          fmt::format("Full Newton is not timed for {} contacts: {}.", row.contacts, error.what()));
    }
  }

  void time_all() {
    const int rounds = effort_.timed_rounds;
    ProgressBar bar("timing frames", rounds * static_cast<int>(timers_.size()));
    int done = 0;
    CacheEvictor caches;
    // Interleaved rounds expose all methods to the same load of the machine.
    for (int round = 0; round < rounds; ++round) {
      for (Timed& timed : timers_) {
        timed.timer.time_round(effort_.seconds / rounds, effort_.most_frames / rounds,
                               round + 1 < rounds ? 0 : effort_.cold_frames, &caches);
        bar.show(++done);
      }
    }
    for (const Timed& timed : timers_) {
      for (const size_t row : timed.rows) timed.timer.summarise(report_.methods[row]);
    }
    timers_.clear();
  }

  void time_smallest_copy() {
    constexpr int kCopies = 2000;
    std::vector<std::uint64_t> field_sizes;  // bytes
    for (const pack::FrameCost* cost : *opened_.tables().costs()) field_sizes.push_back(cost->field_bytes());
    if (field_sizes.empty()) return;
    const std::uint64_t bytes = *std::min_element(field_sizes.begin(), field_sizes.end());
    const Timing timing = time_copy("", bytes, kCopies);
    report_.smallest_copy = {static_cast<double>(bytes) / 1024, summary_of(timing.nanoseconds, {})};
  }

  const OpenedPack& opened_;
  const Organ& organ_;
  const ReportEffort& effort_;
  std::int64_t seed_;
  int jobs_;
  std::vector<double> parts_;  // fractions of the largest |d| in the comparison
  OrganReport report_;
  ReportRows rows_;
  std::vector<Timed> timers_;
};

}  // namespace

OrganReport measure_organ(const OpenedPack& opened, const Organ& organ, const ReportEffort& effort,
                          std::int64_t seed, int jobs, const std::filesystem::path& map) {
  return Measurement(opened, organ, effort, seed, jobs).run(map);
}

}  // namespace palpate
