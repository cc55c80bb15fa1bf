// palpate report: writes a page that plots speed against error.
#include <fmt/chrono.h>
#include <fmt/core.h>

#include <CLI/App.hpp>
#include <CLI/Validators.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>
#include <thread>

#include "offline/cli/allow_outside_option.hpp"
#include "offline/cli/commands.hpp"
#include "offline/cli/jobs_option.hpp"
#include "offline/cli/json_text.hpp"
#include "offline/io/finished_file.hpp"
#include "offline/pipeline/build_plan.hpp"
#include "offline/pipeline/carried_scene.hpp"
#include "offline/pipeline/pack_build.hpp"
#include "offline/pipeline/scene_sites.hpp"
#include "offline/report/gnuplot.hpp"
#include "offline/report/html_page.hpp"
#include "offline/report/organ_section.hpp"
#include "offline/study/frame_timing.hpp"
#include "offline/study/organ_report.hpp"

namespace palpate {
namespace {

struct ReportArguments {
  std::filesystem::path include_root;  // argument of read_inp()
  std::vector<std::filesystem::path> organs;
  std::filesystem::path folder;
  bool quick = false;
  int jobs = 1;
  std::int64_t seed = 1;
  bool json = false;
};

// Lists the scenes that ship with Palpate: bench/speed_error in the nearest folder above the program that has
// both.
std::vector<std::filesystem::path> shipped_scenes() {
  std::error_code error;
  std::filesystem::path folder = std::filesystem::read_symlink("/proc/self/exe", error).parent_path();
  for (; !error && folder.has_relative_path(); folder = folder.parent_path()) {
    std::vector<std::filesystem::path> scenes = {folder / "bench/speed_error/cylinder.toml",
                                                 folder / "bench/speed_error/brain.toml"};
    if (std::all_of(scenes.begin(), scenes.end(),
                    [](const auto& scene) { return std::filesystem::exists(scene); }))
      return scenes;
  }
  throw std::runtime_error(
      "the scenes that Palpate ships are not beside this program; name a scene or a pack");
}

// Returns the commit of the sources around the program; "" without git.
std::string commit_of_sources() {
  std::error_code error;
  const std::string folder = std::filesystem::read_symlink("/proc/self/exe", error).parent_path().string();
  if (error || folder.find('\'') != std::string::npos) return "";
  std::FILE* pipe = popen(("git -C '" + folder + "' describe --always --dirty 2>/dev/null").c_str(), "r");
  if (pipe == nullptr) return "";
  char line[128] = {};
  const bool read = std::fgets(line, sizeof line, pipe) != nullptr;
  const bool done = pclose(pipe) == 0;
  std::string text = read && done ? line : "";
  while (!text.empty() && text.back() == '\n') text.pop_back();
  return text;
}

// Returns a file name that no other organ of the report uses.
std::string name_for(const std::filesystem::path& organ, std::set<std::string>& taken) {
  std::string stem = organ.stem().string();
  for (char& c : stem) {
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-';
    if (!plain) c = '_';
  }
  std::string name = stem;
  for (int i = 2; !taken.insert(name).second; ++i) name = fmt::format("{}_{}", stem, i);
  return name;
}

OrganReport report_on_pack(const std::filesystem::path& file, const ReportArguments& arguments,
                           const ReportEffort& effort, const std::filesystem::path& map) {
  const OpenedPack opened(file);
  const Organ organ(read_carried_scene(opened, file));
  check_same_sites(opened, organ, file);
  return measure_organ(opened, organ, effort, arguments.seed, arguments.jobs, map);
}

// Packs the scene with at most effort.scene_sites sites, which bounds the time. Then measures the pack.
OrganReport report_on_scene(const std::filesystem::path& file, const ReportArguments& arguments,
                            const ReportEffort& effort, const std::filesystem::path& map,
                            const std::string& name) {
  LoadedScene scene = read_scene(file, arguments.include_root);
  const auto all_sites = scene.scene.sites.size();
  Organ organ(with_at_most_sites(std::move(scene), effort.scene_sites));
  std::vector<std::filesystem::path> files = {organ.scene.file};
  files.insert(files.end(), organ.model.files.begin(), organ.model.files.end());
  std::vector<InputFile> inputs = read_inputs(files);
  SamplingPlan plan = plan_sampling(organ.scene, organ.sites, arguments.jobs);
  if (effort.scene_sets > 0) plan.survey_sets = effort.scene_sets;
  const SampleStore store(arguments.folder / "samples" / name,
                          what_samples_depend_on(organ.model, organ.scene, organ.sites, inputs));
  const std::unique_ptr<PackBuild> build =
      build_pack({organ.assembly, organ.scene, organ.sites, organ.rest, plan, &store}, std::move(inputs));
  const OpenedPack opened(*build->bytes);
  organ.sites = build->sites;
  OrganReport report = measure_organ(opened, organ, effort, arguments.seed, arguments.jobs, map);
  if (organ.sites.sites.size() < all_sites) {
    report.notes.push_back(fmt::format("Packed for this report at {} of the scene's {} sites.",
                                       organ.sites.sites.size(), all_sites));
  }
  return report;
}

// Throws where an input lies in the folder of the results, because a result could replace the input.
void check_inputs_lie_elsewhere(const ReportArguments& arguments) {
  for (const std::filesystem::path& input : arguments.organs) {
    std::error_code absent;
    if (std::filesystem::equivalent(std::filesystem::absolute(input).parent_path(), arguments.folder, absent))
      throw std::runtime_error(input.string() +
                               ": is an input in the folder of the results; name another folder with -o");
  }
}

nlohmann::json report_json(const Report& report, const std::filesystem::path& page) {
  nlohmann::json organs = nlohmann::json::array();
  for (const OrganReport& organ : report.organs) {
    nlohmann::json models = nlohmann::json::object();
    for (const ValidationRow& validation : organ.promises) {
      models[validation.model] = {{"displacement_p95", validation.found_displacement_p95},
                                  {"force_p95", validation.found_force_p95},
                                  {"displacement_within_estimate", validation.displacement_coverage},
                                  {"force_within_estimate", validation.force_coverage},
                                  {"kept", validation.kept}};
    }
    organs.push_back(
        {{"name", organ.name}, {"source", organ.source}, {"kept", organ.is_kept()}, {"models", models}});
  }
  return {{"page", page.string()},     {"seed", report.seed},      {"quick", report.quick},
          {"seconds", report.seconds}, {"kept", report.is_kept()}, {"organs", organs}};
}

int run_report(const ReportArguments& arguments) {
  const auto start = std::chrono::steady_clock::now();
  require_gnuplot();
  const std::vector<std::filesystem::path> organs =
      arguments.organs.empty() ? shipped_scenes() : arguments.organs;
  for (const std::filesystem::path& organ : organs) {
    if (!std::filesystem::exists(organ)) throw std::runtime_error(organ.string() + ": no such file");
  }
  check_inputs_lie_elsewhere(arguments);
  std::filesystem::create_directories(arguments.folder);
  const std::filesystem::path page = arguments.folder / "index.html";
  check_can_finish(page);
  const ReportEffort effort = arguments.quick ? ReportEffort::quick() : ReportEffort();

  Report report;
  report.processor = processor_name();
  report.cores = std::thread::hardware_concurrency();
  report.compiler = PALPATE_COMPILER;
  report.flags = PALPATE_COMPILER_FLAGS;
  report.version = PALPATE_VERSION;
  report.commit = commit_of_sources();
  report.date = fmt::format("{:%Y-%m-%d %H:%M} UTC", fmt::gmtime(std::time(nullptr)));
  report.command = "palpate report";
  for (const std::filesystem::path& organ : arguments.organs) report.command += " " + organ.string();
  report.command += fmt::format(" -o {}{} --jobs {} --seed {}", arguments.folder.string(),
                                arguments.quick ? " --quick" : "", arguments.jobs, arguments.seed);
  report.seed = arguments.seed;
  report.quick = arguments.quick;
  std::set<std::string> names;
  for (const std::filesystem::path& file : organs) {
    const std::string name = name_for(file, names);
    const std::filesystem::path map = arguments.folder / (name + "_error_map.png");
    OrganReport organ = file.extension() == ".toml" ? report_on_scene(file, arguments, effort, map, name)
                                                    : report_on_pack(file, arguments, effort, map);
    organ.name = name;
    organ.title = file.stem().string();
    organ.source = file.string();
    report.organs.push_back(std::move(organ));
  }
  report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  write_report(report, arguments.folder);
  if (arguments.json) {
    fmt::print("{}\n", json_text(report_json(report, page)));
  } else {
    for (const OrganReport& organ : report.organs) fmt::print("{}\n", organ_markdown(organ));
    fmt::print("wrote {} in {:.0f} s\n", page.string(), report.seconds);
  }
  for (const OrganReport& organ : report.organs) {
    if (!organ.is_kept()) fmt::print(stderr, "{}\n", broken_promises(organ));
  }
  return report.is_kept() ? 0 : 2;
}

}  // namespace

void add_report_command(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<ReportArguments>();
  CLI::App* command =
      app.add_subcommand("report", "Speed against error of a pack's models, as a page with plots");
  command->footer(
      "Measures each pack, or scene, which it packs first, at pushes that its builder has not seen,\n"
      "against full nonlinear solves: errors of every model, whether the runtime's estimates cover them,\n"
      "times of frames, warm and cold, beside those of full Newton. Writes DIR/index.html, which needs\n"
      "nothing beside it, its plots and their numbers as CSV. Without a scene or a pack: the scenes that\n"
      "Palpate ships, where this program lies in its source tree. The same pack and seed give the same\n"
      "errors to the digit. Exit code 2 where a model is not as good as its pack says, judged as `palpate\n"
      "validate` does. Needs gnuplot (Debian: gnuplot-nox).\n\n"
      "Example: palpate report brain.pack -o report\n"
      "         palpate report organ.toml -o report --quick");
  command->add_option("SCENE.toml|PACK", arguments->organs, "What to report on; default: the shipped scenes")
      ->type_name("");
  command->add_option("-o,--output", arguments->folder, "Folder to write")->type_name("DIR")->required();
  command->add_flag("--quick", arguments->quick,
                    "A glance within two minutes: fewer pushes, scenes at 4 of their sites, short timings");
  command->add_option("--seed", arguments->seed, "Other pushes for another seed; default 1")
      ->type_name("S")
      ->check(CLI::Range(std::int64_t{0}, std::numeric_limits<std::int64_t>::max() - 2));
  add_jobs_option(*command, arguments->jobs, ". Errors do not depend on it");
  add_allow_outside_option(*command, arguments->include_root);
  command->add_flag("--json", arguments->json, "Print the verdict as JSON");
  command->callback([arguments, &exit_code] { exit_code = run_report(*arguments); });
}

}  // namespace palpate
