#include "offline/pipeline/survey_validation.hpp"

#include <algorithm>

#include "offline/pipeline/survey_table.hpp"

namespace palpate {
namespace {

// Accepted ratio of a new p95 to the pack's p95. Errors below the rounding of float32 fields count as equal.
constexpr double kMostRatio = 1.5;
constexpr double kRounding = 1e-5;
// Accepts a share below 95 % if chance alone gives so few with a probability of at least 1 %.
constexpr double kLeastChance = 0.01;

double ratio(const ErrorFigures& found, const ErrorFigures& claim) {
  return std::max(found.p95, kRounding) / std::max(claim.p95, kRounding);
}

// Whether 95 % of all errors may lie within kMostRatio times the claim. The p95 of few pushes is mostly chance.
bool keeps(const std::vector<SampleErrors>& errors, double SampleErrors::*error, const ErrorFigures& claim) {
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

double part(int covered, int solved) {
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
  return part(measured.displacement_covered, measured.solved);
}

double SurveyValidation::force_coverage() const {
  return part(measured.force_covered, measured.solved);
}

bool SurveyValidation::agrees() const {
  if (measured.errors.empty()) return true;  // no push was at a site of this model
  return keeps(measured.errors, &SampleErrors::displacement, claimed.displacement) &&
         keeps(measured.errors, &SampleErrors::force, claimed.force) &&
         chance_of_covering(measured.displacement_covered, measured.solved) >= kLeastChance &&
         chance_of_covering(measured.force_covered, measured.solved) >= kLeastChance;
}

double KeptSets::displacement_ratio(SetKind kind) const {
  return ratio(of_kind(measured.table, kind)->displacement, of_kind(claimed, kind)->displacement);
}

double KeptSets::force_ratio(SetKind kind) const {
  return ratio(of_kind(measured.table, kind)->force, of_kind(claimed, kind)->force);
}

double KeptSets::displacement_coverage() const {
  return part(measured.displacement_covered, measured.estimated);
}

double KeptSets::force_coverage() const {
  return part(measured.force_covered, measured.estimated);
}

bool KeptSets::agrees() const {
  if (measured.answers.empty()) return true;
  return keeps_sets(&SetAnswer::displacement_error, &SetKindErrors::displacement) &&
         keeps_sets(&SetAnswer::force_error, &SetKindErrors::force) &&
         chance_of_covering(measured.displacement_covered, measured.estimated) >= kLeastChance &&
         chance_of_covering(measured.force_covered, measured.estimated) >= kLeastChance;
}

bool KeptSets::keeps_sets(double SetAnswer::*error, ErrorFigures SetKindErrors::*claim) const {
  int within = 0;
  int counted = 0;
  for (const SetAnswer& answer : measured.answers) {
    const SetKindErrors* said = of_kind(claimed, answer.kind);
    if (said == nullptr || !answer.counts()) continue;
    ++counted;
    within += answer.*error <= kMostRatio * std::max((said->*claim).p95, kRounding) ? 1 : 0;
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
    KeptSets& kept = models.back().sets;
    kept = {claimed.sets, survey_runtime_sets(opened, claimed.runtime_model, sets, jobs, claimed.refines)};
    // With few sites the builder may lack a kind of set.
    std::erase_if(kept.measured.table.kinds,
                  [&](const SetKindErrors& errors) { return of_kind(claimed.sets, errors.kind) == nullptr; });
  }
  return models;
}

bool all_agree(const std::vector<SurveyValidation>& models) {
  return std::all_of(models.begin(), models.end(),
                     [](const SurveyValidation& one) { return one.agrees() && one.sets.agrees(); });
}

}  // namespace palpate
