#include "offline/cli/solve_progress.hpp"

#include <fmt/core.h>

#include <cstdio>
#include <string>

namespace palpate {

void SolveProgress::show(const IterationRecord& record) {
  if (!on_terminal_) return;
  drawn_ = true;
  const std::string line = fmt::format(
      "\r\033[Kstep {}  load {:5.1f} %  increment {}  iteration {}  residual {:.1e}  min J {:.3f}", step_,
      100 * record.load_factor, record.increment, record.iteration, record.residual, record.min_jacobian);
  std::fputs(line.c_str(), stderr);
  std::fflush(stderr);
}

void SolveProgress::finish() {
  if (drawn_) std::fputs("\r\033[K", stderr);
}

}  // namespace palpate
