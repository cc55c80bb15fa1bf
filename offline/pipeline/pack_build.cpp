#include "offline/pipeline/pack_build.hpp"

#include <algorithm>
#include <chrono>
#include <functional>
#include <stdexcept>
#include <utility>

#include "offline/output/progress_bar.hpp"
#include "offline/pipeline/build_plan.hpp"
#include "offline/pipeline/compliance_errors.hpp"
#include "offline/pipeline/opened_pack.hpp"
#include "offline/pipeline/runtime_survey.hpp"

namespace palpate {
namespace {

constexpr int kBarSteps = 1000;  // of a progress bar: more than the columns of any terminal

Compliance compute_compliance(const Assembly& assembly, const Scene& scene, const ContactSites& sites,
                              const RestState& rest, int jobs) {
  Compliance compliance;
  if (is_to_be_compressed(scene, sites)) {
    const Assembly threaded(assembly.model(), assembly.model().fixed_dofs(), jobs);
    ProgressBar bar("linear_dd", kBarSteps);
    const auto show = [&](int done, int total) {
      bar.show(static_cast<int>(std::int64_t{done} * kBarSteps / total));
    };
    compliance.compressed = compress_linear_dd(threaded, sites, compliance_tolerance(scene), show, rest);
  } else if (is_dense_at_hand(scene, sites)) {
    ProgressBar bar("linear_dd", static_cast<int>(3 * sites.contact_nodes.size()));
    compliance.dense = compute_linear_dd(
        assembly, sites, [&](int done, int) { bar.show(done); }, rest);
  }
  return compliance;
}

PackContent content_of(const Model& model, const Scene& scene, const ContactSites& sites,
                       const RestState& rest, const SamplingPlan& plan, const Compliance& compliance,
                       const std::vector<SiteResult>& results, const std::optional<ZoneTables>& zone,
                       std::vector<InputFile> inputs) {
  PackContent content{model, scene, sites, nullptr, nullptr, plan.rounded, std::move(inputs), {}};
  content.rest = &rest;
  if (compliance.compressed) content.compressed = &*compliance.compressed;
  if (has_compliance(scene) && !compliance.compressed) content.linear = &compliance.dense;
  if (scene.polynomial) content.polynomials = &results;
  if (zone) content.zone = &*zone;
  return content;
}

// Measures the errors of the real runtime on a pack that lacks only its surveys.
std::vector<ModelSurvey> survey_models(const PackContent& content, const std::vector<SiteResult>& results,
                                       const SolvedSets& sets, int jobs) {
  std::vector<SurveySample> samples;
  for (const SiteResult& result : results)
    samples.insert(samples.end(), result.survey.begin(), result.survey.end());
  if (samples.empty()) return {};
  const AlignedBytes bytes = write_pack(content);
  const OpenedPack opened(bytes);
  std::vector<ModelSurvey> surveys;
  const auto survey = [&](SurveyedModel name, pal_model model, bool refines = true) {
    surveys.push_back(
        {name, survey_runtime(opened, model, samples, content.scene.max_displacement, jobs, refines).table});
    if (answers_sets(model) && !sets.sets.empty())
      surveys.back().sets = survey_runtime_sets(opened, model, sets, jobs, refines).table;
  };
  if (content.has_linear()) survey(SurveyedModel::linear_dd, PAL_MODEL_LINEAR);
  if (content.zone != nullptr) {
    survey(SurveyedModel::unrefined_zone, PAL_MODEL_ZONE, false);
    survey(SurveyedModel::nonlinear_zone, PAL_MODEL_ZONE);
  }
  if (content.polynomials != nullptr) {
    const auto sampled = num_sampled(results);
    if (sampled > 0) survey(SurveyedModel::polynomial_dd, PAL_MODEL_POLYNOMIAL);
    if (sampled < results.size()) survey(SurveyedModel::affine_site, PAL_MODEL_AFFINE);
  }
  return surveys;
}

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

// Shares the sites or contact sets of a build among the ranks. Returns summed counts on the first rank.
SolveCounts share(Ranks& ranks, size_t count, const std::function<SolveCounts(RankQueue&)>& work) {
  SolveCounts counts;
  {
    RankQueue queue(ranks, count);
    counts = work(queue);
  }
  for (long* number :
       {&counts.reused, &counts.solves, &counts.not_kept, &counts.iterations, &counts.factorizations})
    *number = ranks.sum(*number);
  ranks.wait_for_all();
  return counts;
}

// Lists the sites that could not be sampled. Throws std::runtime_error where these are all sites.
std::vector<LeftOutSite> unsampled_sites(const BuildInputs& from, const std::vector<SiteResult>& results) {
  std::vector<LeftOutSite> unsampled;
  for (size_t i = 0; i < results.size(); ++i) {
    if (results[i].out_of_reach > 0) unsampled.push_back({from.sites.sites[i].node, results[i].out_of_reach});
  }
  if (unsampled.size() == results.size())
    throw std::runtime_error(left_out_text(from.scene, from.assembly.model(), unsampled, 0));
  return unsampled;
}

// Samples the sites and solves the contact sets on all ranks. The first rank collects the results from the
// store, solves the missing samples and sets, and returns true. The other ranks return false.
bool solve_all(const BuildInputs& from, Ranks* ranks, PackBuild& build) {
  const size_t num_sites = num_worked(from.plan, from.sites);
  const auto sample = [&](const std::function<int(int)>& shown, const std::function<size_t()>& next) {
    ProgressBar bar("sampling sites", static_cast<int>(num_sites));
    build.results = sample_sites(
        from.assembly, from.scene, from.sites, build.compliance.dense, from.plan,
        [&](int done, int) { bar.show(shown(done)); }, from.rest, from.store, next);
    return sum_of_counts(build.results);
  };
  const auto solve_sets = [&](const std::function<size_t()>& next) {
    build.sets =
        solve_surveyed_sets(from.assembly, from.scene, from.sites, from.rest, from.plan, from.store, next);
    return build.sets.counts;
  };
  const bool is_shared = ranks != nullptr && ranks->count() > 1;
  if (is_shared) {
    build.counts = share(*ranks, num_sites, [&](RankQueue& queue) {
      return sample([&](int) { return static_cast<int>(queue.handed_out()); }, [&] { return queue.next(); });
    });
    const size_t num_sets = surveyed_sets(from.assembly.model(), from.scene, from.sites, from.plan).size();
    if (num_sets > 0) {
      build.counts +=
          share(*ranks, num_sets, [&](RankQueue& queue) { return solve_sets([&] { return queue.next(); }); });
    }
    if (!ranks->is_first()) return false;
  }
  SolveCounts counts = sample([](int done) { return done; }, {});
  build.left_out = unsampled_sites(from, build.results);
  counts += solve_sets({});
  if (is_shared) counts.reused = counts.not_kept = 0;  // share() has counted the reused and unkept solves
  build.counts += counts;
  return true;
}

// Leaves out the sites that could not be sampled, and the contact sets that hold them. Their nodes remain
// contact nodes, as the compliance has them.
void leave_out_unsampled(const BuildInputs& from, PackBuild& build) {
  build.sites = from.sites;
  std::vector<std::optional<size_t>> place(build.results.size());  // in the pack
  std::vector<ContactSite> sites;
  std::vector<SiteResult> results;
  for (size_t i = 0; i < build.results.size(); ++i) {
    SiteResult& result = build.results[i];
    if (result.out_of_reach > 0) continue;
    place[i] = sites.size();
    for (SurveySample& sample : result.survey) sample.site = sites.size();
    sites.push_back(from.sites.sites[i]);
    results.push_back(std::move(result));
  }
  build.sites.sites = std::move(sites);
  build.results = std::move(results);
  build.sites.left_out.insert(build.sites.left_out.end(), build.left_out.begin(), build.left_out.end());
  SolvedSets sets;
  sets.counts = build.sets.counts;
  const auto is_kept = [&](const LinearContact& contact) { return place[contact.site].has_value(); };
  for (size_t i = 0; i < build.sets.sets.size(); ++i) {
    ContactSet& set = build.sets.sets[i];
    if (!std::ranges::all_of(set.contacts, is_kept)) continue;
    for (auto* contacts : {&set.contacts, &build.sets.truths[i].contacts}) {
      for (LinearContact& contact : *contacts) contact.site = *place[contact.site];
    }
    sets.sets.push_back(std::move(set));
    sets.truths.push_back(std::move(build.sets.truths[i]));
  }
  build.sets = std::move(sets);
}

}  // namespace

std::unique_ptr<PackBuild> build_pack(const BuildInputs& from, std::vector<InputFile> input_files,
                                      Ranks* ranks) {
  auto build = std::make_unique<PackBuild>();
  const bool is_first = ranks == nullptr || ranks->is_first();
  // The ranks take the linear parts of their fits from the dense compliance. Compression is too inexact.
  if (is_first || is_dense_at_hand(from.scene, from.sites))
    build->compliance = compute_compliance(from.assembly, from.scene, from.sites, from.rest, from.plan.jobs);
  const auto start = std::chrono::steady_clock::now();
  if (!solve_all(from, ranks, *build)) return nullptr;
  build->sampling_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  leave_out_unsampled(from, *build);
  build->zone = plan_zone(from.assembly.model(), from.scene, build->sites);
  build->content.emplace(content_of(from.assembly.model(), from.scene, build->sites, from.rest, from.plan,
                                    build->compliance, build->results, build->zone, std::move(input_files)));
  build->bytes.emplace(write_surveyed_pack(from.assembly, from.rest, build->results, build->sets,
                                           from.plan.jobs, build->compliance, *build->content));
  return build;
}

}  // namespace palpate
