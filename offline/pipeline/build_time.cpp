#include "offline/pipeline/build_time.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <ctime>
#include <functional>
#include <vector>

#include "offline/precompute/sample_points.hpp"

namespace palpate {
namespace {

// Processor seconds of this process: other programs of a busy machine do not count.
double processor_seconds(const std::function<void()>& work) {
  const std::clock_t start = std::clock();
  work();
  return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

// Sums over the tried sites.
struct TriedSolves {
  int sites = 0;
  double rest = 0;  // seconds of the derivatives at rest, once for each site
  double sample = 0;
  double survey = 0;

  double sum() const { return rest + sample + survey; }
};

// Solves a typical sample and a typical survey push at a site, and forgets them.
void try_site(StaticSolver& solver, const Scene& scene, const ContactSites& sites, const ContactSite& site,
              const RestState& rest, bool is_sampled, TriedSolves& tried) {
  const bool half = scene.directions == Directions::inward;
  const auto displacement = [&](const Eigen::Vector3d& x) -> Eigen::Vector3d {
    return scene.max_displacement * (site.frame * x);
  };
  SiteSampler sampler(solver, sites, site, rest);
  Sample ignored;
  ++tried.sites;
  tried.rest += processor_seconds([&] { (void)sampler.solve(Eigen::Vector3d::Zero(), ignored); });
  const Eigen::Vector3d x = choose_survey_points(2, half, static_cast<std::uint64_t>(site.node)).back();
  tried.survey += processor_seconds(
      [&] { (void)sampler.solve_from_rest(displacement(x), survey_increments(x.norm()), ignored); });
  if (!is_sampled) return;
  SamplePoints points(half);
  tried.sample += processor_seconds([&] { (void)sampler.solve(displacement(points[0]), ignored); });
}

// Returns the mean seconds of whole sites, fits included, over an eighth of the sites; 0 where these are
// fewer than two. Hard sites take many times the samples and fits of others. The longest site does not count,
// as it also pays for what all sites share.
double mean_site_seconds(const Assembly& assembly, const Scene& scene, const ContactSites& sites,
                         const RestState& rest, const SamplingPlan& plan, size_t num_sites) {
  constexpr size_t kMostSites = 10;
  constexpr double kMostSeconds = 5;
  const size_t count = std::min(kMostSites, num_sites / 8);
  if (count < 2) return 0;
  SamplingPlan alone = plan;
  alone.jobs = 1;
  std::vector<std::clock_t> times;  // at which a site begins, or the last one ends
  const auto next = [&]() -> size_t {
    times.push_back(std::clock());
    const double spent = static_cast<double>(times.back() - times.front()) / CLOCKS_PER_SEC;
    const size_t done = times.size() - 1;
    if (done == count || (spent > kMostSeconds && done > 1)) return num_sites;
    double whole = 0;  // the golden ratio spreads any number of sites over their order
    return static_cast<size_t>(std::modf(0.618034 * static_cast<double>(done + 1), &whole) *
                               static_cast<double>(num_sites));
  };
  (void)sample_sites(assembly, scene, sites, {}, alone, {}, rest, nullptr, next);
  std::clock_t longest = 0;
  for (size_t i = 1; i < times.size(); ++i) longest = std::max(longest, times[i] - times[i - 1]);
  return static_cast<double>(times.back() - times.front() - longest) / CLOCKS_PER_SEC /
         static_cast<double>(times.size() - 2);
}

}  // namespace

BuildTime estimate_build_time(const Assembly& assembly, const Scene& scene, const ContactSites& sites,
                              const RestState& rest, const SamplingPlan& plan, const PlannedWork& work) {
  // Evidence for these ratios: docs/accuracy.md, "Estimates of time".
  constexpr double kSurveysPerSet = 2;     // a set ramps several contacts
  constexpr double kSurveysPerSettle = 2;  // the runtime's zones and exterior at a survey push or a set
  constexpr double kRestsPerSeries = 2.5;
  constexpr double kQuickSite = 1;  // seconds; whole sites are tried below
  constexpr size_t kMostSites = 8;
  constexpr double kLongEnough = 0.5;  // seconds, to even out the sites and the clock
  (void)assembly.analysis();           // once for the whole build, and no part of a site's time
  StaticSolver solver(assembly);
  TriedSolves tried;
  for (const size_t site : spread_sites(assembly.model(), sites, kMostSites)) {
    try_site(solver, scene, sites, sites.sites[site], rest, work.samples_per_site > 0, tried);
    if (tried.sum() > kLongEnough) break;
  }
  const double rest_seconds = tried.rest / tried.sites;
  const double sample_seconds = tried.sample / tried.sites;
  const double survey_seconds = tried.survey / tried.sites;
  const auto num_sites = static_cast<double>(work.sites);
  const auto num_sets = static_cast<double>(work.sets);
  const double surveys = num_sites * static_cast<double>(work.survey_per_site);
  double site_seconds = rest_seconds + static_cast<double>(work.samples_per_site) * sample_seconds +
                        static_cast<double>(work.survey_per_site) * survey_seconds;
  if (work.has_series) site_seconds += kRestsPerSeries * rest_seconds;
  if (work.samples_per_site > 0 && site_seconds < kQuickSite) {
    const double measured = mean_site_seconds(assembly, scene, sites, rest, plan, work.sites);
    if (measured > 0) site_seconds = measured;
  }
  double seconds = num_sites * site_seconds + kSurveysPerSet * num_sets * survey_seconds;
  if (work.has_zones) seconds += kSurveysPerSettle * (surveys + num_sets) * survey_seconds;
  return {survey_seconds, seconds};
}

}  // namespace palpate
