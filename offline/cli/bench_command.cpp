// palpate bench: measures the time of a pack's frames on this machine.
#include <fmt/core.h>

#include <CLI/App.hpp>
#include <CLI/Validators.hpp>
#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "offline/cli/commands.hpp"
#include "offline/cli/json_text.hpp"
#include "offline/study/frame_timing.hpp"

namespace palpate {
namespace {

struct BenchArguments {
  std::filesystem::path pack;
  int frames = 100000;
  bool json = false;
};

int run_bench(const BenchArguments& arguments) {
  const OpenedPack opened(arguments.pack);
  std::vector<Timing> timings;
  for (const pack::FrameCost* cost : *opened.tables().costs()) {
    const pal_model model = runtime_model(cost->model());
    std::vector<Timing> of_model = model == PAL_MODEL_ZONE ? time_zone(opened, arguments.frames)
                                                           : time_model(opened, model, arguments.frames);
    for (Timing& timing : of_model) timings.push_back(std::move(timing));
    timings.push_back(time_copy(model_name(model), cost->field_bytes(), arguments.frames));
  }
  if (has_places(opened)) {
    for (Timing& timing : time_search(opened, arguments.frames)) timings.push_back(std::move(timing));
  }
  timings.push_back(time_loop(std::max(100, arguments.frames / 10)));
  for (Timing& timing : time_start(arguments.pack)) timings.push_back(std::move(timing));
  const Timing clock = time_frames("", "reading the clock", arguments.frames, [](int) {});
  if (arguments.json) {
    nlohmann::json rows = nlohmann::json::array();
    timings.push_back(clock);
    for (const Timing& timing : timings) {
      rows.push_back({{"model", timing.model},
                      {"stage", timing.stage},
                      {"median_ns", timing.at(0.5)},
                      {"p99_ns", timing.at(0.99)},
                      {"p999_ns", timing.at(0.999)},
                      {"max_ns", timing.at(1)}});
    }
    fmt::print("{}\n",
               json_text({{"processor", processor_name()}, {"frames", arguments.frames}, {"rows", rows}}));
    return 0;
  }
  fmt::print("Frame cost on {}, one core, warm, {} frames each, nanoseconds\n", processor_name(),
             arguments.frames);
  fmt::print("  model       stage                            median       p99     p99.9        max\n");
  for (const Timing& timing : timings) {
    fmt::print("  {:<11} {:<28} {:>10.0f} {:>9.0f} {:>9.0f} {:>10.0f}\n", timing.model, timing.stage,
               timing.at(0.5), timing.at(0.99), timing.at(0.999), timing.at(1));
  }
  fmt::print("Reading the clock itself takes {:.0f} ns.\n", clock.at(0.5));
  return 0;
}

}  // namespace

void add_bench_command(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<BenchArguments>();
  CLI::App* command =
      app.add_subcommand("bench", "Measure what a frame costs on this machine, per model and stage");
  command->footer(
      "Every frame is timed alone: median, p99, p99.9 and maximum. On a shared machine the last are the\n"
      "machine's, too: a loop in registers, and a memcpy of the bytes that a field reads, say how much.\n\n"
      "Example: palpate bench brain.pack --frames 10000");
  command->add_option("PACK", arguments->pack, "Pack made by `palpate build`")->type_name("")->required();
  command->add_option("--frames", arguments->frames, "Frames a row, 100 or more; default 100000")
      ->type_name("N")
      ->check(CLI::Range(100, 100000000));
  command->add_flag("--json", arguments->json, "Print as JSON");
  command->callback([arguments, &exit_code] { exit_code = run_bench(*arguments); });
}

}  // namespace palpate
