// The option --jobs, the same for every command with threads.
#pragma once

#include <CLI/App.hpp>
#include <CLI/Validators.hpp>
#include <algorithm>
#include <string>
#include <thread>

namespace palpate {

// Adds the option, with the number of cores as default. `note` ends the option's line of help.
inline CLI::Option* add_jobs_option(CLI::App& command, int& jobs, const std::string& note = "") {
  jobs = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  return command.add_option("--jobs", jobs, "Threads; default: one for each core" + note)
      ->type_name("N")
      ->check(CLI::Range(1, 1024));
}

}  // namespace palpate
