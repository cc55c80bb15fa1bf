// Runs the program `palpate` as a user does: arguments in; standard output, standard error and exit code out.
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/support/temp_dir.hpp"

namespace palpate::test {

struct ProgramRun {
  int exit_code = -1;  // -1: ended by a signal
  std::string out;
  std::string error;

  nlohmann::json json() const { return nlohmann::json::parse(out); }
};

inline std::string file_text(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw std::runtime_error("cannot read " + file.string());
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

// A run of the program in parallel with the test.
class ProgramProcess {
 public:
  using Arguments = std::vector<std::string>;

  // Sends standard output to this file, such as /dev/full, in place of `out` of the run.
  explicit ProgramProcess(const Arguments& arguments, const std::filesystem::path& standard_output = {}) {
    const std::filesystem::path out = standard_output.empty() ? dir_.path() / "out" : standard_output;
    const std::filesystem::path error = dir_.path() / "error";
    Arguments words = {PALPATE_PROGRAM};
    words.insert(words.end(), arguments.begin(), arguments.end());
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    child_ = fork();
    if (child_ < 0) throw std::runtime_error("cannot fork");
    if (child_ == 0) {
      prctl(PR_SET_PDEATHSIG, SIGKILL);
      redirect(out, STDOUT_FILENO);
      redirect(error, STDERR_FILENO);
      execv(PALPATE_PROGRAM, argv.data());
      _exit(127);
    }
  }
  ProgramProcess(const ProgramProcess&) = delete;
  ProgramProcess& operator=(const ProgramProcess&) = delete;
  ~ProgramProcess() {
    if (child_ > 0) {
      kill(child_, SIGKILL);
      waitpid(child_, nullptr, 0);
    }
  }

  void kill_now() const { kill(child_, SIGKILL); }

  std::string printed_so_far() const {
    const std::filesystem::path out = dir_.path() / "out";
    return std::filesystem::exists(out) ? file_text(out) : "";
  }

  bool is_running() const {
    siginfo_t ended = {};
    return waitid(P_PID, static_cast<id_t>(child_), &ended, WEXITED | WNOHANG | WNOWAIT) == 0 &&
           ended.si_pid == 0;
  }

  // Waits for the end. ctest's time limit ends a test whose program hangs.
  ProgramRun finish() {
    int status = 0;
    waitpid(child_, &status, 0);
    child_ = -1;
    ProgramRun run;
    if (WIFEXITED(status)) run.exit_code = WEXITSTATUS(status);
    if (std::filesystem::exists(dir_.path() / "out")) run.out = file_text(dir_.path() / "out");
    run.error = file_text(dir_.path() / "error");
    return run;
  }

 private:
  static void redirect(const std::filesystem::path& file, int to) {
    const int opened = open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    if (opened < 0 || dup2(opened, to) < 0) _exit(126);
    close(opened);
  }

  TempDir dir_;
  pid_t child_ = -1;
};

inline ProgramRun run_program(const std::vector<std::string>& arguments) {
  return ProgramProcess(arguments).finish();
}

// Runs the program; expects success and no standard error except warnings of late frames on a busy machine.
// A build may also warn of the small tips of many tests.
inline ProgramRun run_cleanly(const std::vector<std::string>& arguments) {
  ProgramRun run = run_program(arguments);
  EXPECT_EQ(run.exit_code, 0) << run.error;
  std::istringstream said(run.error);
  for (std::string line; std::getline(said, line);) {
    const bool is_expected =
        line.find("above the budget of") != std::string::npos ||
        (arguments.front() == "build" && line.find("is smaller than an edge") != std::string::npos);
    EXPECT_TRUE(is_expected) << line;
  }
  return run;
}

// The message of a refused run. Expects exit code 1, no standard output and one line of standard error.
inline std::string refusal_of(const std::vector<std::string>& arguments) {
  const ProgramRun run = run_program(arguments);
  EXPECT_EQ(run.exit_code, 1) << run.out << run.error;
  EXPECT_EQ(run.out, "");
  EXPECT_EQ(std::count(run.error.begin(), run.error.end(), '\n'), 1) << run.error;
  return run.error.substr(0, run.error.find('\n'));
}

// Names in a folder, sorted.
inline std::vector<std::string> names_in(const std::filesystem::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    names.push_back(entry.path().filename().string());
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace palpate::test
