#include "offline/pipeline/survey_validation.hpp"

#include <algorithm>

#include "offline/pipeline/survey_table.hpp"

namespace palpate {
namespace {

// Accepted ratio of an error to the p95 in the pack. Errors below the rounding of float32 count as equal.
constexpr double kMostRatio = 1.5;
constexpr double kRounding = 1e-5;
// A share below 95 % is accepted if chance alone gives so small a share with at least this probability.
constexpr double kLeastChance = 0.01;

double ratio(const ErrorFigures& found, const ErrorFigures& claim) {
  return std::max(found.p95, kRounding) / std::max(claim.p95, kRounding);
}

// Whether the share of errors within kMostRatio times the claimed p95 is consistent with 95 %. The test
// counts errors, since the p95 of few pushes is mostly chance.
bool is_within_claim(const std::vector<SampleErrors>& errors, double SampleErrors::*error,
                     const ErrorFigures& claim) {
  const double most = kMostRatio * std::max(claim.p95, kRounding);
  const auto within = std::count_if(errors.begin(), errors.end(),
                                    [&](const SampleErrors& one) { return one.*error <= most; });
  return chance_of_covering(static_cast<int>(within), static_cast<int>(errors.size())) >= kLeastChance;
}

const SetKindErrors* of_kind(const SetSurvey& survey, SetKind kind) {
  const auto found = std::find_if(survey.kinds.begin(), survey.kinds.end(),
                                  [&](const SetKindErrors& errors) { return errors.kind == kind; });
  return found == survey.kinds.end() ? nullptr : &*found;
}

double coverage(int covered, int solved) {
  return solved > 0 ? 1.0 * covered / solved : 0;
}

}  // namespace

double SurveyValidation::displacement_ratio() const {
  return ratio(measured.table.overall.displacement, claimed.displacement);
}

double SurveyValidation::force_ratio() const {
  return ratio(measured.table.overall.force, claimed.force);
}

double SurveyValidation::displacement_coverage() const {
  return coverage(measured.displacement_covered, measured.solved);
}

double SurveyValidation::force_coverage() const {
  return coverage(measured.force_covered, measured.solved);
}

bool SurveyValidation::agrees() const {
  if (measured.errors.empty()) return true;  // no push at a site of this model
  return is_within_claim(measured.errors, &SampleErrors::displacement, claimed.displacement) &&
         is_within_claim(measured.errors, &SampleErrors::force, claimed.force) &&
         chance_of_covering(measured.displacement_covered, measured.solved) >= kLeastChance &&
         chance_of_covering(measured.force_covered, measured.solved) >= kLeastChance;
}

double SetValidation::displacement_ratio(SetKind kind) const {
  return ratio(of_kind(measured.table, kind)->displacement, of_kind(claimed, kind)->displacement);
}

double SetValidation::force_ratio(SetKind kind) const {
  return ratio(of_kind(measured.table, kind)->force, of_kind(claimed, kind)->force);
}

double SetValidation::displacement_coverage() const {
  return coverage(measured.displacement_covered, measured.estimated);
}

double SetValidation::force_coverage() const {
  return coverage(measured.force_covered, measured.estimated);
}

bool SetValidation::agrees() const {
  if (measured.answers.empty()) return true;
  return is_consistent(&SetAnswer::displacement_error, &SetKindErrors::displacement) &&
         is_consistent(&SetAnswer::force_error, &SetKindErrors::force) &&
         chance_of_covering(measured.displacement_covered, measured.estimated) >= kLeastChance &&
         chance_of_covering(measured.force_covered, measured.estimated) >= kLeastChance;
}

bool SetValidation::is_consistent(double SetAnswer::*error, ErrorFigures SetKindErrors::*claim) const {
  int within = 0;
  int counted = 0;
  for (const SetAnswer& answer : measured.answers) {
    const SetKindErrors* claimed_errors = of_kind(claimed, answer.kind);
    if (claimed_errors == nullptr || !answer.counts()) continue;
    ++counted;
    within += answer.*error <= kMostRatio * std::max((claimed_errors->*claim).p95, kRounding) ? 1 : 0;
  }
  return chance_of_covering(within, counted) >= kLeastChance;
}

std::vector<SurveyValidation> judge_pack(const OpenedPack& opened, const std::vector<SurveySample>& samples,
                                         double max_displacement, int jobs, const SolvedSets& sets) {
  std::vector<SurveyValidation> models;
  for (const ModelErrors& claimed : surveys_of(opened.tables())) {
    models.push_back(
        {claimed.model,
         claimed.table.overall,
         survey_runtime(opened, claimed.runtime_model, samples, max_displacement, jobs, claimed.refines),
         {}});
    if (claimed.sets.kinds.empty() || sets.sets.empty()) continue;
    SetValidation& validation = models.back().sets;
    validation = {claimed.sets,
                  survey_runtime_sets(opened, claimed.runtime_model, sets, jobs, claimed.refines)};
    // A builder with few sites may lack a kind of set.
    std::erase_if(validation.measured.table.kinds,
                  [&](const SetKindErrors& errors) { return of_kind(claimed.sets, errors.kind) == nullptr; });
  }
  return models;
}

bool all_agree(const std::vector<SurveyValidation>& models) {
  return std::all_of(models.begin(), models.end(),
                     [](const SurveyValidation& one) { return one.agrees() && one.sets.agrees(); });
}

}  // namespace palpate
