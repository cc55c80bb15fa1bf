#include "offline/cli/pack_stages.hpp"

#include <utility>

#include "offline/cli/build_plan.hpp"
#include "offline/cli/compliance_errors.hpp"
#include "offline/cli/opened_pack.hpp"
#include "offline/cli/progress_bar.hpp"
#include "offline/cli/runtime_survey.hpp"
#include "offline/precompute/zone_exterior.hpp"
#include "offline/precompute/zone_mutual.hpp"

namespace palpate {

Compliance compute_compliance(const Assembly& assembly, const Scene& scene, const ContactSites& sites,
                              const RestState& rest, int jobs) {
  Compliance compliance;
  if (is_to_be_compressed(scene, sites)) {
    const Assembly threaded(assembly.model(), assembly.model().fixed_dofs(), jobs);
    constexpr int kSteps = 1000;
    ProgressBar bar("linear_dd", kSteps);
    const auto show = [&](int done, int total) {
      bar.show(static_cast<int>(std::int64_t{done} * kSteps / total));
    };
    compliance.compressed = compress_linear_dd(threaded, sites, kComplianceTolerance, show, rest);
  } else if (is_dense_at_hand(scene, sites)) {
    ProgressBar bar("linear_dd", static_cast<int>(3 * sites.contact_nodes.size()));
    compliance.dense = compute_linear_dd(
        assembly, sites, [&](int done, int) { bar.show(done); }, rest);
  }
  return compliance;
}

void compute_zone(const Assembly& assembly, const Scene& scene, const ContactSites& sites,
                  const RestState& rest, int jobs, ZoneTables& zone) {
  {
    ProgressBar bar("width of zones", static_cast<int>(sites.sites.size()));
    zone = widen_zones(
        assembly, scene, sites, rest, jobs, [&](int done) { bar.show(done); }, zone);
  }
  {
    ProgressBar bar("compliance of zones",
                    3 * (zone.num_free - static_cast<int>(sites.contact_nodes.size())));
    compute_zone_compliance(
        assembly, sites, rest, [&](int done, int) { bar.show(done); }, zone);
  }
  ProgressBar bar("outside of zones", static_cast<int>(sites.sites.size()));
  compute_zone_exterior(
      assembly, sites, rest, scene.max_displacement, jobs, [&](int done) { bar.show(done); }, zone);
  if (zone.num_pairs > 0) {
    constexpr int kSteps = 1000;
    ProgressBar pairs("pairs of contacts", kSteps);
    compute_zone_mutual(
        assembly, scene, sites, rest, jobs, [&](double part) { pairs.show(static_cast<int>(part * kSteps)); },
        zone);
  }
}

PackContent content_of(const Model& model, const Scene& scene, const ContactSites& sites,
                       const RestState& rest, const SamplingPlan& plan, const Compliance& compliance,
                       const std::vector<SiteResult>& results, const std::optional<ZoneTables>& zone,
                       std::vector<InputFile> inputs) {
  PackContent content{model, scene, sites, nullptr, nullptr, plan.rounded, std::move(inputs), {}};
  content.rest = &rest;
  if (compliance.compressed) content.compressed = &*compliance.compressed;
  if (scene.linear && !compliance.compressed) content.linear = &compliance.dense;
  if (scene.polynomial) content.polynomials = &results;
  if (zone) content.zone = &*zone;
  return content;
}

namespace {

// The errors of the real runtime on a pack that is complete but for them.
std::vector<ModelSurvey> survey_models(const PackContent& content, const std::vector<SiteResult>& results,
                                       const SolvedSets& sets, int jobs) {
  const AlignedBytes bytes = write_pack(content);
  const OpenedPack opened(bytes);
  std::vector<SurveySample> samples;
  for (const SiteResult& result : results)
    samples.insert(samples.end(), result.survey.begin(), result.survey.end());
  std::vector<ModelSurvey> surveys;
  const auto survey = [&](SurveyedModel name, pal_model model) {
    surveys.push_back(
        {name, survey_runtime(opened, model, samples, content.scene.max_displacement, jobs).table});
    if (answers_sets(model) && !sets.sets.empty())
      surveys.back().sets = survey_runtime_sets(opened, model, sets, jobs).table;
  };
  if (content.has_linear()) survey(SurveyedModel::linear_dd, PAL_MODEL_LINEAR);
  if (content.zone != nullptr) survey(SurveyedModel::nonlinear_zone, PAL_MODEL_ZONE);
  if (content.polynomials != nullptr) {
    const auto sampled = num_sampled(results);
    if (sampled > 0) survey(SurveyedModel::polynomial_dd, PAL_MODEL_POLYNOMIAL);
    if (sampled < results.size()) survey(SurveyedModel::affine_site, PAL_MODEL_AFFINE);
  }
  return surveys;
}

}  // namespace

SolvedSets solve_surveyed_sets(const Assembly& assembly, const Scene& scene, const ContactSites& sites,
                               const RestState& rest, const SamplingPlan& plan, const SampleStore* store,
                               const std::function<size_t()>& next) {
  std::vector<ContactSet> sets = surveyed_sets(assembly.model(), scene, sites, plan);
  if (sets.empty()) return {};
  ProgressBar bar("several contacts", static_cast<int>(sets.size()));
  return solve_drawn_sets(
      assembly, sites, rest, std::move(sets), plan.jobs, store, [&](int done, int) { bar.show(done); }, next);
}

AlignedBytes write_surveyed_pack(const Assembly& assembly, const RestState& rest,
                                 const std::vector<SiteResult>& results, const SolvedSets& sets, int jobs,
                                 Compliance& compliance, PackContent& content) {
  content.surveys = survey_models(content, results, sets, jobs);
  if (compliance.compressed) {
    const AlignedBytes measured = write_pack(content);
    const ComplianceErrors errors =
        measure_compliance(OpenedPack(measured), assembly, content.sites, rest, content.scene.max_contacts);
    compliance.compressed->displacement_error = errors.displacement;
    compliance.compressed->force_error = errors.force;
    compliance.compressed->samples = errors.samples;
  }
  return write_pack(content);
}

AlignedBytes make_pack(const Assembly& assembly, const Scene& scene, const ContactSites& sites,
                       const RestState& rest, const SamplingPlan& plan, const SampleStore* store,
                       std::vector<InputFile> inputs) {
  Compliance compliance = compute_compliance(assembly, scene, sites, rest, plan.jobs);
  std::vector<SiteResult> results;
  {
    ProgressBar bar("sampling sites", static_cast<int>(num_worked(plan, sites)));
    results = sample_sites(
        assembly, scene, sites, compliance.dense, plan, [&](int done, int) { bar.show(done); }, rest, store);
  }
  const SolvedSets sets = solve_surveyed_sets(assembly, scene, sites, rest, plan, store);
  std::optional<ZoneTables> zone = plan_zone(assembly.model(), scene, sites);
  if (zone) compute_zone(assembly, scene, sites, rest, plan.jobs, *zone);
  PackContent content =
      content_of(assembly.model(), scene, sites, rest, plan, compliance, results, zone, std::move(inputs));
  return write_surveyed_pack(assembly, rest, results, sets, plan.jobs, compliance, content);
}

}  // namespace palpate
