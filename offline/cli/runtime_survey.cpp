#include "offline/cli/runtime_survey.hpp"

#include <numeric>
#include <utility>

namespace palpate {
namespace {

// Of what was measured push by push.
RuntimeSurvey survey_of(const std::vector<SurveySample>& samples, const std::vector<MeasuredPush>& pushes,
                        double max_displacement) {
  RuntimeSurvey survey;
  for (size_t i = 0; i < samples.size(); ++i) {
    const MeasuredPush& push = pushes[i];
    survey.errors.push_back({push.displacement_error, push.force_error});
    if (!samples[i].solved) continue;
    survey.displacement_covered += push.displacement_error <= push.displacement_estimate ? 1 : 0;
    survey.force_covered += push.force_error <= push.force_estimate ? 1 : 0;
    ++survey.solved;
  }
  survey.table = tabulate_errors(samples, survey.errors, max_displacement);
  return survey;
}

}  // namespace

RuntimeSurvey survey_runtime(const OpenedPack& opened, pal_model model,
                             const std::vector<SurveySample>& samples, double max_displacement) {
  ModelUnitSession session(opened, model, 1, 0);
  std::vector<std::uint32_t> sites(opened.info().num_sites);
  std::iota(sites.begin(), sites.end(), 0u);
  std::vector<MeasuredPush> pushes =
      measure_pushes(truths_of(samples), runtime_method(session, std::move(sites)));
  if (model != PAL_MODEL_POLYNOMIAL && model != PAL_MODEL_AFFINE)
    return survey_of(samples, pushes, max_displacement);
  const auto polynomials = opened.segment<pack::PolynomialSite>(*opened.tables().polynomial_dd()->sites());
  std::vector<SurveySample> answered;
  std::vector<MeasuredPush> measured;
  for (size_t i = 0; i < samples.size(); ++i) {
    if ((polynomials[samples[i].site].samples == 0) != (model == PAL_MODEL_AFFINE)) continue;
    answered.push_back(samples[i]);
    measured.push_back(pushes[i]);
  }
  return survey_of(answered, measured, max_displacement);
}

}  // namespace palpate
