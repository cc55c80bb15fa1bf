// palpate validate: the errors that a pack claims, measured again at pushes that its builder has not seen.
#include <fmt/core.h>
#include <stdlib.h>

#include <CLI/App.hpp>
#include <CLI/Validators.hpp>
#include <Eigen/LU>
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>
#include <random>

#include "offline/cli/commands.hpp"
#include "offline/cli/jobs_option.hpp"
#include "offline/cli/json_text.hpp"
#include "offline/cli/opened_pack.hpp"
#include "offline/cli/progress_bar.hpp"
#include "offline/cli/runtime_survey.hpp"
#include "offline/cli/survey_table.hpp"
#include "offline/precompute/rest_state.hpp"
#include "offline/precompute/scene.hpp"
#include "offline/precompute/site_survey.hpp"

namespace palpate {
namespace {

// A new p95 may be so many times the pack's; errors below the rounding of fields in float32 are alike.
constexpr double kMostRatio = 1.5;
constexpr double kRounding = 1e-5;
// 95 % of errors are as said, or of so few pushes not so many less that chance does it once in a hundred times.
constexpr double kLeastChance = 0.01;

struct ValidateArguments {
  std::filesystem::path pack;
  int samples = 128;
  std::int64_t seed = 1;
  int jobs = 1;
  bool json = false;
};

// A folder of its own, gone with it.
class ScratchFolder {
 public:
  ScratchFolder() {
    std::error_code error;
    std::string pattern = (std::filesystem::temp_directory_path(error) / "palpate-XXXXXX").string();
    if (error || mkdtemp(pattern.data()) == nullptr)
      throw std::runtime_error("no folder for its files can be made; set TMPDIR to one that can be written");
    path_ = pattern;
  }
  ~ScratchFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

// From the files that the pack carries. Paths that lead out of their folders, as absolute ones do, find what
// lies there today, or nothing.
LoadedScene read_scene_of(const OpenedPack& opened) {
  const ScratchFolder folder;
  std::vector<std::filesystem::path> files = {write_inputs(opened.tables(), opened.bytes(), folder.path())};
  try {
    LoadedScene loaded = read_scene(files.front());
    files.insert(files.end(), loaded.model.files.begin(), loaded.model.files.end());
    const auto& carried = *opened.tables().inputs();
    const std::vector<InputFile> inputs = read_inputs(files);
    for (unsigned i = 0; i < inputs.size(); ++i) {
      if (i >= carried.size() || inputs[i].hash != carried.Get(i)->xxh3_128()->str())
        throw std::runtime_error(files[i].string() + " is not what the pack was made from");
    }
    return loaded;
  } catch (const std::exception& error) {
    throw std::runtime_error(
        error.what() +
        std::string("; build it again from a scene and a model that name files from their own folders"));
  }
}

// From the unit ball to the displacements that were sampled at a site.
Eigen::Matrix3d sampled_domain(const OpenedPack& opened, const Scene& scene, const ContactSites& sites,
                               size_t site) {
  const pack::PolynomialDd* polynomial = opened.tables().polynomial_dd();
  if (polynomial != nullptr) {
    const double* to_unit = opened.segment<pack::PolynomialSite>(*polynomial->sites())[site].to_unit;
    return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(to_unit).inverse();
  }
  return scene.max_displacement * sites.sites[site].frame;
}

// At sites drawn with the same chance, as many in each quarter of the range.
std::vector<Push> draw_pushes(const OpenedPack& opened, const Scene& scene, const ContactSites& sites,
                              const ValidateArguments& arguments) {
  const bool half = scene.directions == Directions::inward;
  std::mt19937_64 random(static_cast<std::uint64_t>(arguments.seed));
  // Surveys of builders are seeded by labels, which this is not.
  const std::vector<Eigen::Vector3d> points =
      choose_survey_points(arguments.samples, half, random() | std::uint64_t{1} << 63);
  std::vector<Push> pushes;
  for (const Eigen::Vector3d& point : points) {
    const size_t site = random() % sites.sites.size();
    pushes.push_back(
        {site, sampled_domain(opened, scene, sites, site) * point, survey_increments(point.norm())});
  }
  return pushes;
}

// One model of the pack, as it says and as it is.
struct Validated {
  std::string model;
  SurveyBin claimed;
  RuntimeSurvey measured;

  static double ratio(const ErrorFigures& found, const ErrorFigures& claim) {
    return std::max(found.p95, kRounding) / std::max(claim.p95, kRounding);
  }
  // Whether 95 % of all errors may lie within kMostRatio times the claim: of few pushes the p95 itself is mostly chance.
  bool keeps(double SampleErrors::*error, const ErrorFigures& claim) const {
    const double most = kMostRatio * std::max(claim.p95, kRounding);
    const auto within = std::count_if(measured.errors.begin(), measured.errors.end(),
                                      [&](const SampleErrors& one) { return one.*error <= most; });
    return chance_of_covering(static_cast<int>(within), static_cast<int>(measured.errors.size())) >=
           kLeastChance;
  }
  double displacement_ratio() const {
    return ratio(measured.table.overall.displacement, claimed.displacement);
  }
  double force_ratio() const { return ratio(measured.table.overall.force, claimed.force); }
  double part(int covered) const { return measured.solved > 0 ? 1.0 * covered / measured.solved : 0; }
  bool agrees() const {
    return keeps(&SampleErrors::displacement, claimed.displacement) &&
           keeps(&SampleErrors::force, claimed.force) &&
           chance_of_covering(measured.displacement_covered, measured.solved) >= kLeastChance &&
           chance_of_covering(measured.force_covered, measured.solved) >= kLeastChance;
  }
};

nlohmann::json validated_json(const Validated& model) {
  nlohmann::json json = survey_json(model.measured.table);
  json["p95_ratio"] = {{"displacement", model.displacement_ratio()}, {"force", model.force_ratio()}};
  json["within_estimate"] = {{"displacement", model.part(model.measured.displacement_covered)},
                             {"force", model.part(model.measured.force_covered)}};
  json["agrees"] = model.agrees();
  return json;
}

void print_validated(const std::vector<Validated>& models) {
  std::vector<ModelErrors> surveys;
  for (const Validated& model : models) surveys.push_back({model.model, {}, model.measured.table});
  fmt::print("{}\n", survey_text(surveys));
  fmt::print(
      "                 p95 over the pack's      within the runtime's estimate, percent\n"
      "  model          displacement  force      displacement  force\n");
  for (const Validated& model : models) {
    fmt::print("  {:<14} {:12.2f} {:6.2f} {:17.1f} {:6.1f}   {}\n", model.model, model.displacement_ratio(),
               model.force_ratio(), 100 * model.part(model.measured.displacement_covered),
               100 * model.part(model.measured.force_covered), model.agrees() ? "agrees" : "DISAGREES");
  }
}

int run_validate(const ValidateArguments& arguments) {
  const auto start = std::chrono::steady_clock::now();
  const OpenedPack opened(arguments.pack);
  const auto [scene, model] = [&] {
    try {
      return read_scene_of(opened);
    } catch (const std::exception& error) {
      throw std::runtime_error(arguments.pack.string() + ": " + error.what());
    }
  }();
  const ContactSites sites = find_contact_sites(scene, model);
  if (sites.sites.size() != opened.info().num_sites || sites.packed_nodes.size() != opened.info().num_nodes)
    throw std::runtime_error(arguments.pack.string() +
                             ": its scene now has other sites; build it again with this version");
  const Assembly assembly(model, model.fixed_dofs());
  const RestState rest = find_rest(assembly, scene);
  const std::vector<Push> pushes = draw_pushes(opened, scene, sites, arguments);
  std::vector<SurveySample> samples;
  {
    ProgressBar bar("solving pushes", arguments.samples);
    samples = solve_pushes(
        assembly, sites, pushes, arguments.jobs,
        [&](int done, int total) {
          bar.show(static_cast<int>(std::int64_t{arguments.samples} * done / total));
        },
        rest);
  }
  const auto unsolved =
      std::count_if(samples.begin(), samples.end(), [](const SurveySample& one) { return !one.solved; });

  std::vector<Validated> models;
  for (const ModelErrors& claimed : surveys_of(opened.tables())) {
    models.push_back({claimed.model, claimed.table.overall,
                      survey_runtime(opened, claimed.runtime_model, samples, scene.max_displacement)});
  }
  const bool agrees =
      std::all_of(models.begin(), models.end(), [](const Validated& one) { return one.agrees(); });
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (arguments.json) {
    nlohmann::json by_model = nlohmann::json::object();
    for (const Validated& one : models) by_model[one.model] = validated_json(one);
    fmt::print("{}\n", json_text({{"pack", arguments.pack.string()},
                                  {"samples", arguments.samples},
                                  {"seed", arguments.seed},
                                  {"seconds", seconds},
                                  {"pushes_without_equilibrium", unsolved},
                                  {"models", by_model},
                                  {"agrees", agrees}}));
  } else {
    fmt::print("solved {} pushes at random sites, seed {}, in {:.1f} s\n\n", arguments.samples,
               arguments.seed, seconds);
    print_validated(models);
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
      "that were so, worse would be seen once in a hundred times. Exit code 2 where one does not.\n\n"
      "Example: palpate validate brain.pack --samples 200 --seed 7");
  command->add_option("PACK", arguments->pack, "Pack made by `palpate build`")->type_name("")->required();
  command
      ->add_option("--samples", arguments->samples,
                   "Pushes; default 128, as many in each quarter of the range")
      ->type_name("N")
      ->check(CLI::Range(1, 1000000));
  command->add_option("--seed", arguments->seed, "Other pushes for another seed; default 1")
      ->type_name("S")
      ->check(CLI::Range(std::int64_t{0}, std::numeric_limits<std::int64_t>::max()));
  add_jobs_option(*command, arguments->jobs);
  command->add_flag("--json", arguments->json, "Print the result as JSON");
  command->callback([arguments, &exit_code] { exit_code = run_validate(*arguments); });
}

}  // namespace palpate
