// palpate: turns a model file into an organ that responds to touch.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <filesystem>
#include <new>
#include <string>
#include <vector>

#include "offline/cli/commands.hpp"
#include "offline/fem/address_space.hpp"
#include "offline/fem/blas_kernels.hpp"
#include "offline/mesh/nearest_name.hpp"

namespace {

constexpr const char* kDescription =
    "Palpate: nonlinear soft tissue that answers a touch at haptic rate.\n\n"
    "  palpate mesh   liver.stl -o liver.vtu    tetrahedra in a closed surface\n"
    "  palpate new    liver.vtk                 a scene for a mesh of an organ\n"
    "  palpate solve  model.inp -o DIR          full nonlinear finite elements\n"
    "  palpate build  scene.toml -o organ.pack  learn how the organ answers, and how wrong that is\n"
    "  palpate eval   organ.pack --contact 7=0,0,-5\n\n"
    "`palpate COMMAND --help` explains each command.";

// Formats an invalid command line as one line that points to the help.
std::string usage_error(const CLI::App& app, const CLI::ParseError& error) {
  const std::vector<CLI::App*> chosen = app.get_subcommands();
  const CLI::App& command = chosen.empty() ? app : *chosen.front();
  const std::string name = chosen.empty() ? "palpate" : "palpate " + command.get_name();
  std::string reason = error.what();
  // CLI11 reports a missing option before an unknown word. The unknown word explains the mistake better.
  if (const std::vector<std::string> words = app.remaining(true); !words.empty()) {
    const std::string& word = words.front();
    std::vector<std::string> known;
    if (word.starts_with('-')) {
      for (const CLI::Option* option : command.get_options()) {
        for (const std::string& long_name : option->get_lnames()) known.push_back("--" + long_name);
      }
      reason = std::find(known.begin(), known.end(), word) == known.end()
                   ? "there is no option " + word + palpate::did_you_mean(word, known)
                   : "the option " + word + " belongs behind " + command.get_name();
    } else if (chosen.empty()) {
      for (const CLI::App* one : app.get_subcommands(nullptr)) known.push_back(one->get_name());
      reason = "there is no command " + word + palpate::did_you_mean(word, known);
    }
  }
  return name + ": " + reason + "; see '" + name + " --help'";
}

// Prints a message that may quote any argument, without the control characters that change a terminal.
void print_error(std::string message) {
  std::replace_if(
      message.begin(), message.end(),
      [](unsigned char letter) { return std::iscntrl(letter) != 0 && letter != '\n' && letter != '\t'; },
      '?');
  std::fprintf(stderr, "%s\n", message.c_str());
}

// Flushes standard output, where a full disk shows first. Returns false, after a message, on failure.
bool flush_output() {
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return true;
  std::fprintf(stderr, "standard output: cannot be written (%s)\n", std::strerror(errno));
  return false;
}

int run(int argc, char** argv) {
  CLI::App app{kDescription, "palpate"};
  app.set_version_flag("--version", PALPATE_VERSION);
  app.require_subcommand(1);
  int exit_code = 0;
  palpate::add_new_command(app);
  palpate::add_check_command(app);
  palpate::add_convert_command(app);
  palpate::add_mesh_command(app);
  palpate::add_solve_command(app, exit_code);
  palpate::add_build_command(app, exit_code);
  palpate::add_info_command(app, exit_code);
  palpate::add_verify_command(app, exit_code);
  palpate::add_validate_command(app, exit_code);
  palpate::add_eval_command(app, exit_code);
  palpate::add_picture_command(app, exit_code);
  palpate::add_bench_command(app, exit_code);
  palpate::add_replay_command(app, exit_code);
  palpate::add_report_command(app, exit_code);
  if (argc < 2) {
    std::fprintf(stderr, "%s\npalpate: name a command\n", app.help().c_str());
    return 1;
  }
  // An unset variable of the shell gives an empty argument.
  for (int i = 1; i < argc; ++i) {
    if (argv[i][0] != '\0') continue;
    std::fprintf(stderr, "palpate: argument %d is empty%s%s; name a file or give a value\n", i,
                 i > 1 ? ", behind " : "", i > 1 ? argv[i - 1] : "");
    return 1;
  }
  if (std::strcmp(argv[1], "mesh") == 0) palpate::run_mesher(argv + 1);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() != 0) {
      print_error(usage_error(app, error));
      return 1;
    }
    app.exit(error);  // --help and --version print themselves
  }
  return exit_code;
}

}  // namespace

int main(int argc, char** argv) {
  int exit_code = 0;
  try {
    if (const std::string shortage = palpate::address_space_shortage(); !shortage.empty()) {
      std::fprintf(stderr, "palpate: %s\n", shortage.c_str());
      std::_Exit(1);
    }
    palpate::choose_blas_kernels();
    exit_code = run(argc, argv);
  } catch (const std::bad_alloc&) {
    std::fprintf(stderr, "palpate: out of memory\n");
    return 1;
  } catch (const std::filesystem::filesystem_error& error) {
    print_error(error.path1().string() + ": " + error.code().message() + "; name another file or folder");
    return 1;
  } catch (const std::exception& error) {
    print_error(error.what());
    return 1;
  }
  return flush_output() || exit_code != 0 ? exit_code : 1;
}
