// palpate_study_validation DIR [PAGE ...]: writes the figures of the solver's validation as Markdown and CSV,
// for the named pages or for all. tests/reference/solver_scenes_test.cpp bounds the same scenes.
#include "bench/solver/validation.hpp"

#include <algorithm>
#include <cstdio>
#include <exception>
#include <string>
#include <vector>

#include "offline/fem/blas_kernels.hpp"

int main(int argc, char** argv) {
  palpate::choose_blas_kernels();
  if (argc < 2) {
    std::fputs("usage: palpate_study_validation DIR [convergence|hard_cases|limit_points|locking ...]\n",
               stderr);
    return 1;
  }
  try {
    const std::filesystem::path directory = argv[1];
    std::filesystem::create_directories(directory);
    const std::vector<std::string> wanted(argv + 2, argv + argc);
    palpate::study::SceneRunner run;
    const auto write = [&](const std::string& page, auto&& tables) {
      if (wanted.empty() || std::find(wanted.begin(), wanted.end(), page) != wanted.end())
        palpate::study::write_page(directory, page, tables());
    };
    write("convergence", [&] { return palpate::study::convergence_page(run); });
    write("hard_cases", [&] { return palpate::study::hard_cases_page(run); });
    write("limit_points", [&] { return palpate::study::limit_points_page(); });
    write("locking", [&] { return palpate::study::locking_page(run); });
  } catch (const std::exception& error) {
    std::fprintf(stderr, "palpate_study_validation: %s\n", error.what());
    return 1;
  }
  return 0;
}
