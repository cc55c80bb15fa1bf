// Whether a pack's models are as good as the pack says, judged by pushes that its builder has not seen.
#pragma once

#include <string>
#include <vector>

#include "offline/pipeline/runtime_survey.hpp"

namespace palpate {

// What a model says of sets of several contacts, and what it is worth there. Empty where nothing is said or was solved.
struct KeptSets {
  SetSurvey claimed = {};
  RuntimeSetSurvey measured = {};

  // As SurveyValidation has them, of a kind of sets that was measured.
  double displacement_ratio(SetKind kind) const;
  double force_ratio(SetKind kind) const;
  double displacement_coverage() const;  // of the answers without a flag
  double force_coverage() const;
  // As SurveyValidation::agrees(), each set beside what is said of its kind.
  bool agrees() const;

 private:
  bool keeps_sets(double SetAnswer::*error, ErrorFigures SetKindErrors::*claim) const;
};

// One model of the pack, as it says and as it is.
struct SurveyValidation {
  std::string model;  // "linear_dd", ...
  SurveyBin claimed;
  RuntimeSurvey measured;
  KeptSets sets = {};

  // New p95 over the pack's; errors below the rounding of fields in float32 are alike.
  double displacement_ratio() const;
  double force_ratio() const;
  // Of the pushes with an equilibrium, those within what the runtime estimated for them.
  double displacement_coverage() const;
  double force_coverage() const;
  // Whether 95 % of all errors of single contacts may lie within 1.5 times the pack's p95, and within the estimates:
  // as few of the measured ones as chance leaves once in a hundred times, or more.
  bool agrees() const;
};

// Of each model that the pack carries.
std::vector<SurveyValidation> judge_pack(const OpenedPack& opened, const std::vector<SurveySample>& samples,
                                         double max_displacement, int jobs, const SolvedSets& sets = {});

bool all_agree(const std::vector<SurveyValidation>& models);

}  // namespace palpate
