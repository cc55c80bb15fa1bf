// Reference methods without a pack: linear methods, and Newton's method on the full model with warm starts.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "offline/fem/static_solver.hpp"
#include "offline/pipeline/carried_scene.hpp"
#include "offline/precompute/contact_truth.hpp"
#include "offline/study/report_effort.hpp"
#include "offline/study/report_rows.hpp"

namespace palpate {

// Full Newton: starts from the state of the frame before, moves the patches, and iterates to convergence.
class NewtonFrames {
 public:
  // Starts from rest. The sites must share no node.
  NewtonFrames(const Organ& organ, const std::vector<size_t>& sites);

  // Every frame has the same sites. Throws std::runtime_error where no equilibrium exists.
  void frame(const std::vector<LinearContact>& contacts);

 private:
  const Organ* organ_;
  StaticSolver solver_;
  LoadCase load_;
  Eigen::VectorXd u_;
};

// Adds a row for each method and each level: errors over the level's pushes, and frame times. The timed frames move at
// the level's |d|, at the sites of the last level's first push. `contacts`: contacts of each push. Draws progress bars.
void compare_references(const Organ& organ, const ReportEffort& effort, const std::vector<Level>& levels,
                        int contacts, ReportRows& rows);

}  // namespace palpate
