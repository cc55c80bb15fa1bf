// palpate validate: measures a pack's errors again, at pushes that its builder has not seen.
#include <fmt/core.h>

#include <CLI/App.hpp>
#include <CLI/Validators.hpp>
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <iterator>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>

#include "offline/cli/commands.hpp"
#include "offline/cli/jobs_option.hpp"
#include "offline/cli/json_text.hpp"
#include "offline/output/progress_bar.hpp"
#include "offline/pipeline/carried_scene.hpp"
#include "offline/pipeline/held_out_pushes.hpp"
#include "offline/pipeline/motion_survey.hpp"
#include "offline/pipeline/opened_pack.hpp"
#include "offline/pipeline/survey_table.hpp"
#include "offline/pipeline/survey_validation.hpp"
#include "offline/precompute/site_survey.hpp"

namespace palpate {
namespace {

struct ValidateArguments {
  std::filesystem::path pack;
  int samples = 128;
  std::optional<int> sets;
  int paths = 16;
  std::int64_t seed = 1;
  int jobs = 1;
  bool json = false;
};

nlohmann::json validated_json(const SurveyValidation& model) {
  nlohmann::json json = survey_json(model.measured.table);
  json["p95_ratio"] = nullptr;  // no push was at a site of this model
  json["within_estimate"] = nullptr;
  if (!model.measured.errors.empty()) {
    json["p95_ratio"] = {{"displacement", model.displacement_ratio()}, {"force", model.force_ratio()}};
    json["within_estimate"] = {{"displacement", model.displacement_coverage()},
                               {"force", model.force_coverage()}};
  }
  json["agrees"] = model.agrees() && model.sets.agrees();
  if (model.sets.measured.answers.empty()) return json;
  json["several"] = set_survey_json(model.sets.measured.table);
  size_t i = 0;
  for (const SetKindErrors& kind : model.sets.measured.table.kinds) {
    json["several"][i++]["p95_ratio"] = {{"displacement", model.sets.displacement_ratio(kind.kind)},
                                         {"force", model.sets.force_ratio(kind.kind)}};
  }
  if (model.sets.measured.estimated == 0) return json;
  json["several_within_estimate"] = {{"displacement", model.sets.displacement_coverage()},
                                     {"force", model.sets.force_coverage()}};
  return json;
}

void print_validated(const std::vector<SurveyValidation>& models) {
  std::vector<ModelErrors> surveys;
  surveys.reserve(models.size());
  for (const SurveyValidation& model : models)
    surveys.push_back({model.model, {}, {}, model.measured.table, model.sets.measured.table});
  fmt::print("{}\n", survey_text(surveys));
  fmt::print(
      "                 p95 over the pack's      within the runtime's estimate, percent\n"
      "  model          displacement  force      displacement  force\n");
  for (const SurveyValidation& model : models) {
    if (model.measured.errors.empty()) {
      fmt::print("  {:<14} {:>12} {:>6} {:>17} {:>6}   not measured\n", model.model, "-", "-", "-", "-");
      continue;
    }
    fmt::print("  {:<14} {:12.2f} {:6.2f} {:17.1f} {:6.1f}   {}\n", model.model, model.displacement_ratio(),
               model.force_ratio(), 100 * model.displacement_coverage(), 100 * model.force_coverage(),
               model.agrees() ? "agrees" : "DISAGREES");
  }
  const std::string sets = set_survey_text(surveys);
  if (sets.empty()) return;
  fmt::print(
      "\n{}\n                 p95 over the pack's      without a flag: within the estimate, percent\n"
      "  model          displacement  force   answers  displacement  force\n",
      sets);
  for (const SurveyValidation& model : models) {
    for (const SetKindErrors& kind : model.sets.measured.table.kinds) {
      fmt::print("  {:<14} {:12.2f} {:6.2f}   {}\n", model.model, model.sets.displacement_ratio(kind.kind),
                 model.sets.force_ratio(kind.kind), words_for(kind.kind));
    }
    if (model.sets.measured.answers.empty()) continue;
    if (model.sets.measured.estimated == 0) {
      fmt::print("  {:<14} {:>29}   not estimated        {}\n", model.model, 0,
                 model.sets.agrees() ? "agrees" : "DISAGREES");
      continue;
    }
    fmt::print("  {:<14} {:>29} {:13.1f} {:6.1f}   {}\n", model.model, model.sets.measured.estimated,
               100 * model.sets.displacement_coverage(), 100 * model.sets.force_coverage(),
               model.sets.agrees() ? "agrees" : "DISAGREES");
  }
}

// Measures errors in motion from rest to at most `paths` truths, evenly chosen among `all`.
std::vector<MotionErrors> validate_motions(const OpenedPack& opened, const std::vector<ContactTruth>& all,
                                           int paths, int jobs) {
  constexpr double kSpeeds[] = {0.02, 0.05, 0.1, 0.2};  // m/s
  std::vector<ContactTruth> truths;
  const size_t count = std::min(all.size(), static_cast<size_t>(paths));
  for (size_t i = 0; i < count; ++i) truths.push_back(all[i * all.size() / count]);
  const auto solved =
      std::find_if(truths.begin(), truths.end(), [](const ContactTruth& truth) { return truth.solved; });
  if (opened.tables().nonlinear_zone() == nullptr || solved == truths.end()) return {};
  std::vector<Motion> motions;
  for (const int lag : {measure_lag(opened, *solved), 10, 30}) {  // ms
    for (const double speed : kSpeeds) motions.push_back({speed, lag});
  }
  ProgressBar bar("errors in motion", static_cast<int>(truths.size() * motions.size()));
  return survey_motions(opened, truths, motions, jobs, [&](int done, int) { bar.show(done); });
}

std::vector<SurveySample> solve_random_pushes(const OpenedPack& opened, const Organ& organ,
                                              const ValidateArguments& arguments) {
  const std::vector<Push> pushes =
      draw_pushes(opened, organ.scene, organ.sites, arguments.samples, arguments.seed);
  ProgressBar bar("solving pushes", arguments.samples);
  return solve_pushes(
      organ.assembly, organ.sites, pushes, arguments.jobs,
      [&](int done, int total) {
        bar.show(static_cast<int>(std::int64_t{arguments.samples} * done / total));
      },
      organ.rest);
}

// Returns no sets where the pack claims no errors of several contacts.
SolvedSets solve_random_sets(const OpenedPack& opened, const Organ& organ,
                             const ValidateArguments& arguments) {
  constexpr int kSets = 48;
  const std::vector<ModelErrors> claims = surveys_of(opened.tables());
  const bool are_claimed = std::any_of(claims.begin(), claims.end(),
                                       [](const ModelErrors& one) { return !one.sets.kinds.empty(); });
  if (!are_claimed && arguments.sets.value_or(0) > 0) {
    fmt::print(stderr, "{}: says nothing of several contacts at once; --sets {} was left out\n",
               arguments.pack.string(), *arguments.sets);
  }
  // This seed has the highest bit set, which no survey of a builder has.
  const std::uint64_t seed = static_cast<std::uint64_t>(arguments.seed) | std::uint64_t{1} << 63;
  std::vector<ContactSet> drawn = draw_contact_sets(organ.model, organ.scene, organ.sites,
                                                    are_claimed ? arguments.sets.value_or(kSets) : 0, seed);
  if (drawn.empty()) return {};
  ProgressBar bar("solving several contacts", static_cast<int>(drawn.size()));
  return solve_drawn_sets(organ.assembly, organ.sites, organ.rest, std::move(drawn), arguments.jobs, nullptr,
                          [&](int done, int) { bar.show(done); });
}

int run_validate(const ValidateArguments& arguments) {
  const auto start = std::chrono::steady_clock::now();
  const OpenedPack opened(arguments.pack);
  const Organ organ(read_carried_scene(opened, arguments.pack));
  check_same_sites(opened, organ, arguments.pack);
  const std::vector<SurveySample> samples = solve_random_pushes(opened, organ, arguments);
  const auto unsolved =
      std::count_if(samples.begin(), samples.end(), [](const SurveySample& one) { return !one.solved; });
  const SolvedSets sets = solve_random_sets(opened, organ, arguments);
  const std::vector<SurveyValidation> models =
      judge_pack(opened, samples, organ.scene.max_displacement, arguments.jobs, sets);
  const bool agrees = all_agree(models);
  std::vector<MotionErrors> motions =
      validate_motions(opened, truths_of(samples), arguments.paths, arguments.jobs);
  std::ranges::copy(validate_motions(opened, sets.truths, arguments.paths, arguments.jobs),
                    std::back_inserter(motions));
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (arguments.json) {
    nlohmann::json by_model = nlohmann::json::object();
    for (const SurveyValidation& one : models) by_model[one.model] = validated_json(one);
    fmt::print("{}\n", json_text({{"pack", arguments.pack.string()},
                                  {"samples", arguments.samples},
                                  {"sets", sets.sets.size()},
                                  {"seed", arguments.seed},
                                  {"seconds", seconds},
                                  {"pushes_without_equilibrium", unsolved},
                                  {"models", by_model},
                                  {"motion", motion_json(motions)},
                                  {"agrees", agrees}}));
  } else {
    const std::string several =
        sets.sets.empty() ? "" : fmt::format(" and {} sets of several contacts", sets.sets.size());
    fmt::print("solved {} pushes{} at random sites, seed {}, in {:.1f} s\n\n", arguments.samples, several,
               arguments.seed, seconds);
    print_validated(models);
    if (!motions.empty()) fmt::print("\n{}", motion_text(motions));
  }
  if (unsolved > 0) {
    fmt::print(stderr, "{}: {} of {} pushes reached no equilibrium and count as errors of 100 %\n",
               arguments.pack.string(), unsolved, arguments.samples);
  }
  return agrees ? 0 : 2;
}

}  // namespace

void add_validate_command(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<ValidateArguments>();
  CLI::App* command =
      app.add_subcommand("validate", "Measure a pack's errors again, at pushes its builder has not seen");
  command->footer(
      "Solves random pushes of the organ in full, from rest, with the model that the pack carries, and\n"
      "compares the runtime's answers. A model agrees where 95 % of its new errors are within 1.5 times the\n"
      "pack's p95, and within what the runtime estimated for them, as far as so many pushes can tell: if\n"
      "that were so, worse would be seen once in a hundred times. Sets of several contacts are judged alike, "
      "each beside\n"
      "the pack's p95 of its kind. Exit code 2 where one does not.\n\n"
      "In motion, the contacts of a nonlinear zone come straight from rest at 20, 50, 100 and 200 mm/s. The\n"
      "errors are those of the frame that reaches a push, with the lag of this machine's refining lane, and\n"
      "with lags of 10 and 30 ms. They are shown, not judged.\n\n"
      "Example: palpate validate brain.pack --samples 200 --seed 7");
  command->add_option("PACK", arguments->pack, "Pack made by `palpate build`")->type_name("")->required();
  command
      ->add_option("--samples", arguments->samples,
                   "Pushes; default 128, as many in each quarter of the range")
      ->type_name("N")
      ->check(CLI::Range(1, 1000000));
  command
      ->add_option("--sets", arguments->sets,
                   "Sets of several contacts, where the pack says how wrong it is of such; default 48, as "
                   "many of each kind")
      ->type_name("N")
      ->check(CLI::Range(0, 1000000));
  command
      ->add_option("--paths", arguments->paths,
                   "Pushes, and as many sets, whose errors are measured in motion too, where the pack has "
                   "nonlinear zones; default 16")
      ->type_name("N")
      ->check(CLI::Range(0, 1000000));
  command->add_option("--seed", arguments->seed, "Other pushes for another seed; default 1")
      ->type_name("S")
      ->check(CLI::Range(std::int64_t{0}, std::numeric_limits<std::int64_t>::max()));
  add_jobs_option(*command, arguments->jobs);
  command->add_flag("--json", arguments->json, "Print the result as JSON");
  command->callback([arguments, &exit_code] { exit_code = run_validate(*arguments); });
}

}  // namespace palpate
