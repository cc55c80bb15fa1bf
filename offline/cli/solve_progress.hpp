// The progress of a step of `palpate solve`.
#pragma once

#include "offline/fem/static_solver.hpp"
#include "offline/mesh/model.hpp"
#include "offline/output/progress_bar.hpp"

namespace palpate {

// Shows the progress of a step in thousandths of its time, or of INC for a path (RIKS), which has no time.
// Within an increment, progress is log(residual) / log(residual_tolerance).
class SolveProgress {
 public:
  // `number` counts the steps from 1.
  SolveProgress(const Step& step, size_t number);
  void show(const IterationRecord& record);

 private:
  int most_increments_;  // INC of a path; 0: the step has time
  ProgressBar bar_;
  double reached_ = 0;  // time of the last converged increment
  IterationRecord last_;
};

}  // namespace palpate
