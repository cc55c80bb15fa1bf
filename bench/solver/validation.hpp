// The pages of the validation study, and the runner of their scenes.
#pragma once

#include <vector>

#include "bench/solver/study_table.hpp"
#include "offline/output/progress_bar.hpp"
#include "tests/support/scene_run.hpp"

namespace palpate::study {

// Runs scenes and advances a progress bar.
class SceneRunner {
 public:
  test::SceneRun operator()(const test::SolverScene& scene, const SolverSettings& settings = {}) {
    test::SceneRun run = test::run_scene(scene, settings);
    bar_.show(++done_);
    return run;
  }

 private:
  static constexpr int kScenes = 366;  // scenes of all pages, the end of the progress bar
  ProgressBar bar_{"validation", kScenes};
  int done_ = 0;
};

// Beam theory, Newton's order, units and frames.
std::vector<StudyTable> convergence_page(SceneRunner& run);
// Large rotations, stiff inclusions, slivers, deep pushes.
std::vector<StudyTable> hard_cases_page(SceneRunner& run);
// Snap-through and buckling, by arc length.
std::vector<StudyTable> limit_points_page();
// Linear against quadratic tetrahedra in nearly incompressible tissue.
std::vector<StudyTable> locking_page(SceneRunner& run);

}  // namespace palpate::study
