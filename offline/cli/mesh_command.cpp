// palpate mesh: hands its arguments to palpate_mesher, the program beside this one. CGAL's licence, the GPL,
// keeps the two apart: offline/mesher/README.md.
#include <unistd.h>

#include <CLI/App.hpp>
#include <cerrno>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <system_error>

#include "offline/cli/commands.hpp"

namespace palpate {

void add_mesh_command(CLI::App& app) {
  app.add_subcommand("mesh", "Fill a closed surface, such as STL, with tetrahedra");
}

void run_mesher(char** arguments) {
  const std::filesystem::path mesher =
      std::filesystem::read_symlink("/proc/self/exe").replace_filename("palpate_mesher");
  execv(mesher.c_str(), arguments);
  const int reason = errno;
  throw std::runtime_error(
      "palpate mesh: cannot run " + mesher.string() + " (" + std::generic_category().message(reason) + ")" +
      (reason == ENOENT ? "; install libcgal-dev, and build again with PALPATE_MESHER=ON" : ""));
}

}  // namespace palpate
