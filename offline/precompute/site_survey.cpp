#include "offline/precompute/site_survey.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <limits>
#include <map>
#include <optional>
#include <utility>

#include "offline/precompute/affine_site.hpp"
#include "offline/precompute/degree_choice.hpp"
#include "offline/precompute/paper_quadratic.hpp"
#include "offline/precompute/sampled_domain.hpp"
#include "offline/precompute/solver_threads.hpp"

namespace palpate {
namespace {

SurveySample solve_push(SiteSampler& sampler, const Push& push) {
  SurveySample sample;
  sample.site = push.site;
  sample.solved = sampler.solve_from_rest(push.displacement, push.increments, sample.truth);
  sample.truth.displacement = push.displacement;
  return sample;
}

// Samples x. Each failed push cuts the domain and thereby shortens the next push.
void sample_with_cuts(SampledDomain& domain, const Eigen::Vector3d& x) {
  while (!domain.sample(x)) {
  }
}

// Takes the samples of a site at points x that are common to all sites, in sequence.
class SampleSequence {
 public:
  SampleSequence(SampledDomain& domain, SamplePoints& points) : domain_(domain), points_(points) {}

  // Solves until the domain counts `num_solves` pushes, failed pushes included.
  void sample_to(size_t num_solves) {
    while (domain_.num_solves() < num_solves) next_ += domain_.sample(points_[next_]);
  }

 private:
  SampledDomain& domain_;
  SamplePoints& points_;
  size_t next_ = 0;
};

// Returns the best of all degrees, even where a degree of at most 7 keeps the target.
DegreeChoice choose_any_degree(const SiteSamples& samples) {
  return raise_degree(samples, choose_degree(samples));
}

// Spends the remaining solves of a hard site. Cuts the domain where polynomials do not fit:
//   1. before crushed samples, if no degree keeps the target,
//   2. before test samples far from the fit, taken where fits of two degrees differ most.
DegreeChoice sample_hard_site(SampledDomain& domain, const SamplingPlan& plan, SampleSequence& sequence,
                              const SiteSamples& samples) {
  constexpr size_t kTrials = 8;  // test samples, a design choice
  if (!choose_any_degree(samples).keeps(plan.target)) domain.leave_crushed();
  const bool is_tried = plan.most_samples >= domain.num_solves() + kTrials;
  sequence.sample_to(plan.most_samples - (is_tried ? kTrials : 0));
  const DegreeChoice choice = choose_any_degree(samples);
  if (is_tried && choice.degree > 1)
    domain.try_fit(fit_polynomial(samples, choice.degree), plan.target, kTrials);
  sequence.sample_to(plan.most_samples);
  return choose_any_degree(samples);
}

// Samples a site until its fit keeps the target. A site that misses the target after two thirds of its solves
// is hard. Earlier fits need `least_samples` in the domain: fewer samples give no reliable error.
SitePolynomial fit_to_target(SampledDomain& domain, const SamplingPlan& plan, SamplePoints& points,
                             const SiteSamples& samples, SiteResult& result) {
  const size_t two_thirds = std::max(plan.least_samples, (2 * plan.most_samples + 2) / 3);
  SampleSequence sequence(domain, points);
  DegreeChoice choice;
  for (size_t solves = plan.least_samples;;
       solves = std::min(two_thirds, std::max(solves + 2, solves * 5 / 4))) {
    sequence.sample_to(solves);
    if (domain.num_inside() < plan.least_samples && solves < two_thirds) continue;
    choice = choose_degree(samples);
    if (!choice.keeps(plan.target) && solves >= kUsualSamples) choice = raise_degree(samples, choice);
    if (choice.keeps(plan.target) || solves == two_thirds) break;
  }
  if (!choice.keeps(plan.target)) choice = sample_hard_site(domain, plan, sequence, samples);
  result.samples = domain.num_solves();
  result.held_out_error = choice.error;
  result.held_out_force_error = choice.force_error;
  return fit_polynomial(samples, choice.degree);
}

// Returns the Taylor series (affine_site) where two test solves keep the target, else fits to samples.
SitePolynomial fit_where_needed(SiteSampler& sampler, SampledDomain& domain, const ContactSites& sites,
                                const ContactSite& site, const SamplingPlan& plan, SamplePoints& points,
                                const SiteSamples& samples, SiteResult& result) {
  const std::optional<TaylorCoefficients> series =
      sampler.coefficients_at_rest(sites.mean_surface_edge * site.frame);
  domain.sample_rest();
  if (!series) return fit_to_target(domain, plan, points, samples, result);
  SitePolynomial unsampled = unsampled_polynomial(samples.linear, *series, samples.to_unit, samples.half);
  for (const Eigen::Vector3d& x : least_certain_points(unsampled, samples.half)) sample_with_cuts(domain, x);
  const double floor = force_floor(samples);
  SampleErrors largest = {0, 0};
  for (size_t i = 1; i < samples.samples.size(); ++i) {
    const SampleErrors errors = errors_of(unsampled, samples.samples[i], floor);
    largest.displacement = std::max(largest.displacement, errors.displacement);
    largest.force = std::max(largest.force, errors.force);
  }
  if (domain.cut_by() != PushOutcome::solved || largest.larger() > plan.target)
    return fit_to_target(domain, plan, points, samples, result);
  result.held_out_error = largest.displacement;
  result.held_out_force_error = largest.force;
  return unsampled;
}

SitePolynomial fit_as_paper(SampledDomain& domain, const Scene& scene, const Eigen::Vector3d& inward,
                            const SiteSamples& samples, SiteResult& result) {
  const std::vector<Eigen::Vector3d> points =
      scene.polynomial_method == PolynomialMethod::paper_grid
          ? grid_points(samples.half)
          : ray_points(scene.max_displacement * samples.to_unit * inward);
  for (const Eigen::Vector3d& x : points) sample_with_cuts(domain, x);
  result.samples = domain.num_solves();
  return fit_paper_quadratic(samples);
}

// Draws the survey points of a site. The label is the seed: new sites do not change the directions at other
// sites. The index shifts the turns of the quarters: sites with few pushes together cover all quarters.
std::vector<Eigen::Vector3d> survey_points(const Scene& scene, const SamplingPlan& plan, size_t index,
                                           int label, int count) {
  return choose_survey_points(count, scene.directions == Directions::inward,
                              static_cast<std::uint64_t>(label),
                              index * static_cast<size_t>(plan.survey_samples));
}

// Adds the missing pushes of these points to the survey of a site.
void survey_site(SiteSampler& sampler, size_t index, const std::vector<Eigen::Vector3d>& points,
                 const Eigen::Matrix3d& to_unit, SiteResult& result) {
  for (size_t i = result.survey.size(); i < points.size(); ++i) {
    const Eigen::Vector3d displacement = to_unit.inverse() * points[i];
    result.survey.push_back(solve_push(sampler, {index, displacement, survey_increments(points[i].norm())}));
    result.unsolved += !result.survey.back().solved;
  }
}

SiteResult sample_site(StaticSolver& solver, const Scene& scene, const ContactSites& sites, size_t index,
                       const LinearDd& linear, const SamplingPlan& plan, SamplePoints& points,
                       const RestState& rest, const SampleStore* store) {
  const ContactSite& site = sites.sites[index];
  const int label = solver.assembly().model().labels[static_cast<size_t>(site.node)];
  SiteSamples samples;
  samples.half = scene.directions == Directions::inward;
  samples.to_unit = site.frame.transpose() / scene.max_displacement;
  std::optional<SampleFile> kept;
  if (store != nullptr) kept.emplace(store->file_of(label), store->binding_of(label));
  SiteSampler sampler(solver, sites, site, rest, kept ? &*kept : nullptr);
  SiteResult result;
  if (scene.polynomial) {
    samples.linear = linear.field_compliance.size() > 0 ? linear_response(linear, site)
                                                        : linear_response(solver, sites, site, rest);
    SampledDomain domain(sampler, scene, site, label, samples);
    const auto fit_site = [&] {
      if (scene.polynomial_method != PolynomialMethod::hermite)
        return fit_as_paper(domain, scene, site.inward, samples, result);
      if (plan.fewest) return fit_where_needed(sampler, domain, sites, site, plan, points, samples, result);
      domain.sample_rest();
      return fit_to_target(domain, plan, points, samples, result);
    };
    try {
      const SitePolynomial fit = fit_site();
      result.polynomial = reduce_basis(fit, samples.half, kBasisPart * plan.target, plan.rounded);
    } catch (const DomainTooSmall& failure) {
      result.out_of_reach = failure.out_of_reach();
      result.counts = sampler.counts();
      return result;
    }
    result.cut_by = domain.cut_by();
    result.min_jacobian = domain.min_jacobian();
  }
  // Sampled sites are few with `fewest`: each then gets a push in each quarter of the range.
  const int survey_samples =
      plan.fewest && result.samples > 0 ? std::max(4, plan.survey_samples) : plan.survey_samples;
  survey_site(sampler, index, survey_points(scene, plan, index, label, survey_samples), samples.to_unit,
              result);
  result.counts = sampler.counts();
  return result;
}

// Adds survey pushes at the sampled sites up to a total of SamplingPlan::least_survey.
void survey_further(const Assembly& assembly, const Scene& scene, const ContactSites& sites,
                    const SamplingPlan& plan, const RestState& rest, const SampleStore* store,
                    std::vector<SiteResult>& results) {
  std::vector<size_t> sampled;
  int pushes = 0;
  for (size_t index = 0; index < results.size(); ++index) {
    if (results[index].samples == 0) continue;
    sampled.push_back(index);
    pushes += static_cast<int>(results[index].survey.size());
  }
  if (sampled.empty() || pushes >= plan.least_survey) return;
  const int quarters = 4 * static_cast<int>(sampled.size());
  const int count = 4 * ((plan.least_survey + quarters - 1) / quarters);
  for_each_on_threads(assembly, sampled.size(), plan.jobs,
                      [&](StaticSolver& solver, size_t i) {
                        const size_t index = sampled[i];
                        const ContactSite& site = sites.sites[index];
                        const int label = assembly.model().labels[static_cast<size_t>(site.node)];
                        std::optional<SampleFile> kept;
                        if (store != nullptr) kept.emplace(store->file_of(label), store->binding_of(label));
                        SiteSampler sampler(solver, sites, site, rest, kept ? &*kept : nullptr);
                        SiteResult& result = results[index];
                        survey_site(sampler, index, survey_points(scene, plan, index, label, count),
                                    result.polynomial.to_unit, result);
                        result.counts += sampler.counts();
                      },
                      {});
}

}  // namespace

std::vector<SurveySample> solve_pushes(const Assembly& assembly, const ContactSites& sites,
                                       const std::vector<Push>& pushes, int jobs,
                                       const std::function<void(int, int)>& progress, const RestState& rest) {
  std::map<size_t, std::vector<size_t>> by_site;
  for (size_t i = 0; i < pushes.size(); ++i) by_site[pushes[i].site].push_back(i);
  const std::vector<std::pair<size_t, std::vector<size_t>>> groups(by_site.begin(), by_site.end());
  std::vector<SurveySample> samples(pushes.size());
  for_each_on_threads(
      assembly, groups.size(), jobs,
      [&](StaticSolver& solver, size_t group) {
        const auto& [site, members] = groups[group];
        SiteSampler sampler(solver, sites, sites.sites[site], rest);
        for (const size_t i : members) samples[i] = solve_push(sampler, pushes[i]);
      },
      progress);
  return samples;
}

std::vector<size_t> spread_sites(const Model& model, const ContactSites& sites, size_t count) {
  const auto position = [&](size_t site) -> const Eigen::Vector3d& {
    return model.positions[static_cast<size_t>(sites.sites[site].node)];
  };
  std::vector<double> distances(sites.sites.size(), std::numeric_limits<double>::infinity());
  std::vector<size_t> chosen;
  for (size_t next = 0; chosen.size() < std::min(count, distances.size());) {
    chosen.push_back(next);
    for (size_t site = 0; site < distances.size(); ++site)
      distances[site] = std::min(distances[site], (position(site) - position(next)).squaredNorm());
    distances[next] = -1;  // chosen; 0 is an unchosen site at the same place
    next = static_cast<size_t>(std::max_element(distances.begin(), distances.end()) - distances.begin());
  }
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

size_t num_sampled(const std::vector<SiteResult>& results) {
  return static_cast<size_t>(
      std::count_if(results.begin(), results.end(), [](const SiteResult& site) { return site.samples > 0; }));
}

SolveCounts sum_of_counts(const std::vector<SiteResult>& results) {
  SolveCounts sum;
  for (const SiteResult& result : results) sum += result.counts;
  return sum;
}

std::vector<SiteResult> sample_sites(const Assembly& assembly, const Scene& scene, const ContactSites& sites,
                                     const LinearDd& linear, const SamplingPlan& plan,
                                     const std::function<void(int, int)>& progress, const RestState& rest,
                                     const SampleStore* store, const std::function<size_t()>& next) {
  SamplePoints points(scene.directions == Directions::inward);
  std::vector<SiteResult> results(sites.sites.size());
  const size_t num_surveyed =
      plan.survey_sites > 0 ? static_cast<size_t>(plan.survey_sites) : sites.sites.size();
  const std::vector<size_t> surveyed = spread_sites(assembly.model(), sites, num_surveyed);
  for_each_on_threads(
      assembly, surveyed.size(), plan.jobs,
      [&](StaticSolver& solver, size_t i) {
        results[surveyed[i]] =
            sample_site(solver, scene, sites, surveyed[i], linear, plan, points, rest, store);
      },
      progress, next);
  const bool has_all = !next;
  if (plan.fewest && has_all) survey_further(assembly, scene, sites, plan, rest, store, results);
  return results;
}

}  // namespace palpate
