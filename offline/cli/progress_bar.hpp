// What a terminal shows of work longer than a second: a bar, or a line that follows Newton's iterations. Both
// draw on standard error, and only if that is a terminal.
#pragma once

#include <unistd.h>

#include <chrono>
#include <string>

#include "offline/fem/static_solver.hpp"

namespace palpate {

// "sampling  [#####-----]  31/60  0:42 left". Not thread-safe.
class ProgressBar {
 public:
  ProgressBar(std::string label, int total);
  ~ProgressBar();  // leaves an empty line's start, so that what is printed next stands alone
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  void show(int done);

 private:
  using Clock = std::chrono::steady_clock;
  std::string label_;
  int total_;
  bool on_terminal_;
  bool drawn_ = false;
  Clock::time_point start_ = Clock::now();
  Clock::time_point last_drawn_ = start_;
};

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
