#include "offline/precompute/set_survey.hpp"

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

// What covers the errors over `size` of answers without a flag.
double bound_over(double SetAnswer::*error, double SetAnswer::*size, const std::vector<SetAnswer>& answers) {
  std::vector<double> parts;
  for (const SetAnswer& answer : answers) {
    if (!answer.is_flagged) parts.push_back(answer.*error / answer.*size);
  }
  return parts.empty() ? 0 : covering_bound(std::move(parts));
}

}  // namespace

SetSurvey tabulate_sets(const std::vector<SetAnswer>& answers) {
  SetSurvey survey;
  for (const SetKind kind : kSetKinds) {
    const SetKindErrors errors = errors_of(kind, answers);
    if (errors.sets > 0) survey.kinds.push_back(errors);
  }
  survey.displacement_bound = bound_over(&SetAnswer::displacement_error, &SetAnswer::load, answers);
  survey.force_bound = bound_over(&SetAnswer::force_error, &SetAnswer::load, answers);
  survey.displacement_reach_bound = bound_over(&SetAnswer::displacement_error, &SetAnswer::reach, answers);
  survey.force_reach_bound = bound_over(&SetAnswer::force_error, &SetAnswer::reach, answers);
  return survey;
}

}  // namespace palpate
