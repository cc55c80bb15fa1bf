// palpate replay: repeats the calls of a recording and reports the first response that differs.
#include <fmt/core.h>

#include <CLI/App.hpp>
#include <algorithm>
#include <bit>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "offline/cli/commands.hpp"
#include "offline/cli/json_text.hpp"
#include "offline/mesh/text_file.hpp"
#include "offline/pipeline/opened_pack.hpp"

namespace palpate {
namespace {

struct ReplayArguments {
  std::filesystem::path pack;
  std::filesystem::path recording;
  bool json = false;
};

std::string bytes_of(const std::filesystem::path& file) {
  std::string bytes;
  const std::string unreadable = read_text_file(file, bytes);
  if (!unreadable.empty()) throw std::runtime_error(fmt::format("{}: {}", file.string(), unreadable));
  if (bytes.empty()) throw std::runtime_error(fmt::format("{}: is empty", file.string()));
  return bytes;
}

struct Replayed {
  std::uint64_t calls = 0;
  pal_replay at = {};  // state after the last replayed call: the end, or the first difference
};

Replayed replay(const OpenedPack& opened, std::span<const char> recording, const std::string& name) {
  pal_session_config config = {};
  config.struct_size = sizeof config;
  require_ok(pal_recording_get_config(recording.data(), recording.size(), &config), name);
  std::size_t bytes = 0;
  if (Session::required_bytes(opened.pack(), config, bytes) != PAL_STATUS_OK)
    throw std::runtime_error(fmt::format(
        "{}: the pack cannot have the session that was recorded; name the pack that it ran on", name));
  AlignedBytes arena(bytes);
  Session session;
  require_ok(session.init(opened.pack(), config, arena.bytes()), name);
  Replayed replayed;
  replayed.at.struct_size = sizeof replayed.at;
  while (replayed.at.ended == 0 && replayed.at.diverged == 0) {
    require_ok(pal_session_replay(session.get(), recording.data(), recording.size(), &replayed.at),
               fmt::format("{}, call {}", name, replayed.calls + 1));
    ++replayed.calls;
  }
  return replayed;
}

void print_replayed(const OpenedPack& opened, const Replayed& replayed) {
  const pal_replay& at = replayed.at;
  if (at.diverged == 0) {
    fmt::print("{} frames, {:.3f} s: every answer is the recorded one, to the bit\n", at.frames, at.seconds);
    return;
  }
  const char* unit = opened.info().has_units != 0 ? " N" : "";
  fmt::print("frame {} (at {:.3f} s) is the first that differs\n", at.frames, at.seconds);
  const auto bits = [](double number) { return std::bit_cast<std::uint64_t>(number); };
  if (std::ranges::equal(at.force, at.recorded_force, {}, bits, bits)) {
    fmt::print("  all forces are the same; torque, stiffness, errors or flags differ\n");
    return;
  }
  fmt::print("  tool or contact {}\n", at.index);
  fmt::print("  recorded force  {:.17g} {:.17g} {:.17g}{}\n", at.recorded_force[0], at.recorded_force[1],
             at.recorded_force[2], unit);
  fmt::print("  force now       {:.17g} {:.17g} {:.17g}{}\n", at.force[0], at.force[1], at.force[2], unit);
}

int run_replay(const ReplayArguments& arguments) {
  const OpenedPack opened(arguments.pack);
  const std::string recording = bytes_of(arguments.recording);
  const Replayed replayed = replay(opened, recording, arguments.recording.string());
  const pal_replay& at = replayed.at;
  if (arguments.json) {
    nlohmann::json json = {{"frames", at.frames}, {"seconds", at.seconds}, {"diverged", at.diverged != 0}};
    if (at.diverged != 0) {
      json["tool"] = at.index;
      json["recorded_force"] = at.recorded_force;
      json["force"] = at.force;
    }
    fmt::print("{}\n", json_text(json));
  } else {
    print_replayed(opened, replayed);
  }
  return at.diverged != 0 ? 2 : 0;
}

}  // namespace

void add_replay_command(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<ReplayArguments>();
  CLI::App* command =
      app.add_subcommand("replay", "Make the calls of a recorded session again and compare every answer");
  command->footer(
      "Recordings come from pal_session_record (examples/02_record.cpp). On the same pack and the same build "
      "the answers are the\nsame to the bit; the exit code is 2 where one is not.\n\n"
      "Example: palpate replay brain.pack session.rec");
  command->add_option("PACK", arguments->pack, "Pack that the session ran on")->type_name("")->required();
  command->add_option("RECORDING", arguments->recording, "What pal_session_record wrote")
      ->type_name("")
      ->required();
  command->add_flag("--json", arguments->json, "Print the outcome as JSON");
  command->callback([arguments, &exit_code] { exit_code = run_replay(*arguments); });
}

}  // namespace palpate
