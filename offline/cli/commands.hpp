// The commands of the program. Each function adds a command to the command line. The chosen command runs and
// sets `exit_code`:
//   0  done
//   1  the input cannot be used
//   2  the computation did not converge
// Errors are exceptions; main() prints their line.
#pragma once

#include <CLI/App.hpp>

namespace palpate {

void add_solve_command(CLI::App& app, int& exit_code);
void add_build_command(CLI::App& app, int& exit_code);
void add_info_command(CLI::App& app, int& exit_code);
void add_verify_command(CLI::App& app, int& exit_code);
void add_eval_command(CLI::App& app, int& exit_code);
void add_picture_command(CLI::App& app, int& exit_code);
void add_bench_command(CLI::App& app, int& exit_code);
void add_replay_command(CLI::App& app, int& exit_code);
void add_validate_command(CLI::App& app, int& exit_code);
void add_report_command(CLI::App& app, int& exit_code);
void add_new_command(CLI::App& app);
void add_check_command(CLI::App& app);
void add_convert_command(CLI::App& app);

// Lists `mesh` in the help. The program of run_mesher() has its options.
void add_mesh_command(CLI::App& app);

// Replaces this process by the mesher. `arguments`: "mesh" and those behind it, ended by null. Throws
// std::runtime_error with a remedy where the mesher is absent.
[[noreturn]] void run_mesher(char** arguments);

}  // namespace palpate
