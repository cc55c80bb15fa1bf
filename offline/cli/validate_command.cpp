// palpate validate: the errors that a pack claims, measured again at pushes that its builder has not seen.
#include <fmt/core.h>
#include <stdlib.h>

#include <CLI/App.hpp>
#include <CLI/Validators.hpp>
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <random>
#include <thread>

#include "offline/cli/commands.hpp"
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

// A new p95 may be so many times the pack's, and the runtime's estimates cover so many of the true errors.
constexpr double kMostRatio = 1.5;
constexpr double kLeastCovered = 0.95;

struct ValidateArguments {
  std::filesystem::path pack;
  int samples = 128;
  std::uint64_t seed = 1;
  int jobs = 0;
  bool json = false;
};

// A folder of its own, gone with it.
class ScratchFolder {
 public:
  ScratchFolder() {
    std::string pattern = (std::filesystem::temp_directory_path() / "palpate-XXXXXX").string();
    if (mkdtemp(pattern.data()) == nullptr) throw std::runtime_error(pattern + ": cannot be made");
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

// From the files that the pack carries.
LoadedScene read_scene_of(const OpenedPack& opened) {
  const ScratchFolder folder;
  return read_scene(write_inputs(opened.tables(), opened.bytes(), folder.path()));
}

// How far each site was sampled.
double reach_of(const OpenedPack& opened, size_t site) {
  const pack::PolynomialDd* polynomial = opened.tables().polynomial_dd();
  return polynomial == nullptr ? opened.tables().sites()->max_displacement()
                               : opened.segment<double>(*polynomial->radii())[site];
}

// At sites drawn with the same chance, as many in each quarter of the range.
std::vector<Push> draw_pushes(const OpenedPack& opened, const Scene& scene, const ContactSites& sites,
                              const ValidateArguments& arguments) {
  const bool half = scene.directions == Directions::inward;
  std::mt19937_64 random(arguments.seed);
  // Surveys of builders are seeded by labels, which this is not.
  const std::vector<Eigen::Vector3d> points =
      choose_survey_points(arguments.samples, half, random() | std::uint64_t{1} << 63);
  std::vector<Push> pushes;
  for (const Eigen::Vector3d& point : points) {
    const size_t site = random() % sites.sites.size();
    const Eigen::Matrix3d frame = half ? frame_about(sites.sites[site].inward) : Eigen::Matrix3d::Identity();
    pushes.push_back({site, reach_of(opened, site) * frame * point, survey_increments(point.norm())});
  }
  return pushes;
}

// One model of the pack, as it says and as it is.
struct Validated {
  std::string model;
  SurveyBin claimed;
  RuntimeSurvey measured;

  double displacement_ratio() const {
    return measured.table.overall.displacement.p95 / claimed.displacement.p95;
  }
  double force_ratio() const { return measured.table.overall.force.p95 / claimed.force.p95; }
  bool agrees() const {
    return displacement_ratio() <= kMostRatio && force_ratio() <= kMostRatio &&
           measured.displacement_covered >= kLeastCovered && measured.force_covered >= kLeastCovered;
  }
};

nlohmann::json validated_json(const Validated& model) {
  nlohmann::json json = survey_json(model.measured.table);
  json["p95_ratio"] = {{"displacement", model.displacement_ratio()}, {"force", model.force_ratio()}};
  json["within_estimate"] = {{"displacement", model.measured.displacement_covered},
                             {"force", model.measured.force_covered}};
  json["agrees"] = model.agrees();
  return json;
}

void print_validated(const std::vector<Validated>& models) {
  std::vector<ModelErrors> surveys;
  for (const Validated& model : models) surveys.push_back({model.model, model.measured.table});
  fmt::print("{}\n", survey_text(surveys));
  fmt::print(
      "                 p95 over the pack's      within the runtime's estimate, percent\n"
      "  model          displacement  force      displacement  force\n");
  for (const Validated& model : models) {
    fmt::print("  {:<14} {:12.2f} {:6.2f} {:17.1f} {:6.1f}   {}\n", model.model, model.displacement_ratio(),
               model.force_ratio(), 100 * model.measured.displacement_covered,
               100 * model.measured.force_covered, model.agrees() ? "agrees" : "DISAGREES");
  }
}

int run_validate(const ValidateArguments& arguments) {
  const auto start = std::chrono::steady_clock::now();
  const OpenedPack opened(arguments.pack);
  const auto [scene, model] = [&] {
    try {
      return read_scene_of(opened);
    } catch (const std::runtime_error& error) {
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
  const int jobs = arguments.jobs > 0 ? arguments.jobs
                                      : static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  std::vector<SurveySample> samples;
  {
    ProgressBar bar("solving pushes", arguments.samples);
    samples = solve_pushes(
        assembly, sites, pushes, jobs, [&](int done, int) { bar.show(done); }, rest);
  }
  const auto unsolved =
      std::count_if(samples.begin(), samples.end(), [](const SurveySample& one) { return !one.solved; });

  std::vector<Validated> models;
  for (const ModelErrors& claimed : surveys_of(opened.tables())) {
    const bool linear = claimed.model == pack::EnumNameResponseModel(pack::ResponseModel::linear_dd);
    models.push_back({claimed.model, claimed.table.overall,
                      survey_runtime(opened, linear ? PAL_MODEL_LINEAR : PAL_MODEL_POLYNOMIAL, samples,
                                     scene.max_displacement)});
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
      "Solves random pushes of the organ in full, from rest, with the model that the pack carries, and "
      "compares "
      "the runtime's\n"
      "answers. A model agrees where its new p95 errors are at most 1.5 times the pack's, and at least 95 % "
      "of "
      "its errors are\n"
      "within what the runtime estimated for them. Exit code 2 where one does not.\n\n"
      "Example: palpate validate brain.pack --samples 200 --seed 7");
  command->add_option("PACK", arguments->pack, "Pack made by `palpate build`")->type_name("")->required();
  command
      ->add_option("--samples", arguments->samples,
                   "Pushes; default 128, as many in each quarter of the range")
      ->type_name("N")
      ->check(CLI::Range(1, 1000000));
  command->add_option("--seed", arguments->seed, "Other pushes for another seed; default 1")->type_name("S");
  command->add_option("--jobs", arguments->jobs, "Threads; default: one for each core")
      ->type_name("N")
      ->check(CLI::Range(1, 1024));
  command->add_flag("--json", arguments->json, "Print the result as JSON");
  command->callback([arguments, &exit_code] { exit_code = run_validate(*arguments); });
}

}  // namespace palpate
