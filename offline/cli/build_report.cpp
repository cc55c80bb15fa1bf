#include "offline/cli/build_report.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <string>

#include "offline/cli/json_text.hpp"
#include "offline/pipeline/build_plan.hpp"
#include "offline/pipeline/compliance_errors.hpp"
#include "offline/pipeline/organ_size.hpp"
#include "offline/pipeline/survey_table.hpp"

namespace palpate {
namespace {

struct Totals {
  double min_jacobian = 1;
  int unsolved = 0;                      // pushes of the survey without a full solution
  int surveyed = 0;                      // pushes of the survey
  int shortened = 0;                     // sites with a smaller domain
  std::array<int, 6> shortened_by = {};  // by PushOutcome
  int off_target = 0;                    // sites whose fit misses the target on held-out samples
  double worst_held_out = 0;             // largest displacement error of a site on held-out samples, over |d|
  double worst_held_out_force = 0;
  size_t worst_site = 0;  // site with the largest held-out error
};

Totals totals_of(const BuildResult& result) {
  const Scene& scene = result.content.scene;
  Totals totals;
  for (const SiteResult& site : result.sites) {
    totals.min_jacobian = std::min(totals.min_jacobian, site.min_jacobian);
    totals.unsolved += site.unsolved;
    totals.surveyed += static_cast<int>(site.survey.size());
    if (scene.polynomial && is_shortened(least_reach(site.polynomial.to_unit), scene.max_displacement)) {
      ++totals.shortened;
      ++totals.shortened_by.at(static_cast<size_t>(site.cut_by));
    }
    const double held_out = std::max(site.held_out_error, site.held_out_force_error);
    totals.off_target += held_out > scene.accuracy_target;
    if (held_out > std::max(totals.worst_held_out, totals.worst_held_out_force))
      totals.worst_site = static_cast<size_t>(&site - result.sites.data());
    totals.worst_held_out = std::max(totals.worst_held_out, site.held_out_error);
    totals.worst_held_out_force = std::max(totals.worst_held_out_force, site.held_out_force_error);
  }
  return totals;
}

// Returns the surveys of polynomial_dd and affine_site, or the last survey where the build has neither model.
std::vector<const SurveyTable*> best_surveys(const BuildResult& result) {
  std::vector<const SurveyTable*> best;
  for (const ModelSurvey& survey : result.content.surveys) {
    if (survey.model == SurveyedModel::polynomial_dd || survey.model == SurveyedModel::affine_site)
      best.push_back(&survey.table);
  }
  if (best.empty()) best.push_back(&result.content.surveys.back().table);
  return best;
}

// Whether each range of |d| (bin) has measured errors of at least one model. Few sites leave some bins empty.
bool is_measured(const BuildResult& result) {
  if (result.content.surveys.empty()) return false;
  const auto surveys = best_surveys(result);
  for (size_t bin = 0; bin < surveys.front()->bins.size(); ++bin) {
    if (std::none_of(surveys.begin(), surveys.end(),
                     [&](const SurveyTable* table) { return table->bins[bin].samples > 0; }))
      return false;
  }
  return true;
}

// Returns the overall errors of the survey with the largest overall p95 of the displacement error.
const SurveyBin& worst_overall(const BuildResult& result) {
  const auto surveys = best_surveys(result);
  return (*std::max_element(surveys.begin(), surveys.end(),
                            [](const SurveyTable* one, const SurveyTable* other) {
                              return one->overall.displacement.p95 < other->overall.displacement.p95;
                            }))
      ->overall;
}

bool is_on_target(const BuildResult& result) {
  return worst_overall(result).displacement.p95 <= result.content.scene.accuracy_target;
}

const SetSurvey* sets_of(const BuildResult& result, SurveyedModel model) {
  for (const ModelSurvey& survey : result.content.surveys) {
    if (survey.model == model) return &survey.sets;
  }
  return nullptr;
}

// Lists the kinds of contact sets where nonlinear_zone misses the target: "2 near (2.3 %), 3 apart (1.2 %)".
std::string sets_off_target(const BuildResult& result) {
  const SetSurvey* zone = sets_of(result, SurveyedModel::nonlinear_zone);
  std::string kinds;
  if (zone == nullptr) return kinds;
  for (const SetKindErrors& kind_errors : zone->kinds) {
    const double p95 = kind_errors.displacement.p95;
    if (p95 <= result.content.scene.accuracy_target) continue;
    kinds +=
        fmt::format("{}{} ({:.3g} %)", kinds.empty() ? "" : ", ", words_for(kind_errors.kind), 100 * p95);
  }
  return kinds;
}

// Returns the labels of all sites of the scene that the pack lacks.
std::vector<int> left_out_labels(const BuildResult& result) {
  std::vector<int> labels;
  for (const LeftOutSite& site : result.content.sites.left_out)
    labels.push_back(result.content.model.labels[static_cast<size_t>(site.node)]);
  std::sort(labels.begin(), labels.end());
  return labels;
}

}  // namespace

void print_json(const BuildResult& result) {
  const Totals totals = totals_of(result);
  const Scene& scene = result.content.scene;
  const ContactSites& sites = result.content.sites;
  fmt::print("{}\n",
             json_text({{"pack", result.pack.string()},
                        {"bytes", result.opened.bytes().size()},
                        {"seconds", result.seconds},
                        {"sampling_seconds", result.sampling_seconds},
                        {"sites", sites.sites.size()},
                        {"sites_left_out", left_out_labels(result)},
                        {"tip_below_edge", is_tip_below_edge(scene.tip_radius, sites.mean_surface_edge)},
                        {"sites_sampled", scene.polynomial ? num_sampled(result.sites) : 0},
                        {"max_displacement_over_h", scene.max_displacement / sites.mean_surface_edge},
                        {"solves", result.counts.solves},
                        {"reused", result.counts.reused},
                        {"iterations", result.counts.iterations},
                        {"factorizations", result.counts.factorizations},
                        {"min_J", totals.min_jacobian},
                        {"sites_with_smaller_domain", totals.shortened},
                        {"sites_off_target", totals.off_target},
                        {"survey_pushes_without_equilibrium", totals.unsolved},
                        {"target_met", is_measured(result) && is_on_target(result)},
                        {"frame_us", result.frame_us()},
                        {"new_places_us", result.new_places_us},
                        {"budget_met", result.frame_us() <= scene.frame_budget_us},
                        {"compliance", compliance_json(result.opened.tables())},
                        {"errors", survey_json(surveys_of(result.opened.tables()))}}));
}

void print_text(const BuildResult& result) {
  const Totals totals = totals_of(result);
  const Scene& scene = result.content.scene;
  if (const CompressedCompliance* compressed = result.content.compressed) {
    fmt::print(
        "compliance {:.1f} MB; against exact linear solves of {} sets of contacts, displacements are wrong "
        "by at most {:.2g} of |d|, forces by {:.2g}\n",
        static_cast<double>(compressed->num_bytes()) / 1e6, compressed->samples,
        compressed->displacement_error, compressed->force_error);
  }
  fmt::print("solved     {} equilibria in {} iterations with {} factors{}\n", result.counts.solves,
             result.counts.iterations, result.counts.factorizations,
             scene.polynomial ? fmt::format("; smallest J {:.3f}", totals.min_jacobian) : "");
  if (result.plan.fewest) {
    const size_t sampled = num_sampled(result.sites);
    fmt::print(
        "sampled    {} of {} sites{}\n", sampled, result.sites.size(),
        sampled < result.sites.size() ? "; at the others their derivatives at rest keep the target" : "");
  }
  if (result.counts.solves > 0) {
    fmt::print("speed      {:.3g} equilibria a second on {} threads{}, {:.3g} s a site\n",
               static_cast<double>(result.counts.solves) / result.sampling_seconds, result.plan.jobs,
               result.processes > 1 ? fmt::format(" of each of {} processes", result.processes) : "",
               result.sampling_seconds / static_cast<double>(num_worked(result.plan, result.content.sites)));
  }
  if (!result.samples.empty()) {
    fmt::print("samples    {} kept in {}, {} of them taken from there\n",
               result.counts.solves + result.counts.reused - result.counts.not_kept, result.samples.string(),
               result.counts.reused);
  }
  fmt::print("wrote      {}: {:.1f} MB in {:.1f} s\n", result.pack.string(),
             static_cast<double>(result.opened.bytes().size()) / 1e6, result.seconds);
  const std::vector<ModelErrors> surveys = surveys_of(result.opened.tables());
  const std::uint32_t contacts = result.scene_frame.contacts;
  fmt::print("frame      forces of {} {} {} in {:.2f} us (median) on this machine; the budget is {:g} us\n",
             contacts, contacts == 1 ? "contact" : "contacts",
             result.scene_frame.is_zone ? "that move" : "at new sites", result.frame_us(),
             scene.frame_budget_us);
  if (result.new_places_us > 0)
    fmt::print(
        "           in {:.0f} us where several are all at new places between sites; a session with a "
        "budget spreads that over frames\n",
        result.new_places_us);
  if (surveys.empty()) return fmt::print("survey     none: the runtime cannot estimate its errors\n");
  fmt::print("\n{}\n", survey_text(surveys));
  if (const std::string sets = set_survey_text(surveys); !sets.empty()) fmt::print("{}\n", sets);
  if (const std::string kinds = sets_off_target(result); !kinds.empty()) {
    fmt::print("Of several contacts nonlinear_zone misses the target of {:.3g} %, p95: {}.\n\n",
               100 * scene.accuracy_target, kinds);
  }
}

void print_warnings(const BuildResult& result) {
  const Totals totals = totals_of(result);
  const Scene& scene = result.content.scene;
  const std::string file = scene.file.string();
  const size_t num_sites = result.content.sites.sites.size();
  if (!result.left_out.empty())
    fmt::print(stderr, "{}\n", left_out_text(scene, result.content.model, result.left_out, num_sites));
  if (result.counts.not_kept > 0) {
    fmt::print(stderr,
               "{}: {} solves could not be kept, another build has to repeat them; make room on the disk, or "
               "name another folder with --samples\n",
               result.samples.string(), result.counts.not_kept);
  }
  if (totals.shortened > 0) {
    std::string reasons;
    for (size_t i = 0; i < totals.shortened_by.size(); ++i) {
      if (totals.shortened_by[i] == 0) continue;
      reasons += fmt::format("{}{} ({})", reasons.empty() ? "" : ", ", words_for(static_cast<PushOutcome>(i)),
                             totals.shortened_by[i]);
    }
    fmt::print(stderr,
               "{}: {} of {} sites are sampled less far than max_displacement in some directions: {}\n", file,
               totals.shortened, num_sites, reasons);
  }
  if (totals.unsolved > 0) {
    fmt::print(stderr,
               "{}: {} of {} survey pushes reached no equilibrium and count as errors of 100 %; reduce "
               "max_displacement\n",
               file, totals.unsolved, totals.surveyed);
  }
  if (result.frame_us() > scene.frame_budget_us) {
    fmt::print(stderr,
               "{}: a haptic frame takes {:.3g} us here, above the budget of {:g} us; reduce max_contacts, "
               "tip_radius or zone_rings, or raise [budget] frame_us\n",
               file, result.frame_us(), scene.frame_budget_us);
  }
  if (result.content.surveys.empty()) return;
  if (!is_measured(result)) {
    fmt::print(stderr, "{}: part of the range of |d| could not be measured; reduce max_displacement\n", file);
  }
  if (!is_on_target(result)) {
    const SurveyBin& overall = worst_overall(result);
    fmt::print(stderr,
               "{}: the p95 displacement error is {:.3g} % over the survey (force: {:.3g} %), above the "
               "target of {:.3g} %; reduce max_displacement or raise [accuracy] target\n",
               file, 100 * overall.displacement.p95, 100 * overall.force.p95, 100 * scene.accuracy_target);
  } else if (totals.off_target > 0) {
    fmt::print(stderr,
               "{}: {} of {} sites do not keep the target with {} solves (held-out errors: displacement up "
               "to {:.3g} %, "
               "force up to {:.3g} %, the worst at node {}, target {:.3g} %), although the whole survey "
               "keeps the target\n",
               file, totals.off_target, num_sites, result.plan.most_samples, 100 * totals.worst_held_out,
               100 * totals.worst_held_out_force, result.opened.label_of_site(totals.worst_site),
               100 * scene.accuracy_target);
  }
}

}  // namespace palpate
