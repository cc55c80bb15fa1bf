// palpate build: the main job. Scene and model in, a pack with its measured errors out.
#include <fmt/core.h>

#include <CLI/App.hpp>
#include <CLI/Validators.hpp>
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>

#include "offline/cli/commands.hpp"
#include "offline/cli/compliance_errors.hpp"
#include "offline/cli/frame_timing.hpp"
#include "offline/cli/jobs_option.hpp"
#include "offline/cli/json_text.hpp"
#include "offline/cli/opened_pack.hpp"
#include "offline/cli/progress_bar.hpp"
#include "offline/cli/runtime_survey.hpp"
#include "offline/cli/survey_table.hpp"
#include "offline/output/finished_file.hpp"

namespace palpate {
namespace {

struct BuildArguments {
  std::filesystem::path scene;
  std::filesystem::path pack;
  std::filesystem::path samples;
  int jobs = 1;
  bool json = false;
};

using Clock = std::chrono::steady_clock;
constexpr int kTimedFrames = 2000;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

// Opens in a twentieth of a second and is exact; what a surface of 1,900 nodes takes. It grows with the square.
constexpr double kMostDenseBytes = 256e6;

double dense_bytes(const ContactSites& sites) {
  return dense_compliance_bytes(sites.packed_nodes.size(), sites.contact_nodes.size());
}

bool is_to_be_compressed(const Scene& scene, const ContactSites& sites) {
  if (!scene.linear || scene.compliance == ComplianceForm::dense) return false;
  return scene.compliance == ComplianceForm::compressed || dense_bytes(sites) > kMostDenseBytes;
}

// What is about to be done, and about how long it takes: a full solve near its neighbour costs two to three
// factors.
void print_plan(const Model& model, const Scene& scene, const ContactSites& sites, const Assembly& assembly,
                const std::vector<InputFile>& inputs, const SamplingPlan& plan) {
  StaticSolver solver(assembly);
  const Clock::time_point start = Clock::now();
  const bool factored =
      solver.factorize_at(LoadCase::rest(model), Eigen::VectorXd::Zero(model.num_dofs()), false);
  const double factor_seconds = factored ? seconds_since(start) : 0;
  const int solves_per_site =
      (scene.polynomial ? static_cast<int>(plan.least_samples) : 0) + plan.survey_samples;
  const size_t surveyed = plan.survey_sites > 0 ? static_cast<size_t>(plan.survey_sites) : sites.sites.size();
  const double solves = static_cast<double>(solves_per_site) * static_cast<double>(surveyed);
  const bool compressed = is_to_be_compressed(scene, sites);
  constexpr double kFactorsPerSolve = 2.2;  // back-solves, assembly and tangents included
  const int jobs = std::min(plan.jobs, static_cast<int>(surveyed));
  constexpr int kUsualRank = 8;
  double bytes =
      estimate_pack_bytes(sites.packed_nodes.size(), sites.contact_nodes.size(), sites.sites.size(),
                          scene.linear, scene.polynomial ? kUsualRank : -1, plan.rounded, compressed);
  for (const InputFile& input : inputs) bytes += static_cast<double>(input.contents.size());
  fmt::print("model      {}: {} nodes, {} elements, {} equations, mean surface edge h = {:.4g}\n", model.file,
             model.num_nodes(), model.elements.size(), assembly.num_equations(), sites.mean_surface_edge);
  fmt::print("scene      {} sites, {} contact nodes, {} shown nodes, |d| to {:.4g} ({:.2f} h)\n",
             sites.sites.size(), sites.contact_nodes.size(), sites.packed_nodes.size(),
             scene.max_displacement, scene.max_displacement / sites.mean_surface_edge);
  if (scene.linear) {
    const double dense = dense_bytes(sites) / 1e6;
    if (compressed) {
      fmt::print("compliance compressed, entries right to {:g}; dense it would take {:.1f} MB\n",
                 kComplianceTolerance, dense);
    } else {
      fmt::print("compliance dense, {:.1f} MB\n", dense);
    }
  }
  fmt::print("estimate   {:.0f} nonlinear solves, about {:.0f} s on {} threads; pack about {:.1f} MB\n",
             solves, std::max(1.0, kFactorsPerSolve * solves * factor_seconds / jobs), jobs, bytes / 1e6);
  std::fflush(stdout);  // also into a file: it is for before the wait
}

// The errors of the real runtime on a pack that is complete but for them.
std::vector<ModelSurvey> survey_models(const PackContent& content, const std::vector<SiteResult>& results) {
  const AlignedBytes bytes = write_pack(content);
  const OpenedPack opened(bytes);
  std::vector<SurveySample> samples;
  for (const SiteResult& result : results)
    samples.insert(samples.end(), result.survey.begin(), result.survey.end());
  std::vector<ModelSurvey> surveys;
  const auto survey = [&](SurveyedModel name, pal_model model) {
    surveys.push_back({name, survey_runtime(opened, model, samples, content.scene.max_displacement).table});
  };
  if (content.has_linear()) survey(SurveyedModel::linear_dd, PAL_MODEL_LINEAR);
  if (content.polynomials != nullptr) survey(SurveyedModel::polynomial_dd, PAL_MODEL_POLYNOMIAL);
  return surveys;
}

// Empty where nothing is to be kept: beside a device or a pipe there is no place for it.
std::filesystem::path sample_folder(const BuildArguments& arguments) {
  if (!arguments.samples.empty()) return arguments.samples;
  std::error_code error;
  const bool is_new = !std::filesystem::exists(arguments.pack, error);
  if (!is_new && !std::filesystem::is_regular_file(arguments.pack, error)) return {};
  std::filesystem::path folder = arguments.pack;
  return folder += ".samples";
}

// All that changes a digit of what sample_sites solves at a site, whose label names its file. Targets, degrees and
// precisions do not.
std::string what_samples_depend_on(const Model& model, const Scene& scene, const ContactSites& sites,
                                   const std::vector<InputFile>& inputs) {
  constexpr int kSamplingVersion = 1;  // of the solves and of the order in which they follow from one another
  std::string key = fmt::format("{} {} {:a} {:a} {} {}", PALPATE_VERSION, kSamplingVersion,
                                scene.max_displacement, scene.tip_radius, static_cast<int>(scene.directions),
                                static_cast<int>(scene.polynomial_method));
  for (size_t i = 1; i < inputs.size(); ++i) key += " " + inputs[i].hash;  // the first is the scene
  if (scene.gravity) {
    for (const double component : *scene.gravity) key += fmt::format(" {:a}", component);
  }
  for (const int node : sites.packed_nodes)
    key += fmt::format(" {}", model.labels[static_cast<size_t>(node)]);
  return key;
}

int run_build(const BuildArguments& arguments) {
  const Clock::time_point start = Clock::now();
  const auto [scene, model] = read_scene(arguments.scene);
  std::vector<std::filesystem::path> inputs = {scene.file};
  inputs.insert(inputs.end(), model.files.begin(), model.files.end());
  check_keeps_inputs(arguments.pack, inputs);
  check_can_finish(arguments.pack);
  // What was just read, not what an editor may save meanwhile.
  std::vector<InputFile> input_files = read_inputs(inputs);
  for (const std::string& warning : model.warnings) fmt::print(stderr, "{}\n", warning);
  SamplingPlan plan;
  plan.jobs = arguments.jobs;
  plan.target = scene.accuracy_target;
  // Columns of int16 are wrong by 4e-5 together: nothing beside a target above a few times that.
  constexpr double kRoundedFrom = 2e-4;
  plan.rounded = scene.precision == FieldPrecision::rounded ||
                 (scene.precision == FieldPrecision::automatic && sizeof(pack::Real) == sizeof(float) &&
                  scene.accuracy_target >= kRoundedFrom);
  const ContactSites sites = find_contact_sites(scene, model);
  // Below it energies and forces lose to rounding what a polynomial is fitted to.
  constexpr double kLeastReach = 1e-6;  // of h
  if (scene.polynomial && scene.max_displacement < kLeastReach * sites.mean_surface_edge) {
    throw std::runtime_error(fmt::format(
        "{}: max_displacement = {:g} is below a millionth of the mean surface edge {:.4g}, too little for a "
        "nonlinear model; raise it, or write [models] polynomial = false",
        scene.file.string(), scene.max_displacement, sites.mean_surface_edge));
  }
  // Few sites are measured more often, so that 95 % of each bin's errors are told with a confidence of 95 %.
  constexpr int kFewestSurveySolves = 4 * 60;
  const int num_sites = static_cast<int>(sites.sites.size());
  int num_surveyed = num_sites;
  if (!scene.polynomial && num_sites > kFewestSurveySolves / 4) {
    // Nothing is fitted at a site, so a survey of all of them would be most of the work: one push in each bin
    // at sites all over the organ.
    num_surveyed = plan.survey_sites = kFewestSurveySolves / 4;
    plan.survey_samples = 4;
  }
  plan.survey_samples =
      std::max(plan.survey_samples, (kFewestSurveySolves / 4 + num_surveyed - 1) / num_surveyed * 4);
  if (sites.sites_at_fixed_nodes > 0) {
    fmt::print(
        stderr,
        "{}: {} of {} sites have fixed nodes within tip_radius, which stay where they are; the patch is the "
        "rest\n",
        scene.file.string(), sites.sites_at_fixed_nodes, num_sites);
  }
  const Assembly assembly(model, model.fixed_dofs());
  if (!arguments.json) print_plan(model, scene, sites, assembly, input_files, plan);

  const RestState rest = find_rest(assembly, scene);
  LinearDd linear;
  CompressedCompliance compressed;
  const bool is_compressed = is_to_be_compressed(scene, sites);
  if (is_compressed) {
    const Assembly threaded(model, model.fixed_dofs(), plan.jobs);
    constexpr int kSteps = 1000;
    ProgressBar bar("linear_dd", kSteps);
    const auto show = [&](int done, int total) {
      bar.show(static_cast<int>(std::int64_t{done} * kSteps / total));
    };
    compressed = compress_linear_dd(threaded, sites, kComplianceTolerance, show, rest);
  } else if (scene.linear || dense_bytes(sites) <= kMostDenseBytes) {  // else each site solves for its own
    ProgressBar bar("linear_dd", static_cast<int>(3 * sites.contact_nodes.size()));
    linear = compute_linear_dd(
        assembly, sites, [&](int done, int) { bar.show(done); }, rest);
  }
  const std::filesystem::path samples = sample_folder(arguments);
  std::vector<SiteResult> results;
  {
    std::optional<SampleStore> store;
    if (!samples.empty()) store.emplace(samples, what_samples_depend_on(model, scene, sites, input_files));
    ProgressBar bar("sampling sites", num_surveyed);
    results = sample_sites(
        assembly, scene, sites, linear, plan, [&](int done, int) { bar.show(done); }, rest,
        store ? &*store : nullptr);
  }

  PackContent content{model, scene, sites, nullptr, nullptr, plan.rounded, std::move(input_files), {}};
  content.rest = &rest;
  if (is_compressed) content.compressed = &compressed;
  if (scene.linear && !is_compressed) content.linear = &linear;
  if (scene.polynomial) content.polynomials = &results;
  content.surveys = survey_models(content, results);
  if (is_compressed) {
    const AlignedBytes measured = write_pack(content);
    const ComplianceErrors errors =
        measure_compliance(OpenedPack(measured), assembly, sites, rest, scene.max_contacts);
    compressed.displacement_error = errors.displacement;
    compressed.force_error = errors.force;
    compressed.samples = errors.samples;
  }
  const AlignedBytes bytes = write_pack(content);
  const OpenedPack opened(bytes);  // what the runtime refuses is not written
  write_finished_bytes(arguments.pack, bytes.bytes());
  const double seconds = seconds_since(start);
  SolveCounts counts;
  double min_jacobian = 1;
  int shortened = 0;
  int unsolved = 0;
  for (const SiteResult& result : results) {
    counts.solves += result.counts.solves;
    counts.reused += result.counts.reused;
    counts.iterations += result.counts.iterations;
    counts.factorizations += result.counts.factorizations;
    min_jacobian = std::min(min_jacobian, result.min_jacobian);
    unsolved += result.unsolved;
    if (scene.polynomial && is_shortened(least_reach(result.polynomial.to_unit), scene.max_displacement))
      ++shortened;
  }
  const SurveyTable& best = content.surveys.back().table;
  const bool measured =
      std::all_of(best.bins.begin(), best.bins.end(), [](const SurveyBin& bin) { return bin.samples > 0; });
  const bool on_target = measured && best.overall.displacement.p95 <= scene.accuracy_target;
  const double frame_us = time_scene(opened, kTimedFrames).at(0.5) / 1000;
  if (arguments.json) {
    fmt::print("{}\n",
               json_text({{"pack", arguments.pack.string()},
                          {"bytes", bytes.bytes().size()},
                          {"seconds", seconds},
                          {"sites", sites.sites.size()},
                          {"max_displacement_over_h", scene.max_displacement / sites.mean_surface_edge},
                          {"solves", counts.solves},
                          {"reused", counts.reused},
                          {"iterations", counts.iterations},
                          {"factorizations", counts.factorizations},
                          {"min_J", min_jacobian},
                          {"sites_with_smaller_domain", shortened},
                          {"survey_pushes_without_equilibrium", unsolved},
                          {"target_met", on_target},
                          {"frame_us", frame_us},
                          {"budget_met", frame_us <= scene.frame_budget_us},
                          {"compliance", compliance_json(opened.tables())},
                          {"errors", survey_json(surveys_of(opened.tables()))}}));
  } else {
    if (is_compressed) {
      fmt::print(
          "compliance {:.1f} MB; against exact linear solves of {} sets of contacts, displacements are wrong "
          "by at most {:.2g} of |d|, forces by {:.2g}\n",
          static_cast<double>(compressed.num_bytes()) / 1e6, compressed.samples,
          compressed.displacement_error, compressed.force_error);
    }
    fmt::print("solved     {} equilibria in {} iterations with {} factors; smallest J {:.3f}\n",
               counts.solves, counts.iterations, counts.factorizations, min_jacobian);
    if (!samples.empty()) {
      fmt::print("samples    {} kept in {}, {} of them taken from there\n", counts.solves + counts.reused,
                 samples.string(), counts.reused);
    }
    fmt::print("wrote      {}: {:.1f} MB in {:.1f} s\n", arguments.pack.string(),
               static_cast<double>(bytes.bytes().size()) / 1e6, seconds);
    fmt::print(
        "frame      forces of {} {} at new sites in {:.2f} us (median) on this machine; the budget is {:g} "
        "us\n\n{}\n",
        scene.max_contacts, scene.max_contacts == 1 ? "contact" : "contacts", frame_us, scene.frame_budget_us,
        survey_text(surveys_of(opened.tables())));
  }
  if (shortened > 0) {
    fmt::print(
        stderr,
        "{}: the solver did not reach max_displacement at {} of {} sites; their sampled domain is smaller\n",
        scene.file.string(), shortened, sites.sites.size());
  }
  if (unsolved > 0) {
    fmt::print(stderr,
               "{}: {} of {} survey pushes reached no equilibrium and count as errors of 100 %; reduce "
               "max_displacement\n",
               scene.file.string(), unsolved, plan.survey_samples * num_surveyed);
  }
  if (frame_us > scene.frame_budget_us) {
    fmt::print(stderr,
               "{}: a haptic frame takes {:.3g} us here, above the budget of {:g} us; reduce max_contacts or "
               "tip_radius, "
               "or raise [budget] frame_us\n",
               scene.file.string(), frame_us, scene.frame_budget_us);
  }
  if (!measured) {
    fmt::print(stderr, "{}: part of the range of |d| could not be measured; reduce max_displacement\n",
               scene.file.string());
  } else if (!on_target) {
    fmt::print(stderr,
               "{}: the p95 displacement error is {:.3g} % over the survey (force: {:.3g} %), above the "
               "target of {:.3g} %; "
               "reduce max_displacement or raise [accuracy] target\n",
               scene.file.string(), 100 * best.overall.displacement.p95, 100 * best.overall.force.p95,
               100 * scene.accuracy_target);
  }
  return 0;
}

}  // namespace

void add_build_command(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<BuildArguments>();
  CLI::App* command = app.add_subcommand("build", "Build an asset pack from a scene");
  command->footer(
      "Solves the organ's nonlinear response at every contact site, fits it, measures the error of the fit "
      "at displacements\n"
      "it has not seen, and writes everything the runtime needs as one file. The file appears whole or not "
      "at all.\n\n"
      "Example: palpate build models/brain/brain.toml -o brain.pack");
  command
      ->add_option("SCENE.toml", arguments->scene,
                   "Scene file: model, contact sites, how far they are pushed")
      ->type_name("")
      ->required();
  command->add_option("-o,--output", arguments->pack, "Pack to write")->type_name("PACK")->required();
  command
      ->add_option("--samples", arguments->samples,
                   "Folder for what was solved, which another build takes up: one that goes on after it was "
                   "killed, or "
                   "one with another target or precision; default: PACK.samples")
      ->type_name("DIR");
  add_jobs_option(*command, arguments->jobs, ". The pack does not depend on it");
  command->add_flag("--json", arguments->json, "Print the result as JSON");
  command->callback([arguments, &exit_code] { exit_code = run_build(*arguments); });
}

}  // namespace palpate
