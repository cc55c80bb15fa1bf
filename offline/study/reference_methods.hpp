// What an organ is answered with where nothing is packed: linear methods, and Newton's method on the full model, each
// frame from the one before.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "offline/fem/static_solver.hpp"
#include "offline/pipeline/carried_scene.hpp"
#include "offline/precompute/contact_truth.hpp"
#include "offline/study/report_effort.hpp"
#include "offline/study/report_rows.hpp"

namespace palpate {

// Full Newton, warm: the state of the frame before, its patches moved on, and as many iterations as that takes to
// converge.
class NewtonFrames {
 public:
  // Starts from rest. No two of the sites share a node.
  NewtonFrames(const Organ& organ, const std::vector<size_t>& sites);

  // The same sites in each frame. Throws std::runtime_error where there is no equilibrium.
  void frame(const std::vector<LinearContact>& contacts);

 private:
  const Organ* organ_;
  StaticSolver solver_;
  LoadCase load_;
  Eigen::VectorXd u_;
};

// Adds a row for each of them and each level: errors over its pushes, times of frames that go around at its |d|, at the
// sites of the last level's first push. `contacts`: of each push. Draws progress bars.
void compare_references(const Organ& organ, const ReportEffort& effort, const std::vector<Level>& levels,
                        int contacts, ReportRows& rows);

}  // namespace palpate
