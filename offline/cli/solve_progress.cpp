#include "offline/cli/solve_progress.hpp"

#include <fmt/format.h>

#include <cmath>

namespace palpate {
namespace {

constexpr int kThousand = 1000;

}  // namespace

SolveProgress::SolveProgress(const Step& step, size_t number)
    : most_increments_(step.riks ? step.max_increments : 0),
      bar_(fmt::format("step {}{}", number, step.riks ? ", at most" : ""), kThousand) {}

void SolveProgress::show(const IterationRecord& record) {
  if (record.increment > last_.increment) reached_ = last_.load_factor;
  last_ = record;
  const double digits = std::log(record.residual) / std::log(SolverSettings().residual_tolerance);
  const double increment_progress = std::fmin(std::fmax(digits, 0.0), 1.0);
  const double done = most_increments_ > 0 ? (record.increment - 1 + increment_progress) / most_increments_
                                           : reached_ + increment_progress * (record.load_factor - reached_);
  bar_.show(static_cast<int>(kThousand * done));
}

}  // namespace palpate
