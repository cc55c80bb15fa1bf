// The errors of the real runtime, in its own precision, at pushes that were solved in full.
#pragma once

#include <vector>

#include "offline/pipeline/measured_push.hpp"
#include "offline/precompute/set_survey.hpp"

namespace palpate {

struct RuntimeSurvey {
  SurveyTable table;
  std::vector<SampleErrors> errors;  // of each push
  // Pushes with an equilibrium, and those of them whose error is within what the runtime estimated for it.
  int solved = 0;
  int displacement_covered = 0;
  int force_covered = 0;
};

// Of a model that the pack carries, at the sites that it answers: of polynomial_dd those that were sampled, of
// affine_site the others. Sites of `samples` are the pack's, lengths and forces in the model's units. Throws
// std::runtime_error with the status where the runtime gives no answer. Cost: one haptic and one visual frame a
// sample, and for each site a session and what its model makes ready there. On `jobs` threads, on which no digit
// depends, with a progress bar.
RuntimeSurvey survey_runtime(const OpenedPack& opened, pal_model model,
                             const std::vector<SurveySample>& samples, double max_displacement, int jobs);

// Of sets of several contacts.
struct RuntimeSetSurvey {
  SetSurvey table;
  std::vector<SetAnswer> answers;  // to each set
  // Of nonlinear_zone, which alone estimates them: those without a flag, and of them those whose error is within that.
  int estimated = 0;
  int displacement_covered = 0;
  int force_covered = 0;
};

// Of linear_dd or nonlinear_zone; each set has a session. Throws, and takes threads, as survey_runtime() does.
RuntimeSetSurvey survey_runtime_sets(const OpenedPack& opened, pal_model model, const SolvedSets& solved,
                                     int jobs);

// Whether a model answers several contacts at once.
inline bool answers_sets(pal_model model) {
  return model == PAL_MODEL_LINEAR || model == PAL_MODEL_ZONE;
}

}  // namespace palpate
