// The errors of the real runtime, in its own precision, at pushes that were solved in full.
#pragma once

#include <vector>

#include "offline/cli/opened_pack.hpp"
#include "offline/precompute/error_survey.hpp"

namespace palpate {

struct RuntimeSurvey {
  SurveyTable table;
  // Pushes with an equilibrium, and those of them whose error is within what the runtime estimated for it.
  int solved = 0;
  int displacement_covered = 0;
  int force_covered = 0;
};

// The pack carries the model.
RuntimeSurvey survey_runtime(const OpenedPack& opened, pal_model model,
                             const std::vector<SurveySample>& samples, double max_displacement);

}  // namespace palpate
