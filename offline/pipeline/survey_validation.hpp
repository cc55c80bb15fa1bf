// Tests a pack's survey against pushes that its builder has not seen.
#pragma once

#include <string>
#include <vector>

#include "offline/pipeline/runtime_survey.hpp"

namespace palpate {

// Claimed and measured errors of a model at contact sets. Empty without a claim or without solved sets.
struct SetValidation {
  SetSurvey claimed = {};
  RuntimeSetSurvey measured = {};

  // Ratios as in SurveyValidation, for one measured kind of set.
  double displacement_ratio(SetKind kind) const;
  double force_ratio(SetKind kind) const;
  double displacement_coverage() const;  // share of unflagged responses within the estimate
  double force_coverage() const;
  // Applies the tests of SurveyValidation::agrees() to each set and the claim for its kind.
  bool agrees() const;

 private:
  bool is_consistent(double SetAnswer::*error, ErrorFigures SetKindErrors::*claim) const;
};

// One model of the pack: claimed and measured errors.
struct SurveyValidation {
  std::string model;  // "linear_dd", ...
  SurveyBin claimed;
  RuntimeSurvey measured;
  SetValidation sets = {};

  // New p95 / the pack's p95. Errors below the rounding of float32 fields count as equal.
  double displacement_ratio() const;
  double force_ratio() const;
  // Share of the pushes with an equilibrium whose error lies within the runtime's estimate.
  double displacement_coverage() const;
  double force_coverage() const;
  // Tests two hypotheses, each at a significance level of 1 %:
  //   1. 95 % of all errors of single contacts lie within 1.5 times the pack's p95,
  //   2. 95 % of all errors lie within the runtime's estimates.
  bool agrees() const;
};

// Validates each model of the pack.
std::vector<SurveyValidation> judge_pack(const OpenedPack& opened, const std::vector<SurveySample>& samples,
                                         double max_displacement, int jobs, const SolvedSets& sets = {});

bool all_agree(const std::vector<SurveyValidation>& models);

}  // namespace palpate
