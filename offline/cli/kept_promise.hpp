// Whether a pack's models are as good as the pack says, judged by pushes that its builder has not seen.
#pragma once

#include <string>
#include <vector>

#include "offline/cli/runtime_survey.hpp"

namespace palpate {

// One model of the pack, as it says and as it is.
struct KeptPromise {
  std::string model;  // "linear_dd", ...
  SurveyBin claimed;
  RuntimeSurvey measured;

  // New p95 over the pack's; errors below the rounding of fields in float32 are alike.
  double displacement_ratio() const;
  double force_ratio() const;
  // Of the pushes with an equilibrium, those within what the runtime estimated for them.
  double displacement_coverage() const;
  double force_coverage() const;
  // Whether 95 % of all errors may lie within 1.5 times the pack's p95, and within the estimates: as few of the
  // measured ones as chance leaves once in a hundred times, or more.
  bool agrees() const;
};

// Of each model that the pack carries.
std::vector<KeptPromise> judge_pack(const OpenedPack& opened, const std::vector<SurveySample>& samples,
                                    double max_displacement);

bool all_agree(const std::vector<KeptPromise>& models);

}  // namespace palpate
