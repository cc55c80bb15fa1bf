// palpate_study_validation DIR: writes the numbers of the nonlinear solver's validation as Markdown, which a
// page embeds, and as CSV. The scenes are those that tests/reference/solver_scenes_test.cpp holds to bounds.
#include "bench/solver/validation.hpp"

#include <cstdio>
#include <exception>

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fputs("usage: palpate_study_validation DIR\n", stderr);
    return 1;
  }
  try {
    const std::filesystem::path directory = argv[1];
    std::filesystem::create_directories(directory);
    palpate::study::SceneRunner run;
    palpate::study::write_page(directory, "convergence", palpate::study::convergence_page(run));
    palpate::study::write_page(directory, "hard_cases", palpate::study::hard_cases_page(run));
    palpate::study::write_page(directory, "limit_points", palpate::study::limit_points_page());
    palpate::study::write_page(directory, "locking", palpate::study::locking_page(run));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "palpate_study_validation: %s\n", error.what());
    return 1;
  }
  return 0;
}
