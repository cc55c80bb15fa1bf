// The progress of a step of `palpate solve`.
#pragma once

#include "offline/fem/static_solver.hpp"
#include "offline/mesh/model.hpp"
#include "offline/output/progress_bar.hpp"

namespace palpate {

// Shows thousandths of the time of the step. A path has no time: INC bounds its progress. Within an increment the
// digits of the residual count.
class SolveProgress {
 public:
  // `number`: of the step, from 1.
  SolveProgress(const Step& step, size_t number);
  void show(const IterationRecord& record);

 private:
  int most_increments_;  // of a path; 0: the step has time
  ProgressBar bar_;
  double reached_ = 0;  // time of the last converged increment
  IterationRecord last_;
};

}  // namespace palpate
