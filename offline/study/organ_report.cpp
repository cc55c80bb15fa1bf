#include "offline/study/organ_report.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "offline/output/progress_bar.hpp"
#include "offline/pipeline/held_out_pushes.hpp"
#include "offline/pipeline/measured_push.hpp"
#include "offline/pipeline/scene_sites.hpp"
#include "offline/pipeline/survey_validation.hpp"
#include "offline/precompute/solver_threads.hpp"
#include "offline/study/compared_methods.hpp"
#include "offline/study/error_map.hpp"
#include "offline/study/method_timing.hpp"
#include "offline/study/reference_methods.hpp"
#include "offline/study/report_pushes.hpp"
#include "offline/study/report_rows.hpp"
#include "offline/study/study_packs.hpp"

namespace palpate {
namespace {

constexpr size_t kTimedSetsOfSlow = 2;     // for a slow method,
constexpr size_t kTimedSetsOfSeveral = 1;  // for several contacts
constexpr std::uint32_t kThick = 3;        // rings; thicker zones have slow frames
constexpr int kFramesOfAnApproach = 50;    // frames of a contact that comes from rest

// Collects the report's rows of one organ.
class Measurement {
 public:
  Measurement(const OpenedPack& opened, const Organ& organ, const SampleStore* store,
              const ReportEffort& effort, std::int64_t seed, int jobs)
      : opened_(opened),
        organ_(organ),
        store_(store),
        effort_(effort),
        seed_(seed),
        jobs_(jobs),
        rows_(opened, organ, report_) {}
  Measurement(const Measurement&) = delete;  // its rows refer to its report
  Measurement& operator=(const Measurement&) = delete;

  OrganReport run(const std::filesystem::path& map) {
    describe();
    judge(map);
    compare_at_levels();
    compare_several();
    time_all();
    time_copies();
    return std::move(report_);
  }

 private:
  struct Timed {
    std::vector<size_t> rows;  // in report_.methods
    bool carried = false;
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
  void judge(const std::filesystem::path& map) {
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
    const std::vector<PushRow> about = rows_.describe_pushes("random", truths, number);
    report_.unsolved = static_cast<int>(
        std::count_if(truths.begin(), truths.end(), [](const ContactTruth& truth) { return !truth.solved; }));
    std::vector<NodeErrors> worst;
    for (const ComparedMethod& method : carried_methods(opened_)) {
      NodeErrors& of_method = worst.emplace_back(NodeErrors{method.name, {}});
      const std::vector<MeasuredPush> measured = measure_pushes(
          truths, [&] { return runtime_method(opened_, method.model, 1, method.rings); }, jobs_, {},
          &of_method.largest);
      rows_.add_pushes(about, method, measured);
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
    others_ = std::make_unique<OtherSettings>(opened_, organ_, sites, effort_, jobs_, store_, report_.notes);
    const std::vector<Level> levels = rows_.described(
        "levels", 1, solve_levels(opened_, organ_, parts_, sites, effort_.pushes_at_level, seed_, jobs_));
    std::vector<ComparedMethod> methods = carried_methods(opened_);
    methods.insert(methods.end(), others_->methods().begin(), others_->methods().end());
    const std::vector<ComparedMethod> moving =
        moving_zones(methods, effort_.most_moving_rings, effort_.zone_iterations);
    methods.insert(methods.end(), moving.begin(), moving.end());
    std::vector<std::vector<size_t>> site_sets;
    for (size_t i = 0; i < std::min(effort_.timed_sets, sites.size()); ++i) site_sets.push_back({sites[i]});
    compare(methods, levels, site_sets);
    compare_references(organ_, effort_, levels, 1, rows_);
  }

  void compare_several() {
    const int contacts = std::min({3, organ_.scene.max_contacts, report_.sites});
    if (contacts < 2) return;
    const std::vector<Level> levels = rows_.described(
        "several", contacts, solve_several(opened_, organ_, parts_, contacts, effort_.several, seed_, jobs_));
    if (levels.empty()) {
      report_.notes.push_back(fmt::format(
          "No {} sites have patches that share no node; one contact at a time is compared.", contacts));
      return;
    }
    std::vector<std::vector<size_t>> site_sets;
    for (const ContactTruth& truth : levels.back().truths.truths) {
      if (site_sets.size() == kTimedSetsOfSeveral) break;
      std::vector<size_t>& set = site_sets.emplace_back();
      for (const LinearContact& contact : truth.contacts) set.push_back(contact.site);
    }
    std::vector<ComparedMethod> methods = carried_methods(opened_);
    const std::vector<ComparedMethod> moving =
        moving_zones(methods, effort_.most_moving_rings_of_several, effort_.zone_iterations);
    methods.insert(methods.end(), moving.begin(), moving.end());
    // Polynomials support one contact only.
    std::erase_if(methods,
                  [](const ComparedMethod& method) { return method.kind == MethodKind::polynomial; });
    compare(methods, levels, site_sets);
    compare_references(organ_, effort_, levels, contacts, rows_);
  }

  // Measures errors at each level, independent of the machine's load, and prepares timers.
  void compare(const std::vector<ComparedMethod>& methods, const std::vector<Level>& levels,
               const std::vector<std::vector<size_t>>& site_sets) {
    const auto contacts = static_cast<std::uint32_t>(site_sets.front().size());
    const int of_slow = contacts > 1 ? effort_.several_of_slow_methods : effort_.pushes_of_slow_methods;
    std::vector<Level> levels_of_slow;
    for (const Level& level : levels) levels_of_slow.push_back(level.first(of_slow));
    const std::vector<std::vector<size_t>> sets_of_slow(
        site_sets.begin(),
        site_sets.begin() + static_cast<std::ptrdiff_t>(std::min(kTimedSetsOfSlow, site_sets.size())));
    const auto is_slow = [&](const ComparedMethod& method) {
      return method.rings >= kThick && (!method.carried || contacts > 1);
    };
    const auto levels_of = [&](const ComparedMethod& method) -> const std::vector<Level>& {
      return is_slow(method) ? levels_of_slow : levels;
    };
    std::vector<std::vector<std::vector<MeasuredPush>>> measured(methods.size());  // by method and level
    {
      ProgressBar bar(contacts > 1 ? "methods, several contacts" : "methods",
                      static_cast<int>(methods.size()));
      // The slowest methods stand last and start first, so that threads end together.
      const auto measure = [&](size_t, size_t i) {
        const size_t m = methods.size() - 1 - i;
        measured[m] = measure_method(methods[m], levels_of(methods[m]), contacts);
      };
      for_each_on_threads(methods.size(), jobs_, measure, [&](int done, int) { bar.show(done); });
    }
    for (size_t m = 0; m < methods.size(); ++m)
      add_rows(methods[m], levels_of(methods[m]), is_slow(methods[m]) ? sets_of_slow : site_sets,
               measured[m]);
  }

  std::vector<std::vector<MeasuredPush>> measure_method(const ComparedMethod& method,
                                                        const std::vector<Level>& levels,
                                                        std::uint32_t contacts) const {
    ModelUnitSession session(*method.pack, method.model, contacts, 0, method.rings, method.iterations);
    const Method answer = method.iterations == 0
                              ? runtime_method(session, sites_of(method))
                              : moving_method(session, sites_of(method), kFramesOfAnApproach);
    std::vector<std::vector<MeasuredPush>> measured;
    for (const Level& level : levels) measured.push_back(measure_pushes(level.truths.truths, answer));
    return measured;
  }

  // Adds the rows of a method. A zone gets one timer for each level; other methods get one timer, since their
  // frame time does not depend on |d|.
  void add_rows(const ComparedMethod& method, const std::vector<Level>& levels,
                const std::vector<std::vector<size_t>>& site_sets,
                const std::vector<std::vector<MeasuredPush>>& measured) {
    const std::vector<std::uint32_t> sites = sites_of(method);
    std::vector<std::vector<std::uint32_t>> timed_sets;
    for (const std::vector<size_t>& one : site_sets) {
      std::vector<std::uint32_t>& timed = timed_sets.emplace_back();
      for (const size_t site : one) timed.push_back(sites[site]);
    }
    const auto contacts = static_cast<int>(site_sets.front().size());
    std::vector<size_t> rows;
    for (size_t l = 0; l < levels.size(); ++l) {
      const Level& level = levels[l];
      rows_.add_pushes(level.about, method, measured[l]);
      rows.push_back(rows_.add_method(method, contacts, level.truths, measured[l]));
      if (method.kind != MethodKind::zone && l + 1 < levels.size()) continue;
      timers_.push_back({std::exchange(rows, {}), method.carried,
                         MethodTimer(*method.pack, method.model, method.rings, method.iterations, timed_sets,
                                     level.truths.part)});
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
        const double seconds = timed.carried ? effort_.seconds : effort_.seconds_of_settings;
        const int cold_frames = timed.carried ? effort_.cold_frames : effort_.cold_frames_of_settings;
        timed.timer.time_round(seconds / rounds, effort_.most_frames / rounds,
                               round + 1 < rounds ? 0 : cold_frames, &caches);
        bar.show(++done);
      }
    }
    for (const Timed& timed : timers_) {
      for (const size_t row : timed.rows) timed.timer.summarise(report_.methods[row]);
    }
    timers_.clear();
  }

  void time_copies() {
    constexpr int kCopies = 2000;
    for (const ComparedMethod& method : carried_methods(opened_)) {
      for (const pack::FrameCost* cost : *opened_.tables().costs()) {
        if (runtime_model(cost->model()) != method.model ||
            method.rings != (method.model == PAL_MODEL_ZONE ? opened_.info().zone_rings : 0))
          continue;
        const Timing timing = time_copy(method.name, cost->field_bytes(), kCopies);
        report_.copies.push_back({method.name, static_cast<double>(cost->field_bytes()) / 1024,
                                  palpate::summary_of(timing.nanoseconds, {})});
      }
    }
  }

  // Returns the method's site numbers for the organ's sites.
  std::vector<std::uint32_t> sites_of(const ComparedMethod& method) const {
    return method.pack == &opened_ ? all_sites() : others_->sites();
  }

  std::vector<std::uint32_t> all_sites() const {
    std::vector<std::uint32_t> sites(organ_.sites.sites.size());
    for (size_t i = 0; i < sites.size(); ++i) sites[i] = static_cast<std::uint32_t>(i);
    return sites;
  }

  const OpenedPack& opened_;
  const Organ& organ_;
  const SampleStore* store_;
  const ReportEffort& effort_;
  std::int64_t seed_;
  int jobs_;
  std::vector<double> parts_;  // fractions of the largest |d| in the comparison
  OrganReport report_;
  ReportRows rows_;
  std::unique_ptr<OtherSettings> others_;  // the timers refer to these packs
  std::vector<Timed> timers_;
};

}  // namespace

OrganReport measure_organ(const OpenedPack& opened, const Organ& organ, const SampleStore* store,
                          const ReportEffort& effort, std::int64_t seed, int jobs,
                          const std::filesystem::path& map) {
  return Measurement(opened, organ, store, effort, seed, jobs).run(map);
}

}  // namespace palpate
