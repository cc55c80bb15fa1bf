#include "offline/report/gnuplot.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <stdexcept>

#include "offline/io/finished_file.hpp"

namespace palpate {
namespace {

constexpr const char* kMissing =
    "gnuplot, which draws the plots of a report, is not there; install Debian's package gnuplot-nox";

// Returns gnuplot's exit code, or -1 where gnuplot cannot start. `out` and `error` are files.
int run_gnuplot(std::string argument, const std::string& out, const std::string& error) {
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  constexpr int kFlags = O_WRONLY | O_CREAT | O_TRUNC;
  constexpr mode_t kMode = 0644;
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, out.c_str(), kFlags, kMode);
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, error.c_str(), kFlags, kMode);
  std::string name = "gnuplot";
  char* arguments[] = {name.data(), argument.data(), nullptr};
  pid_t child = 0;
  const int failed = posix_spawnp(&child, name.c_str(), &actions, nullptr, arguments, environ);
  posix_spawn_file_actions_destroy(&actions);
  if (failed != 0) return -1;
  int status = 0;
  if (waitpid(child, &status, 0) < 0) return -1;
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

}  // namespace

void require_gnuplot() {
  if (run_gnuplot("--version", "/dev/null", "/dev/null") != 0) throw std::runtime_error(kMissing);
}

void draw_plot(const std::string& script, int width, int height, const std::filesystem::path& file) {
  std::filesystem::path source = file;
  std::filesystem::path picture = file;
  std::filesystem::path complaints = file;
  source += ".gp";
  picture += ".svg";
  complaints += ".log";
  write_finished_text(source,
                      fmt::format("set terminal svg size {},{} font 'Helvetica,14' enhanced background "
                                  "'#ffffff'\nset encoding utf8\n{}",
                                  width, height, script));
  if (run_gnuplot(source.string(), picture.string(), complaints.string()) == 0) {
    std::filesystem::remove(complaints);
    return;
  }
  std::ifstream stream(complaints);
  std::string line;
  while (std::getline(stream, line) && line.find_first_not_of(" ^\t\r") == std::string::npos) {
  }
  throw std::runtime_error(line.empty() ? kMissing : source.string() + ": gnuplot says: " + line);
}

}  // namespace palpate
