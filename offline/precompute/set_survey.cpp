#include "offline/precompute/set_survey.hpp"

#include <algorithm>
#include <utility>

namespace palpate {
namespace {

SetKindErrors errors_of(SetKind kind, const std::vector<SetAnswer>& answers) {
  SetKindErrors errors;
  errors.kind = kind;
  std::vector<double> displacement;
  std::vector<double> force;
  for (const SetAnswer& answer : answers) {
    if (answer.kind != kind) continue;
    ++errors.sets;
    errors.unsolved += answer.is_solved ? 0 : 1;
    errors.flagged += answer.is_flagged ? 1 : 0;
    if (!answer.counts()) continue;
    displacement.push_back(answer.displacement_error);
    force.push_back(answer.force_error);
  }
  errors.displacement = figures_of(displacement);
  errors.force = figures_of(force);
  return errors;
}

// Returns bounds of error / size over unflagged responses.
SetBounds bounds_over(double SetAnswer::*size, const std::vector<SetAnswer>& answers) {
  // Errors of smaller sets are mostly rounding.
  constexpr double kLeastSize = 0.05;
  std::vector<double> displacement;
  std::vector<double> force;
  for (const SetAnswer& answer : answers) {
    if (answer.is_flagged) continue;
    const double divisor = std::max(answer.*size, kLeastSize);
    displacement.push_back(answer.displacement_error / divisor);
    force.push_back(answer.force_error / divisor);
  }
  if (displacement.empty()) return {};
  return {covering_bound(std::move(displacement)), covering_bound(std::move(force))};
}

}  // namespace

SetSurvey tabulate_sets(const std::vector<SetAnswer>& answers) {
  SetSurvey survey;
  for (const SetKind kind : kSetKinds) {
    const SetKindErrors errors = errors_of(kind, answers);
    if (errors.sets > 0) survey.kinds.push_back(errors);
  }
  survey.over_load = bounds_over(&SetAnswer::load, answers);
  survey.over_reach = bounds_over(&SetAnswer::reach, answers);
  return survey;
}

}  // namespace palpate
