#include "offline/pipeline/runtime_survey.hpp"

#include <algorithm>
#include <set>
#include <string>
#include <utility>

#include "offline/output/progress_bar.hpp"
#include "offline/precompute/solver_threads.hpp"

namespace palpate {
namespace {

// Collects the errors of all measured pushes.
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

// Returns the reach of a set (ErrorSurvey in schemas/pack.fbs): the sum of (|d| / max_displacement)^2.
double reach_of(const OpenedPack& opened, const ContactTruth& set) {
  double reach = 0;
  for (const LinearContact& contact : set.contacts)
    reach += (contact.displacement / opened.tables().sites()->max_displacement()).squaredNorm();
  return reach;
}

// Returns the load of a set (ErrorSurvey): the largest |f| / (max_displacement |S|), S the patch stiffness.
double load_of(const OpenedPack& opened, const ContactTruth& set, const MethodAnswer& answer) {
  const pack::ContactSites& sites = *opened.tables().sites();
  const std::span<const std::uint32_t> starts = opened.segment(*sites.patch_starts());
  const std::span<const double> forces = opened.segment<double>(*opened.tables().linear_dd()->site_forces());
  double load = 0;
  for (size_t c = 0; c < set.contacts.size(); ++c) {
    const size_t site = set.contacts[c].site;
    Eigen::Matrix3d stiffness = Eigen::Matrix3d::Zero();
    for (size_t p = starts[site]; p < starts[site + 1]; ++p)
      stiffness += Eigen::Map<const Eigen::Matrix3d>(forces.data() + 9 * p);
    load = std::max(load, answer.forces[c].norm() / (sites.max_displacement() * stiffness.norm()));
  }
  return load;
}

}  // namespace

RuntimeSetSurvey survey_runtime_sets(const OpenedPack& opened, pal_model model, const SolvedSets& solved,
                                     int jobs, bool refines) {
  RuntimeSetSurvey survey;
  size_t most_contacts = 1;
  for (const ContactSet& set : solved.sets) most_contacts = std::max(most_contacts, set.contacts.size());
  survey.answers.resize(solved.sets.size());
  std::vector<SampleErrors> estimates(solved.sets.size());
  const auto measure_set = [&](size_t, size_t i) {
    const ContactTruth& truth = solved.truths[i];
    const MethodAnswer answer =
        runtime_method(opened, model, static_cast<std::uint32_t>(most_contacts), 0, refines)(truth.contacts);
    estimates[i] = {answer.displacement_estimate, answer.force_estimate};
    SetAnswer& set_answer = survey.answers[i];
    set_answer.kind = solved.sets[i].kind;
    set_answer.is_solved = truth.solved;
    const std::uint32_t expected = refines ? 0 : PAL_FLAG_UNREFINED;
    set_answer.is_flagged = (answer.flags & ~expected) != 0;
    set_answer.reach = reach_of(opened, truth);
    if (model == PAL_MODEL_ZONE) set_answer.load = load_of(opened, truth, answer);
    if (!truth.solved) return;
    const MeasuredPush push = measure_push(truth, answer, kForceFloor * largest_force({truth}));
    set_answer.displacement_error = push.displacement_error;
    set_answer.force_error = push.force_error;
  };
  ProgressBar bar(std::string("errors of several contacts, ") + model_name(model),
                  static_cast<int>(solved.sets.size()));
  for_each_on_threads(solved.sets.size(), jobs, measure_set, [&](int done, int) { bar.show(done); });
  for (size_t i = 0; model == PAL_MODEL_ZONE && i < survey.answers.size(); ++i) {
    const SetAnswer& set_answer = survey.answers[i];
    if (set_answer.is_flagged) continue;
    ++survey.estimated;
    survey.displacement_covered += set_answer.displacement_error <= estimates[i].displacement ? 1 : 0;
    survey.force_covered += set_answer.force_error <= estimates[i].force ? 1 : 0;
  }
  survey.table = tabulate_sets(survey.answers);
  if (model != PAL_MODEL_ZONE) survey.table.over_load = survey.table.over_reach = {};
  return survey;
}

RuntimeSurvey survey_runtime(const OpenedPack& opened, pal_model model,
                             const std::vector<SurveySample>& samples, double max_displacement, int jobs,
                             bool refines) {
  std::set<size_t> sites;
  for (const SurveySample& sample : samples) sites.insert(sample.site);
  ProgressBar bar(std::string("errors, ") + model_name(model), static_cast<int>(sites.size()));
  std::vector<MeasuredPush> pushes = measure_pushes(
      truths_of(samples), [&] { return runtime_method(opened, model, 1, 0, refines); }, jobs,
      [&](int done, int) { bar.show(done); });
  if (model != PAL_MODEL_POLYNOMIAL && model != PAL_MODEL_AFFINE)
    return survey_of(samples, pushes, max_displacement);
  const auto polynomials = opened.segment<pack::PolynomialSite>(*opened.tables().polynomial_dd()->sites());
  std::vector<SurveySample> answered;
  std::vector<MeasuredPush> measured;
  for (size_t i = 0; i < samples.size(); ++i) {
    // A site without samples belongs to affine_site, every other site to polynomial_dd.
    if ((polynomials[samples[i].site].samples == 0) != (model == PAL_MODEL_AFFINE)) continue;
    answered.push_back(samples[i]);
    measured.push_back(pushes[i]);
  }
  return survey_of(answered, measured, max_displacement);
}

}  // namespace palpate
