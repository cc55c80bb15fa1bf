#include "offline/precompute/site_survey.hpp"

#include <fmt/core.h>

#include <Eigen/LU>
#include <Eigen/SVD>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <stdexcept>
#include <utility>

#include "offline/precompute/affine_site.hpp"
#include "offline/precompute/paper_quadratic.hpp"
#include "offline/precompute/solver_threads.hpp"
#include "schemas/monomials.hpp"
#include "schemas/pack_layout.hpp"

namespace palpate {
namespace {

constexpr double kShrink = 0.7;  // of the domain along a displacement that cannot be had, at the least
constexpr double kSmallestReach = 0.25;  // of the scene's largest displacement

SurveySample solve_push(SiteSampler& sampler, const Push& push) {
  SurveySample sample;
  sample.site = push.site;
  sample.solved = sampler.solve_from_rest(push.displacement, push.increments, sample.truth);
  sample.truth.displacement = push.displacement;
  return sample;
}

// Of an error that more samples will not mend.
bool is_far_off(double error, double target) {
  constexpr double kFarOff = 0.01;
  return error > std::max(kFarOff, 2 * target);
}

// A degree, and how wrong its fit is on samples that it was not given.
struct DegreeChoice {
  int degree = 1;
  double error = std::numeric_limits<double>::infinity();
  double force_error = error;
  double error_inside = error;  // HeldOutError::inside of the displacement

  // Where a tip crushes tissue against fixed nodes the force is the harder of the two.
  bool keeps(double target) const { return std::max(error, force_error) <= target; }
  // Well inside of the domain: what a fit says of a sample at its edge, without it, is worse than it is.
  bool is_far_off(double target) const { return palpate::is_far_off(error_inside, target); }
};

// Where so many solves do not keep the target by polynomials of the usual degree, higher ones are tried: a frame rather
// takes longer than a build.
constexpr size_t kUsualSamples = 60;
constexpr int kUsualDegree = 7;

// Whether there are equations to spare for each term.
bool is_borne(const SiteSamples& samples, int degree) {
  constexpr double kToSpare = 1.2;
  return kEquationsPerSample * static_cast<double>(samples.samples.size() - 1) >=
         kToSpare * pack::num_monomials(2, static_cast<uint32_t>(degree));
}

// The usual degree that does best. Errors fall with the degree until the samples no longer bear it, so that only the
// highest few come into question.
DegreeChoice choose_degree(const SiteSamples& samples) {
  constexpr int kTried = 3;
  DegreeChoice best;
  int tried = 0;
  for (int degree = kUsualDegree; degree > 1 && tried < kTried; --degree) {
    if (!is_borne(samples, degree)) continue;
    const HeldOutError error = held_out_error(samples, degree);
    if (error.all < best.error) best = {degree, error.all, error.all, error.inside};
    if (std::isfinite(error.all)) ++tried;
  }
  if (best.degree > 1) best.force_error = held_out_force_error(samples, best.degree).all;
  return best;
}

// Higher ones, which take a frame longer, where they do better. Of their errors those inside count, for the reason that
// HeldOutError has.
DegreeChoice raise_degree(const SiteSamples& samples, DegreeChoice best) {
  for (int degree = kUsualDegree + 1; degree <= highest_fit_degree(samples.half) && is_borne(samples, degree);
       ++degree) {
    const HeldOutError error = held_out_error(samples, degree);
    if (error.inside < best.error_inside)
      best = {degree, error.inside, held_out_force_error(samples, degree).inside, error.inside};
  }
  return best;
}

// Of a displacement that cannot be had: where it nearly inverts an element, to what part its smallest det F is that of a
// sample; else that is 1, and kShrink is kept. Along a ray from rest it falls as exp(-c t^2), or nearly: at a site of the
// brain 0.51, 0.29 and 0.14 at 0.6, 0.8 and 1 (c = 1.9 to 2.0).
double part_to_keep(double min_jacobian, double least) {
  constexpr double kMost = 0.97;
  if (!(min_jacobian > 0 && min_jacobian < least)) return kShrink;
  return std::clamp(std::sqrt(std::log(1.1 * least) / std::log(min_jacobian)), kShrink, kMost);
}

// Of a displacement that a fit is so wrong at: beside |d| its remainder grows as t^degree.
double part_to_keep(double error, double target, int degree) {
  constexpr double kMost = 0.97;
  return std::clamp(std::pow(target / error, 1.0 / degree), kShrink, kMost);
}

// Shortens the ellipsoid |A d| <= 1 to a part of what it is, or of what leaves x = A d outside. Of a half, the
// displacements inward of the surface stay those with x_3 >= 0: d . n = (A^-T n) . x.
void shorten(const Eigen::Vector3d& x, double part, const Eigen::Vector3d& inward, SiteSamples& samples) {
  const Eigen::Vector3d along = x.normalized();
  const double factor = 1 / (part * std::min(1.0, x.norm()));
  Eigen::Matrix3d& A = samples.to_unit;
  A += (factor - 1) * along * (along.transpose() * A);
  if (samples.half) A = frame_about((A.inverse().transpose() * inward).normalized()).transpose() * A;
}

// A polynomial's errors at a sample, as the survey has them; the force's floored at 5 % of `largest_force`.
std::pair<double, double> errors_at(const SitePolynomial& polynomial, const Sample& sample,
                                    double largest_force) {
  constexpr double kFloor = 0.05;
  const Eigen::VectorXd wrong = field_at(polynomial, sample.displacement) - sample.field;
  const Eigen::Vector3d force = force_at(polynomial, sample.displacement);
  return {wrong.reshaped(3, wrong.size() / 3).colwise().norm().maxCoeff() / sample.displacement.norm(),
          (force - sample.force).norm() / std::max(sample.force.norm(), kFloor * largest_force)};
}

// The largest displacements of a site for which there is a sample, and how they are asked for one by one.
class SiteDomain {
 public:
  SiteDomain(SiteSampler& sampler, const Scene& scene, const ContactSite& site, int label,
             SiteSamples& samples, SiteResult& result)
      : sampler_(sampler), scene_(scene), site_(site), label_(label), samples_(samples), result_(result) {}

  // Adds what is known at rest.
  void sample_rest() {
    Sample rest;
    if (sampler_.solve(Eigen::Vector3d::Zero(), rest) != PushOutcome::solved)
      throw std::logic_error("there is no state of rest");
    samples_.samples.push_back(std::move(rest));
  }

  // Adds a sample at x = A d, shortening the domain until there is one to be had.
  void sample(const Eigen::Vector3d& x) {
    while (!is_sampled(x)) {
    }
  }

  // Gives up the samples below kFollowedJacobian: the domain ends before them, and they are no longer fitted to. Returns
  // their number; none where too little of the domain would be left.
  size_t leave_crushed() {
    std::vector<Sample>& samples = samples_.samples;
    const auto is_followed = [](const Sample& sample) { return sample.min_jacobian >= kFollowedJacobian; };
    std::vector<Part> parts;
    for (const Sample& sample : samples) {
      if (!is_followed(sample))
        parts.push_back({sample.displacement, part_to_keep(sample.min_jacobian, kFollowedJacobian)});
    }
    if (!keep_only(parts)) return 0;
    least_ = kFollowedJacobian;
    samples.erase(std::stable_partition(samples.begin(), samples.end(), is_followed), samples.end());
    result_.samples -= parts.size();
    result_.min_jacobian = 1;
    for (const Sample& one : samples) result_.min_jacobian = std::min(result_.min_jacobian, one.min_jacobian);
    return parts.size();
  }

  // Ends the domain before the pushes of the survey that `fit` is far off from. False where there are none, or too little of
  // it would be left.
  bool leave_far_off(const SitePolynomial& fit, double target) {
    double largest_force = 0;
    for (const Sample& sample : samples_.samples)
      largest_force = std::max(largest_force, sample.force.norm());
    std::vector<Part> parts;
    for (const SurveySample& push : result_.survey) {
      double error = 1;
      if (push.solved) {
        const auto [displacement, force] = errors_at(fit, push.truth, largest_force);
        error = std::max(displacement, force);
      }
      if (is_far_off(error, target))
        parts.push_back({push.truth.displacement, part_to_keep(error, target, fit.degree)});
    }
    return !parts.empty() && keep_only(parts);
  }

 private:
  bool is_sampled(const Eigen::Vector3d& x) {
    Sample sample;
    const Eigen::Vector3d displacement = samples_.to_unit.inverse() * x;
    PushOutcome outcome = sampler_.solve(displacement, sample);
    if (outcome == PushOutcome::solved && sample.min_jacobian < least_)
      outcome = PushOutcome::nearly_inverted;
    if (outcome == PushOutcome::solved) {
      result_.min_jacobian = std::min(result_.min_jacobian, sample.min_jacobian);
      samples_.samples.push_back(std::move(sample));
      ++result_.samples;
      return true;
    }
    cut(x, part_to_keep(sample.min_jacobian, least_), outcome, displacement.norm());
    return false;
  }

  void cut(const Eigen::Vector3d& x, double part, PushOutcome outcome, double size) {
    result_.cut_by = outcome;
    shorten(x, part, site_.inward, samples_);
    if (is_too_small()) {
      throw std::runtime_error(
          fmt::format("{}: {} for a push of {:.3g} at node {}, though max_displacement is {:.3g}; reduce "
                      "max_displacement, or raise tip_radius",
                      scene_.file.string(), words_for(outcome), size, label_, scene_.max_displacement));
    }
  }

  // How much of a displacement is to be had.
  struct Part {
    Eigen::Vector3d displacement;
    double part;
  };

  // Shortens the domain to these parts; leaves it as it was, and returns false, where it would be too small.
  bool keep_only(const std::vector<Part>& parts) {
    const Eigen::Matrix3d before = samples_.to_unit;
    for (const auto& [displacement, part] : parts) {
      const Eigen::Vector3d x = samples_.to_unit * displacement;
      const double kept = part * std::max(1.0, x.norm());
      if (kept < 1) shorten(x, kept, site_.inward, samples_);
    }
    if (is_too_small()) {
      samples_.to_unit = before;
      return false;
    }
    if (samples_.to_unit != before) result_.cut_by = PushOutcome::not_followed;
    return true;
  }

  bool is_too_small() const {
    return least_reach(samples_.to_unit) < kSmallestReach * scene_.max_displacement;
  }

  SiteSampler& sampler_;
  const Scene& scene_;
  const ContactSite& site_;
  int label_;
  SiteSamples& samples_;
  SiteResult& result_;
  double least_ = kLeastSampledJacobian;  // det F of a sample
};

SitePolynomial fit_of(const DegreeChoice& choice, const SiteSamples& samples, SiteResult& result) {
  result.held_out_error = choice.error;
  result.held_out_force_error = choice.force_error;
  return fit_polynomial(samples, choice.degree);
}

// Samples a site until its fit keeps the target, and fits it.
SitePolynomial fit_to_target(SiteDomain& domain, const SamplingPlan& plan, SamplePoints& points,
                             const SiteSamples& samples, SiteResult& result) {
  size_t next = 0;
  size_t most = plan.most_samples;
  bool is_doubted = false;
  for (size_t wanted = plan.least_samples;; wanted = std::min(most, std::max(wanted + 2, wanted * 5 / 4))) {
    while (result.samples < wanted) domain.sample(points[next++]);
    DegreeChoice choice = choose_degree(samples);
    // With two thirds of the solves it is far off: the rest will not do what fewer crushed samples may.
    if (!is_doubted && 3 * wanted >= 2 * plan.most_samples && choice.is_far_off(plan.target)) {
      is_doubted = true;
      const size_t num_left = domain.leave_crushed();
      most -= num_left;
      if (num_left > 0) continue;
    }
    const bool is_last = wanted == most;
    if ((is_last || wanted >= kUsualSamples) && !choice.keeps(plan.target))
      choice = raise_degree(samples, choice);
    if (is_last || choice.keeps(plan.target)) return fit_of(choice, samples, result);
  }
}

// affine_site, where the site's derivatives at rest keep the target at the solves where they are least certain to; else these
// are the first samples of a fit.
SitePolynomial fit_where_needed(SiteSampler& sampler, SiteDomain& domain, const ContactSites& sites,
                                const ContactSite& site, const SamplingPlan& plan, SamplePoints& points,
                                const SiteSamples& samples, SiteResult& result) {
  const std::optional<RestSeries> series = sampler.rest_series(sites.mean_surface_edge * site.frame);
  domain.sample_rest();
  if (!series) return fit_to_target(domain, plan, points, samples, result);
  const SitePolynomial unsampled =
      unsampled_polynomial(samples.linear, *series, samples.to_unit, samples.half);
  for (const Eigen::Vector3d& x : least_certain_points(unsampled, samples.half)) domain.sample(x);
  double largest_force = 0;
  for (const Sample& sample : samples.samples) largest_force = std::max(largest_force, sample.force.norm());
  for (size_t i = 1; i < samples.samples.size(); ++i) {
    const auto [displacement, force] = errors_at(unsampled, samples.samples[i], largest_force);
    result.held_out_error = std::max(result.held_out_error, displacement);
    result.held_out_force_error = std::max(result.held_out_force_error, force);
  }
  const bool is_kept = result.held_out_error <= plan.target && result.held_out_force_error <= plan.target;
  if (result.cut_by != PushOutcome::solved || !is_kept)
    return fit_to_target(domain, plan, points, samples, result);
  result.samples = 0;
  return unsampled;
}

SitePolynomial fit_as_paper(SiteDomain& domain, const Scene& scene, const Eigen::Vector3d& inward,
                            const SiteSamples& samples) {
  const std::vector<Eigen::Vector3d> points =
      scene.polynomial_method == PolynomialMethod::paper_grid
          ? grid_points(samples.half)
          : ray_points(scene.max_displacement * samples.to_unit * inward);
  for (const Eigen::Vector3d& x : points) domain.sample(x);
  return fit_paper_quadratic(samples);
}

// Its label seeds the survey of a site, so that adding a site leaves the others' surveys as they were, but for the quarters that
// few pushes a site leave to the next sites.
std::vector<Eigen::Vector3d> survey_points(const Scene& scene, const SamplingPlan& plan, size_t index,
                                           int label, int round, int count) {
  return choose_survey_points(count, scene.directions == Directions::inward,
                              static_cast<std::uint64_t>(label) + (static_cast<std::uint64_t>(round) << 32),
                              index * static_cast<size_t>(plan.survey_samples));
}

// Adds the pushes to those of these points that the survey of a site does not have yet.
void survey_site(SiteSampler& sampler, size_t index, const std::vector<Eigen::Vector3d>& points,
                 const Eigen::Matrix3d& to_unit, SiteResult& result) {
  for (size_t i = result.survey.size(); i < points.size(); ++i) {
    const Eigen::Vector3d displacement = to_unit.inverse() * points[i];
    result.survey.push_back(solve_push(sampler, {index, displacement, survey_increments(points[i].norm())}));
    result.unsolved += !result.survey.back().solved;
  }
}

// Where a fit is far off from a push of the survey, one of the few that no sample lay near, the domain is ended before that
// and the survey drawn anew: no push of the one that is kept has decided anything.
SitePolynomial follow_survey(SiteDomain& domain, double target, const SiteSamples& samples,
                             SitePolynomial fit, SiteResult& result, const std::function<void()>& survey) {
  constexpr int kMostRounds = 3;
  while (result.survey_round + 1 < kMostRounds && domain.leave_far_off(fit, target)) {
    DegreeChoice choice = choose_degree(samples);
    if (!choice.keeps(target)) choice = raise_degree(samples, choice);
    fit = fit_of(choice, samples, result);
    ++result.survey_round;
    survey();
  }
  return fit;
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
  const auto survey = [&] {
    // Few may be sampled of many: each of them is measured in each quarter of the range.
    const int count =
        plan.fewest && result.samples > 0 ? std::max(4, plan.survey_samples) : plan.survey_samples;
    result.survey.clear();
    result.unsolved = 0;
    survey_site(sampler, index, survey_points(scene, plan, index, label, result.survey_round, count),
                samples.to_unit, result);
  };
  if (scene.polynomial) {
    samples.linear = linear.field_compliance.size() > 0 ? linear_response(linear, site)
                                                        : linear_response(solver, sites, site, rest);
    SiteDomain domain(sampler, scene, site, label, samples, result);
    const bool is_ours = scene.polynomial_method == PolynomialMethod::hermite;
    const auto fit_site = [&] {
      if (!is_ours) return fit_as_paper(domain, scene, site.inward, samples);
      if (plan.fewest) return fit_where_needed(sampler, domain, sites, site, plan, points, samples, result);
      domain.sample_rest();
      return fit_to_target(domain, plan, points, samples, result);
    };
    SitePolynomial fit = fit_site();
    survey();
    if (is_ours && result.samples > 0)
      fit = follow_survey(domain, plan.target, samples, std::move(fit), result, survey);
    constexpr double kBasisPart = 0.2;  // of the target
    result.polynomial = reduce_basis(fit, samples.half, kBasisPart * plan.target, plan.rounded);
    for (const auto& [degree, tolerance, rounded] : plan.other_settings) {
      result.others.push_back(
          reduce_basis(fit_polynomial(samples, degree), samples.half, tolerance, rounded));
    }
  } else {
    survey();
  }
  result.counts = sampler.counts();
  return result;
}

// Of sites of which few had to be sampled: SamplingPlan::least_survey.
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
                        survey_site(sampler, index,
                                    survey_points(scene, plan, index, label, result.survey_round, count),
                                    result.polynomial.to_unit, result);
                        result.counts += sampler.counts();
                      },
                      {});
}

}  // namespace

const char* words_for(PushOutcome outcome) {
  switch (outcome) {
    case PushOutcome::solved:
      return "an equilibrium was found";
    case PushOutcome::no_equilibrium:
      return "no equilibrium was found";
    case PushOutcome::unstable:
      return "the equilibrium is not stable";
    case PushOutcome::other_branch:
      return "another equilibrium was found than from rest";
    case PushOutcome::nearly_inverted:
      return "an element nearly inverts";
    case PushOutcome::not_followed:
      return "polynomials do not follow";
  }
  return "";
}

double least_reach(const Eigen::Matrix3d& to_unit) {
  return 1 / to_unit.jacobiSvd().singularValues()[0];
}

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
    distances[next] = -1;  // also where another site is in the same place
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
  const std::vector<size_t> worked = spread_sites(assembly.model(), sites, num_surveyed);
  for_each_on_threads(
      assembly, worked.size(), plan.jobs,
      [&](StaticSolver& solver, size_t i) {
        results[worked[i]] = sample_site(solver, scene, sites, worked[i], linear, plan, points, rest, store);
      },
      progress, next);
  const bool has_all = !next;
  if (plan.fewest && has_all) survey_further(assembly, scene, sites, plan, rest, store, results);
  return results;
}

}  // namespace palpate
