#include "offline/cli/solve_failure.hpp"

#include <fmt/core.h>

#include <algorithm>

namespace palpate {
namespace {

const char* text_of(StopCause cause) {
  switch (cause) {
    case StopCause::none:
      break;
    case StopCause::no_tangent:
      return "the tangent cannot be factored; support the body better, or use a smaller load";
    case StopCause::inverted:
      return "the first guess of the smallest increment inverts an element; allow smaller "
             "increments in *STATIC";
    case StopCause::no_descent:
      return "no part of Newton's step reduces the residual; use a finer increment, a smaller load or a "
             "better "
             "shaped mesh there";
    case StopCause::iterations:
      return "the smallest increment takes too many iterations; use a smaller load or a better shaped mesh "
             "there";
    case StopCause::not_finite:
      return "the forces are not finite; correct the loads or their units";
    case StopCause::increments:
      return "INC of *STEP is reached; raise it, or allow larger increments in *STATIC";
    case StopCause::limit_point:
      return "the load has come to a limit point: however little it grows, the next equilibrium is far away, "
             "if there "
             "is one; write *STATIC, RIKS, which follows the path past it, or move the body instead of "
             "loading it";
    case StopCause::sharp_turn:
      return "the path turns sharply there; allow smaller arc increments in *STATIC, RIKS";
    case StopCause::path_reversed:
      return "the body snaps back there: its deflection under the load turns, and the sign of the current "
             "stiffness parameter would send the load back along the path; solve with --stepping arc-length";
  }
  return "";
}

}  // namespace

void print_failure(const SolveReport& report, size_t step, const Model& model) {
  constexpr size_t kRows = 12;
  fmt::print(stderr, "increment  load      iteration  residual    step      min J\n");
  const size_t first = report.history.size() > kRows ? report.history.size() - kRows : 0;
  for (size_t i = first; i < report.history.size(); ++i) {
    const IterationRecord& row = report.history[i];
    fmt::print(stderr, "{:9}  {:<8.6f}  {:9}  {:<10.3e}  {:<8.2e}  {:.4f}\n", row.increment, row.load_factor,
               row.iteration, row.residual, row.step, row.min_jacobian);
  }
  fmt::print(
      stderr,
      "{}: step {} did not converge: last converged load factor {:.6f}, after {} increments and {} cutbacks; "
      "in the last attempt element {} has the smallest J, {:.3g}; {}\n",
      model.file, step, report.load_factor, report.increments, report.cutbacks,
      model.elements[static_cast<size_t>(report.trouble_element)].label, report.trouble_jacobian,
      text_of(report.stopped));
}

}  // namespace palpate
