#include "offline/precompute/site_survey.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <atomic>
#include <exception>
#include <limits>
#include <map>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <system_error>
#include <thread>
#include <utility>

namespace palpate {
namespace {

constexpr double kShrink = 0.7;         // of the ball, when the solver cannot reach its edge
constexpr double kSmallestBall = 0.25;  // of the scene's largest displacement

SurveySample solve_push(SiteSampler& sampler, const Push& push) {
  SurveySample sample;
  sample.site = push.site;
  sample.solved = sampler.solve_from_rest(push.displacement, push.increments, sample.truth);
  sample.truth.displacement = push.displacement;
  return sample;
}

// Calls work(solver, i) for i < count on `jobs` threads, each with a solver of its own; `progress` gets calls
// done and their number. Throws what the first of them by number threw. A call is made by one thread from
// start to end, so that the schedule cannot change a digit.
void for_each_on_threads(const Assembly& assembly, size_t count, int jobs,
                         const std::function<void(StaticSolver&, size_t)>& work,
                         const std::function<void(int, int)>& progress) {
  std::atomic<size_t> next = 0;
  std::mutex report;
  int done = 0;
  std::exception_ptr failure;
  size_t failed = count;
  const auto run = [&] {
    std::optional<StaticSolver> solver;
    for (size_t i = next++; i < count; i = next++) {
      try {
        if (!solver) solver.emplace(assembly);
        work(*solver, i);
        const std::lock_guard lock(report);
        ++done;
        if (progress) progress(done, static_cast<int>(count));
      } catch (...) {
        const std::lock_guard lock(report);
        if (i < failed) {
          failed = i;
          failure = std::current_exception();
        }
        next = count;
        return;
      }
    }
  };
  {
    std::vector<std::jthread> threads;
    try {
      for (int i = 1; i < std::min(jobs, static_cast<int>(count)); ++i) threads.emplace_back(run);
    } catch (const std::system_error&) {
      // The machine gives no more threads: those there are do all the work.
    }
    run();
  }
  if (failure) std::rethrow_exception(failure);
}

SiteResult sample_site(StaticSolver& solver, const Scene& scene, const ContactSites& sites, size_t index,
                       const LinearDd& linear, const SamplingPlan& plan,
                       const std::vector<Eigen::Vector3d>& sample_points, const RestState& rest) {
  const ContactSite& site = sites.sites[index];
  const bool half = scene.directions == Directions::inward;
  const Eigen::Matrix3d frame = half ? frame_about(site.inward) : Eigen::Matrix3d::Identity();
  const int label = solver.assembly().model().labels[static_cast<size_t>(site.node)];
  SiteSampler sampler(solver, sites, site, rest);
  SiteResult result;
  double radius = scene.max_displacement;

  if (scene.polynomial) {
    std::vector<Sample> samples;
    for (size_t i = 0; i < sample_points.size();) {
      Sample sample;
      if (sampler.solve(radius * frame * sample_points[i], sample)) {
        result.min_jacobian = std::min(result.min_jacobian, sample.min_jacobian);
        samples.push_back(std::move(sample));
        ++i;
        continue;
      }
      radius *= kShrink;
      if (radius < kSmallestBall * scene.max_displacement) {
        throw std::runtime_error(
            fmt::format("{}: no equilibrium found for pushes of {:.3g} at node {}, though max_displacement "
                        "is {:.3g}; reduce "
                        "max_displacement, or raise tip_radius",
                        scene.file.string(), radius / kShrink, label, scene.max_displacement));
      }
      samples.clear();
      result.min_jacobian = 1;
      i = 0;
    }
    result.polynomial =
        fit_polynomial(samples,
                       linear.field_compliance.size() > 0 ? linear_response(linear, site)
                                                          : linear_response(solver, sites, site, rest),
                       radius, plan.degree);
  }
  // The label seeds the survey, so that adding a site leaves the others' surveys as they were.
  for (const Eigen::Vector3d& point :
       choose_survey_points(plan.survey_samples, half, static_cast<std::uint64_t>(label))) {
    result.survey.push_back(
        solve_push(sampler, {index, radius * frame * point, survey_increments(point.norm())}));
    result.unsolved += !result.survey.back().solved;
  }
  result.counts = sampler.counts();
  return result;
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
    distances[next] = -1;  // also where another site is in the same place
    next = static_cast<size_t>(std::max_element(distances.begin(), distances.end()) - distances.begin());
  }
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

std::vector<SiteResult> sample_sites(const Assembly& assembly, const Scene& scene, const ContactSites& sites,
                                     const LinearDd& linear, const SamplingPlan& plan,
                                     const std::function<void(int, int)>& progress, const RestState& rest) {
  // Chosen for one degree more than is fitted, so that what the fit leaves out does not pass for what it
  // holds.
  const std::vector<Eigen::Vector3d> sample_points =
      choose_sample_points(plan.degree + 1, plan.samples, scene.directions == Directions::inward);
  std::vector<SiteResult> results(sites.sites.size());
  const size_t num_surveyed =
      plan.survey_sites > 0 ? static_cast<size_t>(plan.survey_sites) : sites.sites.size();
  const std::vector<size_t> worked = spread_sites(assembly.model(), sites, num_surveyed);
  for_each_on_threads(
      assembly, worked.size(), plan.jobs,
      [&](StaticSolver& solver, size_t i) {
        results[worked[i]] = sample_site(solver, scene, sites, worked[i], linear, plan, sample_points, rest);
      },
      progress);
  return results;
}

}  // namespace palpate
