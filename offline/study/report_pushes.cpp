#include "offline/study/report_pushes.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>
#include <random>
#include <utility>

#include "offline/output/progress_bar.hpp"
#include "offline/pipeline/held_out_pushes.hpp"
#include "offline/pipeline/measured_push.hpp"
#include "offline/precompute/contact_sets.hpp"
#include "offline/precompute/local_thickness.hpp"

namespace palpate {
namespace {

// Draws unit vectors. The set highest bit keeps their seed apart from the seeds of the builder's surveys.
std::vector<Eigen::Vector3d> directions_of(int count, const Scene& scene, std::mt19937_64& random) {
  std::vector<Eigen::Vector3d> points =
      choose_survey_points(count, scene.directions == Directions::inward, random() | std::uint64_t{1} << 63);
  for (Eigen::Vector3d& point : points) point.normalize();
  return points;
}

std::vector<size_t> sites_apart(const ContactSites& sites, int contacts, std::mt19937_64& random) {
  std::vector<size_t> order(sites.sites.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::shuffle(order.begin(), order.end(), random);
  return first_apart(sites, order, static_cast<size_t>(contacts));
}

// Returns the map of each site to the pack's sampled domain.
SiteDomain domain_of(const OpenedPack& opened, const Organ& organ) {
  return [&](size_t site) { return sampled_domain(opened, organ.scene, organ.sites, site); };
}

}  // namespace

double median_thickness(const Organ& organ) {
  const Surface surface = extract_surface(organ.model);
  std::vector<double> thicknesses;
  for (const ContactSite& site : organ.sites.sites)
    thicknesses.push_back(local_thickness(organ.model, surface, site, site.inward));
  const auto middle = thicknesses.begin() + static_cast<std::ptrdiff_t>(thicknesses.size() / 2);
  std::nth_element(thicknesses.begin(), middle, thicknesses.end());
  return *middle;
}

std::vector<double> compared_parts(const Organ& organ) {
  constexpr double kPaperStrain = 0.3;
  constexpr double kSameStrain = 0.01;  // tolerance
  const double strain = organ.scene.max_displacement / median_thickness(organ);
  if (std::abs(strain - kPaperStrain) < kSameStrain) return {0.05 / strain, 0.1 / strain, 0.2 / strain, 1};
  return {0.25, 0.5, 0.75, 1};
}

std::vector<LevelSets> draw_levels(const Organ& organ, const SiteDomain& domain,
                                   const std::vector<double>& parts, const std::vector<size_t>& sites,
                                   int count, std::int64_t seed) {
  std::mt19937_64 random(static_cast<std::uint64_t>(seed) + 1);
  std::vector<LevelSets> levels;
  for (const double part : parts) {
    LevelSets& level = levels.emplace_back();
    level.part = part;
    const std::vector<Eigen::Vector3d> directions = directions_of(count, organ.scene, random);
    for (size_t i = 0; i < directions.size(); ++i) {
      const size_t site = sites[i % sites.size()];
      level.sets.push_back({{site, domain(site) * (part * directions[i])}});
    }
  }
  return levels;
}

std::vector<LevelTruths> solve_levels(const OpenedPack& opened, const Organ& organ,
                                      const std::vector<double>& parts, const std::vector<size_t>& sites,
                                      int count, std::int64_t seed, int jobs) {
  const std::vector<LevelSets> drawn =
      draw_levels(organ, domain_of(opened, organ), parts, sites, count, seed);
  std::vector<Push> pushes;
  for (const LevelSets& level : drawn) {
    for (const std::vector<LinearContact>& set : level.sets)
      pushes.push_back({set.front().site, set.front().displacement, survey_increments(level.part)});
  }
  ProgressBar bar("solving pushes at each |d|", static_cast<int>(sites.size()));
  std::vector<ContactTruth> truths = truths_of(solve_pushes(
      organ.assembly, organ.sites, pushes, jobs, [&](int done, int) { bar.show(done); }, organ.rest));
  std::vector<LevelTruths> levels;
  auto next = truths.begin();
  for (const LevelSets& level : drawn) {
    const auto end = next + static_cast<std::ptrdiff_t>(level.sets.size());
    levels.push_back({level.part, {std::move_iterator(next), std::move_iterator(end)}});
    next = end;
  }
  return levels;
}

std::vector<LevelSets> draw_several(const Organ& organ, const SiteDomain& domain,
                                    const std::vector<double>& parts, int contacts, int count,
                                    std::int64_t seed) {
  std::mt19937_64 random(static_cast<std::uint64_t>(seed) + 2);
  std::vector<LevelSets> levels;
  for (const double part : parts) {
    LevelSets level{part, {}};
    for (int i = 0; i < count; ++i) {
      const std::vector<size_t> sites = sites_apart(organ.sites, contacts, random);
      const std::vector<Eigen::Vector3d> directions = directions_of(contacts, organ.scene, random);
      std::vector<LinearContact> set;
      for (size_t c = 0; c < sites.size(); ++c)
        set.push_back({sites[c], domain(sites[c]) * (part * directions[c])});
      if (!set.empty()) level.sets.push_back(std::move(set));
    }
    if (!level.sets.empty()) levels.push_back(std::move(level));
  }
  return levels;
}

std::vector<LevelTruths> solve_several(const OpenedPack& opened, const Organ& organ,
                                       const std::vector<double>& parts, int contacts, int count,
                                       std::int64_t seed, int jobs) {
  std::vector<LevelTruths> levels;
  ProgressBar bar("solving several contacts", count * static_cast<int>(parts.size()));
  for (const LevelSets& level : draw_several(organ, domain_of(opened, organ), parts, contacts, count, seed)) {
    const int before = count * static_cast<int>(levels.size());
    levels.push_back(
        {level.part, solve_contact_sets(organ.assembly, organ.sites, level.sets, jobs, organ.rest,
                                        [&](int done, int) { bar.show(before + done); })});
  }
  return levels;
}

}  // namespace palpate
