#include "offline/cli/organ_report.hpp"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "offline/cli/compared_methods.hpp"
#include "offline/cli/error_map.hpp"
#include "offline/cli/held_out_pushes.hpp"
#include "offline/cli/kept_promise.hpp"
#include "offline/cli/measured_push.hpp"
#include "offline/cli/method_timing.hpp"
#include "offline/cli/progress_bar.hpp"
#include "offline/cli/reference_methods.hpp"
#include "offline/cli/report_pushes.hpp"
#include "offline/cli/survey_table.hpp"
#include "offline/precompute/local_thickness.hpp"

namespace palpate {
namespace {

constexpr size_t kTimedSets = 4;  // of sites
constexpr size_t kTimedSetsOfSeveral = 1;

// Of those that have a truth.
ErrorSummary summary_of(const std::vector<MeasuredPush>& pushes, const std::vector<ContactTruth>& truths,
                        double MeasuredPush::*error) {
  std::vector<double> values;
  for (size_t i = 0; i < pushes.size(); ++i) {
    if (truths[i].solved) values.push_back(pushes[i].*error);
  }
  return {quantile(values, 0.5), quantile(values, 0.95), quantile(values, 1)};
}

// Gathers rows of one organ.
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
        surface_(extract_surface(organ.model)) {}

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
  // With where and how far each of its pushes goes.
  struct Level {
    LevelTruths truths;
    std::vector<PushRow> about;
  };
  struct Timed {
    std::vector<size_t> rows;  // in report_.methods
    std::unique_ptr<MethodTimer> timer;
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
  }

  // Random pushes at all sites: whether the pack keeps what it says, and how its errors are distributed.
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
    const std::vector<PushRow> about = describe_pushes("random", truths, number);
    report_.unsolved = static_cast<int>(
        std::count_if(truths.begin(), truths.end(), [](const ContactTruth& truth) { return !truth.solved; }));
    std::vector<NodeErrors> worst;
    for (const ComparedMethod& method : carried_methods(opened_)) {
      ModelUnitSession session(opened_, method.model, 1, 0, method.rings);
      NodeErrors& of_method = worst.emplace_back(NodeErrors{method.name, {}});
      const std::vector<MeasuredPush> measured =
          measure_pushes(truths, runtime_method(session, all_sites()), &of_method.largest);
      add_pushes(about, method, measured);
      if (method.model != PAL_MODEL_ZONE || method.rings == opened_.info().zone_rings)
        add_promise(method.model, survey_of(samples, measured, organ_.scene.max_displacement));
    }
    if (draw_error_map(opened_, organ_, std::move(worst), map)) report_.error_map = map;
  }

  // What the pack's own survey says of a model, and what this one does.
  void add_promise(pal_model model, RuntimeSurvey measured) {
    for (const ModelErrors& claimed : surveys_of(opened_.tables())) {
      if (claimed.runtime_model != model) continue;
      const KeptPromise promise{claimed.model, claimed.table.overall, std::move(measured)};
      const SurveyBin& found = promise.measured.table.overall;
      report_.promises.push_back({promise.model, found.samples, promise.claimed.displacement.p95,
                                  found.displacement.p95, promise.claimed.force.p95, found.force.p95,
                                  promise.displacement_coverage(), promise.force_coverage(),
                                  promise.agrees()});
      return;
    }
  }

  void compare_at_levels() {
    const std::vector<size_t> sites = compared_sites(organ_, effort_.most_sites);
    report_.sites_compared = static_cast<int>(sites.size());
    const Organ study(with_sites(organ_, sites));
    others_ = std::make_unique<OtherSettings>(opened_, study, effort_, jobs_, store_, report_.notes);
    std::vector<std::uint32_t> in_study(organ_.sites.sites.size());
    for (size_t i = 0; i < study.sites.sites.size(); ++i) {
      for (const size_t site : sites) {
        if (organ_.sites.sites[site].node == study.sites.sites[i].node)
          in_study[site] = static_cast<std::uint32_t>(i);
      }
    }
    const std::vector<Level> levels =
        described("levels", 1, solve_levels(opened_, organ_, sites, effort_.pushes_at_level, seed_, jobs_));
    std::vector<ComparedMethod> methods = carried_methods(opened_);
    methods.insert(methods.end(), others_->methods().begin(), others_->methods().end());
    std::vector<std::vector<size_t>> site_sets;
    for (size_t i = 0; i < std::min(kTimedSets, sites.size()); ++i) site_sets.push_back({sites[i]});
    {
      ProgressBar bar("methods", static_cast<int>(methods.size() * levels.size()));
      int done = 0;
      for (const ComparedMethod& method : methods) {
        compare(method, method.carried ? all_sites() : in_study, levels, site_sets,
                [&] { bar.show(++done); });
      }
    }
    compare_references(levels, sites);
  }

  void compare_several() {
    const int contacts = std::min({3, organ_.scene.max_contacts, report_.sites});
    if (contacts < 2) return;
    const std::vector<Level> levels = described(
        "several", contacts, solve_several(opened_, organ_, contacts, effort_.several, seed_, jobs_));
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
    for (const ComparedMethod& method : carried_methods(opened_)) {
      if (method.kind == MethodKind::polynomial) continue;  // answers one contact alone
      compare(method, all_sites(), levels, site_sets, [] {});
    }
  }

  // Errors at each level, and a timer for them: only a zone's frames depend on how far it is pushed.
  void compare(const ComparedMethod& method, const std::vector<std::uint32_t>& sites,
               const std::vector<Level>& levels, const std::vector<std::vector<size_t>>& site_sets,
               const std::function<void()>& progress) {
    std::vector<std::vector<std::uint32_t>> timed_sets;
    for (const std::vector<size_t>& one : site_sets) {
      std::vector<std::uint32_t>& timed = timed_sets.emplace_back();
      for (const size_t site : one) timed.push_back(sites[site]);
    }
    const auto contacts = static_cast<std::uint32_t>(site_sets.front().size());
    ModelUnitSession session(*method.pack, method.model, contacts, 0, method.rings);
    const Method answer = runtime_method(session, sites);
    std::vector<size_t> rows;
    for (const Level& level : levels) {
      const std::vector<MeasuredPush> pushes = measure_pushes(level.truths.truths, answer);
      add_pushes(level.about, method, pushes);
      rows.push_back(add_row(method.kind, method.name, method.carried, static_cast<int>(contacts),
                             level.truths, pushes));
      progress();
      if (method.kind != MethodKind::zone && &level != &levels.back()) continue;
      timers_.push_back(
          {std::exchange(rows, {}), std::make_unique<MethodTimer>(*method.pack, method.model, method.rings,
                                                                  timed_sets, level.truths.part)});
    }
  }

  void compare_references(const std::vector<Level>& levels, const std::vector<size_t>& sites) {
    BackSolver back_solver(organ_);
    const auto path = [&](int frame, double part) {
      const pal_contact contact = on_path(0, part * organ_.scene.max_displacement, frame);
      return Eigen::Vector3d(contact.displacement);
    };
    const TimeSummary back_solve = time_calls(10 * effort_.newton_frames, [&](int frame) {
      back_solver.answer({{sites.front(), path(frame, 1)}});
    });
    ProgressBar bar("full Newton", static_cast<int>(levels.size()));
    int done = 0;
    for (const Level& level : levels) {
      const double part = level.truths.part;
      const size_t row = add_row(MethodKind::back_solve, "linear, back-solve", false, 1, level.truths,
                                 measure_pushes(level.truths.truths, [&](const auto& contacts) {
                                   return back_solver.answer(contacts);
                                 }));
      report_.methods[row].haptic = back_solve;
      NewtonFrames newton(organ_, sites.front());
      MethodRow exact;
      exact.kind = MethodKind::newton;
      exact.name = "full Newton, warm";
      exact.part = part;
      exact.haptic = time_calls(effort_.newton_frames, [&](int frame) { newton.frame(path(frame, part)); });
      report_.methods.push_back(exact);
      bar.show(++done);
    }
  }

  void time_all() {
    constexpr int kRounds = 5;
    ProgressBar bar("timing frames", (kRounds + 1) * static_cast<int>(timers_.size()));
    int done = 0;
    // By turns, so that what else the machine does meets all of them alike.
    for (int round = 0; round < kRounds; ++round) {
      for (Timed& timed : timers_) {
        timed.timer->time_warm(effort_.seconds / kRounds, effort_.most_frames / kRounds);
        bar.show(++done);
      }
    }
    CacheEvictor caches;
    for (Timed& timed : timers_) {
      timed.timer->time_cold(effort_.cold_frames, caches);
      for (const size_t row : timed.rows) timed.timer->summarise(report_.methods[row]);
      bar.show(++done);
    }
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

  std::vector<std::uint32_t> all_sites() const {
    std::vector<std::uint32_t> sites(organ_.sites.sites.size());
    for (size_t i = 0; i < sites.size(); ++i) sites[i] = static_cast<std::uint32_t>(i);
    return sites;
  }

  std::vector<Level> described(const std::string& set, int contacts, std::vector<LevelTruths> levels) {
    int number = 0;
    int unsolved = 0;
    std::vector<Level> described;
    for (LevelTruths& level : levels) {
      std::vector<PushRow> about = describe_pushes(set, level.truths, number);
      for (const PushRow& push : about) unsolved += push.solved ? 0 : 1;
      described.push_back({std::move(level), std::move(about)});
    }
    if (unsolved > 0) {
      report_.notes.push_back(fmt::format(
          "{} of {} pushes of {} contact{} reached no equilibrium in the full solve; they have no truth and "
          "are left out.",
          unsolved, number, contacts, contacts > 1 ? "s" : ""));
    }
    return described;
  }

  // Where and how far, for all methods alike; counts them in `number`.
  std::vector<PushRow> describe_pushes(const std::string& set, const std::vector<ContactTruth>& truths,
                                       int& number) const {
    std::vector<PushRow> rows;
    for (const ContactTruth& truth : truths) {
      PushRow row;
      row.set = set;
      row.push = number++;
      row.contacts = static_cast<int>(truth.contacts.size());
      std::vector<int> labels;
      for (const LinearContact& contact : truth.contacts)
        labels.push_back(opened_.label_of_site(contact.site));
      row.sites = fmt::format("{}", fmt::join(labels, "+"));
      const LinearContact& first = truth.contacts.front();
      Eigen::Vector3d::Map(row.displacement.data()) = first.displacement;
      row.size = truth.largest_displacement();
      row.part = row.size / organ_.scene.max_displacement;
      if (row.contacts == 1) {
        const double thickness =
            local_thickness(organ_.model, surface_, organ_.sites.sites[first.site], first.displacement);
        if (std::isfinite(thickness)) row.strain = row.size / thickness;
      }
      row.solved = truth.solved;
      rows.push_back(std::move(row));
    }
    return rows;
  }

  void add_pushes(const std::vector<PushRow>& about, const ComparedMethod& method,
                  const std::vector<MeasuredPush>& pushes) {
    for (size_t i = 0; i < pushes.size(); ++i) {
      PushRow row = about[i];
      row.name = method.name;
      row.kind = method.kind;
      row.carried = method.carried;
      row.displacement_error = pushes[i].displacement_error;
      row.force_error = pushes[i].force_error;
      row.force_error_unfloored = pushes[i].force_error_unfloored;
      row.displacement_off = pushes[i].displacement_off;
      row.force_off = pushes[i].force_off;
      constexpr double kNotMeasured = 1;
      if (row.solved && method.carried && pushes[i].displacement_estimate < kNotMeasured) {
        row.displacement_estimate = pushes[i].displacement_estimate;
        row.force_estimate = pushes[i].force_estimate;
      }
      report_.pushes.push_back(std::move(row));
    }
  }

  size_t add_row(MethodKind kind, const std::string& name, bool carried, int contacts,
                 const LevelTruths& level, const std::vector<MeasuredPush>& pushes) {
    MethodRow row;
    row.kind = kind;
    row.name = name;
    row.carried = carried;
    row.contacts = contacts;
    row.part = level.part;
    row.pushes = static_cast<int>(std::count_if(level.truths.begin(), level.truths.end(),
                                                [](const ContactTruth& truth) { return truth.solved; }));
    row.displacement = summary_of(pushes, level.truths, &MeasuredPush::displacement_error);
    row.force = summary_of(pushes, level.truths, &MeasuredPush::force_error);
    row.force_unfloored = summary_of(pushes, level.truths, &MeasuredPush::force_error_unfloored);
    row.displacement_off = summary_of(pushes, level.truths, &MeasuredPush::displacement_off);
    row.force_off = summary_of(pushes, level.truths, &MeasuredPush::force_off);
    report_.methods.push_back(row);
    return report_.methods.size() - 1;
  }

  const OpenedPack& opened_;
  const Organ& organ_;
  const SampleStore* store_;
  const ReportEffort& effort_;
  std::int64_t seed_;
  int jobs_;
  Surface surface_;
  OrganReport report_;
  std::unique_ptr<OtherSettings> others_;  // whose packs the timers use
  std::vector<Timed> timers_;
};

}  // namespace

OrganReport measure_organ(const OpenedPack& opened, const Organ& organ, const SampleStore* store,
                          const ReportEffort& effort, std::int64_t seed, int jobs,
                          const std::filesystem::path& map) {
  return Measurement(opened, organ, store, effort, seed, jobs).run(map);
}

}  // namespace palpate
