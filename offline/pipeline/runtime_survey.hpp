// Measures the errors of the real runtime, in its own precision, at fully solved pushes.
#pragma once

#include <vector>

#include "offline/pipeline/measured_push.hpp"
#include "offline/precompute/set_survey.hpp"

namespace palpate {

struct RuntimeSurvey {
  SurveyTable table;
  std::vector<SampleErrors> errors;  // one for each push
  // Counts of pushes with an equilibrium, and of pushes whose error lies within the runtime's estimate.
  int solved = 0;
  int displacement_covered = 0;
  int force_covered = 0;
};

// Surveys a packed model at its own sites: polynomial_dd at sampled sites, affine_site at the others. Sites
// of `samples` are the pack's; lengths and forces in model units. Throws std::runtime_error with the status
// where the runtime fails. Runs on `jobs` threads with a progress bar; no digit depends on the threads.
RuntimeSurvey survey_runtime(const OpenedPack& opened, pal_model model,
                             const std::vector<SurveySample>& samples, double max_displacement, int jobs,
                             bool refines);

// Errors at sets of several contacts.
struct RuntimeSetSurvey {
  SetSurvey table;
  std::vector<SetAnswer> answers;  // one for each set
  // nonlinear_zone alone estimates errors: counts of unflagged responses, and of responses within the estimate.
  int estimated = 0;
  int displacement_covered = 0;
  int force_covered = 0;
};

// Surveys linear_dd or nonlinear_zone; each set has its own session. Errors and threads as in survey_runtime().
RuntimeSetSurvey survey_runtime_sets(const OpenedPack& opened, pal_model model, const SolvedSets& solved,
                                     int jobs, bool refines);

// Whether a model accepts several contacts at once.
inline bool answers_sets(pal_model model) {
  return model == PAL_MODEL_LINEAR || model == PAL_MODEL_ZONE;
}

}  // namespace palpate
