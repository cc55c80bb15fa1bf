// Measures the errors of the real runtime, in its own precision, at fully solved pushes.
#pragma once

#include <vector>

#include "offline/pipeline/measured_push.hpp"
#include "offline/precompute/set_survey.hpp"

namespace palpate {

struct RuntimeSurvey {
  SurveyTable table;
  std::vector<SampleErrors> errors;  // one for each push
  // Numbers of pushes with an equilibrium, and of pushes with an error within the runtime's estimate.
  int solved = 0;
  int displacement_covered = 0;
  int force_covered = 0;
};

// Surveys a packed model at its own sites: polynomial_dd at sampled sites, affine_site at the others.
// `samples` name sites of the pack, in model units. `refines`: as in ModelUnitSession. Throws
// std::runtime_error where the runtime fails. Shows a progress bar. Digits do not depend on the threads.
RuntimeSurvey survey_runtime(const OpenedPack& opened, pal_model model,
                             const std::vector<SurveySample>& samples, double max_displacement, int jobs,
                             bool refines);

// Errors at sets of several contacts.
struct RuntimeSetSurvey {
  SetSurvey table;
  std::vector<SetAnswer> answers;  // one for each set
  // Only nonlinear_zone estimates errors: numbers of unflagged and of covered responses.
  int estimated = 0;
  int displacement_covered = 0;
  int force_covered = 0;
};

// Surveys linear_dd or nonlinear_zone, with a session for each set. Throws as survey_runtime().
RuntimeSetSurvey survey_runtime_sets(const OpenedPack& opened, pal_model model, const SolvedSets& solved,
                                     int jobs, bool refines);

// Whether a model accepts several contacts at once.
inline bool answers_sets(pal_model model) {
  return model == PAL_MODEL_LINEAR || model == PAL_MODEL_ZONE;
}

}  // namespace palpate
