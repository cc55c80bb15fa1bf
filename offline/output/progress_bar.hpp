// Shows the progress of work longer than a second on standard error, if standard error is a terminal.
#pragma once

#include <chrono>
#include <string>

namespace palpate {

// "sampling  [#####-----]  31/60  0:42 left". Not thread-safe.
class ProgressBar {
 public:
  ProgressBar(std::string label, int total);
  ~ProgressBar();  // clears the line for later output
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

}  // namespace palpate
