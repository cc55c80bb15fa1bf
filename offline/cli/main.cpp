// palpate: from a model file to an organ that answers a touch.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <new>

#include "offline/cli/commands.hpp"

namespace {

constexpr const char* kDescription =
    "Palpate: nonlinear soft tissue that answers a touch at haptic rate.\n\n"
    "  palpate solve  model.inp -o DIR          full nonlinear finite elements\n"
    "  palpate build  scene.toml -o organ.pack  learn how the organ answers, and how wrong that is\n"
    "  palpate eval   organ.pack --contact 7=0,0,-5\n\n"
    "`palpate COMMAND --help` explains each command.";

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{kDescription, "palpate"};
  app.set_version_flag("--version", PALPATE_VERSION);
  app.require_subcommand(1);
  app.failure_message([](const CLI::App* failed, const CLI::Error& error) {
    return "palpate: " + std::string(error.what()) + "; see '" + failed->get_name() + " --help'\n";
  });
  int exit_code = 0;
  palpate::add_solve_command(app, exit_code);
  palpate::add_build_command(app, exit_code);
  palpate::add_info_command(app, exit_code);
  palpate::add_verify_command(app, exit_code);
  palpate::add_eval_command(app, exit_code);
  palpate::add_picture_command(app, exit_code);
  palpate::add_bench_command(app, exit_code);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 1;
  } catch (const std::bad_alloc&) {
    std::fprintf(stderr, "palpate: out of memory\n");
    return 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return exit_code;
}
