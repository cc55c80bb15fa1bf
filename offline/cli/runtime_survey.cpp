#include "offline/cli/runtime_survey.hpp"

namespace palpate {

RuntimeSurvey survey_runtime(const OpenedPack& opened, pal_model model,
                             const std::vector<SurveySample>& samples, double max_displacement) {
  ModelUnitSession session(opened, model, 1, 0);
  const Eigen::VectorXd at_rest = session.visual_frame();
  std::vector<SampleErrors> estimates;  // of the pushes with an equilibrium
  const auto respond = [&](size_t site, const Eigen::Vector3d& d) {
    const pal_contact contact = {static_cast<std::uint32_t>(site), {d[0], d[1], d[2]}, 0, {}, {}, {}};
    const pal_contact_result result = session.settle({&contact, 1}).front();
    estimates.push_back({result.displacement_error, result.force_error});
    return Answer{session.visual_frame() - at_rest, Eigen::Vector3d(result.force)};
  };
  const std::vector<SampleErrors> errors = sample_errors(samples, respond);
  RuntimeSurvey survey;
  survey.table = tabulate_errors(samples, errors, max_displacement);
  auto estimate = estimates.begin();
  for (size_t i = 0; i < samples.size(); ++i) {
    if (!samples[i].solved) continue;
    survey.displacement_covered += errors[i].displacement <= estimate->displacement ? 1 : 0;
    survey.force_covered += errors[i].force <= estimate->force ? 1 : 0;
    ++estimate;
    ++survey.solved;
  }
  survey.errors = errors;
  return survey;
}

}  // namespace palpate
