// Shows the iterations of a solve on one line of the terminal.
#pragma once

#include <unistd.h>

#include "offline/fem/static_solver.hpp"

namespace palpate {

// "step 1  load  40.0 %  increment 3  iteration 2  residual 1.2e-05  min J 0.412".
class SolveProgress {
 public:
  explicit SolveProgress(size_t step) : step_(step), on_terminal_(isatty(STDERR_FILENO) == 1) {}
  void show(const IterationRecord& record);
  void finish();

 private:
  size_t step_;
  bool on_terminal_;
  bool drawn_ = false;
};

}  // namespace palpate
