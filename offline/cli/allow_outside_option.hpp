// The option --allow-outside, the same for every command that reads a model.
#pragma once

#include <CLI/App.hpp>
#include <filesystem>

namespace palpate {

// Adds the option, which sets `include_root` of read_inp() to the root of the file system.
inline void add_allow_outside_option(CLI::App& command, std::filesystem::path& include_root) {
  command.add_flag_callback(
      "--allow-outside", [&include_root] { include_root = "/"; },
      "Let *INCLUDE open files outside of the model's folder; only for models that you trust");
}

}  // namespace palpate
