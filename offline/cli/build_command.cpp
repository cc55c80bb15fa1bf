// palpate build: turns a scene and its model into a pack with measured errors.
#include <fmt/core.h>

#include <CLI/App.hpp>
#include <CLI/Validators.hpp>
#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "offline/cli/allow_outside_option.hpp"
#include "offline/cli/build_report.hpp"
#include "offline/cli/commands.hpp"
#include "offline/cli/jobs_option.hpp"
#include "offline/io/finished_file.hpp"
#include "offline/pipeline/build_plan.hpp"
#include "offline/pipeline/opened_pack.hpp"
#include "offline/pipeline/organ_size.hpp"
#include "offline/pipeline/pack_build.hpp"
#include "offline/pipeline/ranks.hpp"
#include "offline/study/frame_timing.hpp"
#include "schemas/pack_layout.hpp"

namespace palpate {
namespace {

struct BuildArguments {
  std::filesystem::path include_root;  // argument of read_inp()
  std::filesystem::path scene;
  std::filesystem::path pack;
  std::filesystem::path samples;
  std::string survey = "full";
  int jobs = 1;
  bool jobs_given = false;
  bool json = false;
};

// Returns the folder for solved samples: --samples, or PACK.samples; empty for a pack on a device or a pipe.
std::filesystem::path sample_folder(const BuildArguments& arguments) {
  if (!arguments.samples.empty()) {
    if (arguments.samples.lexically_normal() == arguments.pack.lexically_normal())
      throw std::runtime_error(
          arguments.samples.string() +
          ": --samples names the folder of samples and -o the pack; give two different paths");
    return arguments.samples;
  }
  std::error_code error;
  const bool is_new = !std::filesystem::exists(arguments.pack, error);
  if (!is_new && !std::filesystem::is_regular_file(arguments.pack, error)) return {};
  std::filesystem::path folder = arguments.pack;
  return folder += ".samples";
}

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// Prints the warnings that need no solve.
void warn_of_scene(const Scene& scene, const Model& model, const ContactSites& sites) {
  if (is_tip_below_edge(scene.tip_radius, sites.mean_surface_edge)) {
    fmt::print(stderr, "{}: {}; raise tip_radius to an edge or more, or refine the mesh\n",
               scene.file.string(),
               tip_text(scene.tip_radius, sites.mean_surface_edge,
                        scene.length_unit.empty() ? "" : " " + scene.length_unit));
  }
  if (sites.sites_at_fixed_nodes > 0) {
    fmt::print(
        stderr,
        "{}: {} of {} sites have fixed nodes within tip_radius, which stay where they are; the patch is the "
        "rest\n",
        scene.file.string(), sites.sites_at_fixed_nodes, sites.sites.size() + sites.left_out.size());
  }
  if (!sites.left_out.empty())
    fmt::print(stderr, "{}\n", left_out_text(scene, model, sites.left_out, sites.sites.size()));
}

// Times frames of the pack and prints the result.
void print_result(const BuildArguments& arguments, const SamplingPlan& plan, const PackBuild& build,
                  const OpenedPack& opened, const std::filesystem::path& samples, int processes,
                  double seconds) {
  constexpr int kTimedFrames = 2000;
  const std::optional<Timing> new_places = time_new_places(opened, kTimedFrames / 10);
  const BuildResult result{*build.content,
                           build.results,
                           plan,
                           opened,
                           arguments.pack,
                           samples,
                           build.counts,
                           processes,
                           seconds,
                           build.sampling_seconds,
                           time_scene(opened, kTimedFrames),
                           new_places ? new_places->at(0.5) / 1000 : 0,
                           build.left_out};
  if (arguments.json) {
    print_json(result);
  } else {
    print_text(result);
  }
  print_warnings(result);
}

int run_build(const BuildArguments& arguments, Ranks& ranks) {
  const auto start = std::chrono::steady_clock::now();
  const auto [scene, model] = read_scene(arguments.scene, arguments.include_root);
  std::vector<std::filesystem::path> inputs = {scene.file};
  inputs.insert(inputs.end(), model.files.begin(), model.files.end());
  check_keeps_inputs(arguments.pack, inputs);
  check_replaces(arguments.pack, {pack::kMagic, sizeof pack::kMagic}, "a pack");
  if (ranks.is_first()) check_can_finish(arguments.pack);
  // Hashes the inputs now, because an editor may change the files during the build.
  std::vector<InputFile> input_files = read_inputs(inputs);
  if (ranks.is_first()) {
    for (const std::string& warning : model.warnings) fmt::print(stderr, "{}\n", warning);
    for (const std::string& warning : size_warnings(scene, model, extract_surface(model).mean_edge))
      fmt::print(stderr, "{}\n", warning);
  }
  const ContactSites sites = find_contact_sites(scene, model);
  if (ranks.is_first()) warn_of_scene(scene, model, sites);
  const int jobs =
      arguments.jobs_given ? arguments.jobs : std::max(1, arguments.jobs / ranks.on_this_machine());
  const SamplingPlan plan = arguments.survey == "none" ? plan_without_survey(scene, sites, jobs)
                                                       : plan_sampling(scene, sites, jobs);
  const std::filesystem::path samples = sample_folder(arguments);
  std::optional<SampleStore> store;
  if (samples.empty() && ranks.count() > 1) {
    throw std::runtime_error(
        arguments.pack.string() +
        ": several processes share a build through the samples they keep; name a folder that all "
        "of them see with --samples");
  }
  if (!samples.empty()) {
    store.emplace(samples, what_samples_depend_on(model, scene, sites, input_files), !ranks.is_first());
  }
  const Assembly assembly(model, model.fixed_dofs());
  const RestState rest = find_rest(assembly, scene);
  if (ranks.is_first() && !arguments.json)
    print_plan(scene, sites, assembly, rest, input_files, plan, ranks.count(), store.has_value());
  const std::unique_ptr<PackBuild> build = build_pack(
      {assembly, scene, sites, rest, plan, store ? &*store : nullptr}, std::move(input_files), &ranks);
  if (build == nullptr) return 0;
  const OpenedPack opened(*build->bytes);  // throws where the runtime does not accept the pack
  write_finished_bytes(arguments.pack, build->bytes->bytes());
  print_result(arguments, plan, *build, opened, samples, ranks.count(), seconds_since(start));
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
      "Under mpirun several processes share the sites; --samples must be a folder that all of them see.\n\n"
      "Example: palpate build models/brain/brain.toml -o brain.pack\n"
      "         mpirun -n 8 --bind-to none palpate build organ.toml -o organ.pack --samples "
      "/shared/organ.samples");
  command
      ->add_option("SCENE.toml", arguments->scene,
                   "Scene file: model, contact sites, how far they are pushed")
      ->type_name("")
      ->required();
  command->add_option("-o,--output", arguments->pack, "Pack to write")->type_name("PACK")->required();
  command
      ->add_option("--samples", arguments->samples,
                   "Folder for what was solved, which another build takes up: one that goes on after it was "
                   "killed, or one with another target or precision; default: PACK.samples")
      ->type_name("DIR");
  command
      ->add_option(
          "--survey", arguments->survey,
          "full: measure the errors of every model against full solves; none: skip that for a quick try, "
          "and let the runtime estimate no errors")
      ->check(CLI::IsMember({"full", "none"}))
      ->capture_default_str();
  const CLI::Option* jobs = add_jobs_option(*command, arguments->jobs, ". The pack does not depend on it");
  add_allow_outside_option(*command, arguments->include_root);
  command->add_flag("--json", arguments->json, "Print the result as JSON");
  command->callback([arguments, jobs, &exit_code] {
    arguments->jobs_given = jobs->count() > 0;
    Ranks ranks;
    try {
      exit_code = run_build(*arguments, ranks);
    } catch (const std::exception& error) {
      if (ranks.count() > 1) ranks.fail(error.what());
      throw;
    }
  });
}

}  // namespace palpate
