#include "offline/precompute/set_survey.hpp"

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

}  // namespace

SetSurvey tabulate_sets(const std::vector<SetAnswer>& answers) {
  SetSurvey survey;
  for (const SetKind kind : kSetKinds) {
    const SetKindErrors errors = errors_of(kind, answers);
    if (errors.sets > 0) survey.kinds.push_back(errors);
  }
  std::vector<double> displacement;
  std::vector<double> force;
  for (const SetAnswer& answer : answers) {
    if (answer.is_flagged) continue;
    displacement.push_back(answer.displacement_error / answer.load);
    force.push_back(answer.force_error / answer.load);
  }
  if (!displacement.empty()) {
    survey.displacement_bound = covering_bound(displacement);
    survey.force_bound = covering_bound(force);
  }
  return survey;
}

}  // namespace palpate
