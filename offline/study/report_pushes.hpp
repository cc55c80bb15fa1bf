// The pushes of a report and their truths, the full nonlinear solves. A level is a size |d| of pushes.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "offline/pipeline/carried_scene.hpp"
#include "offline/pipeline/opened_pack.hpp"
#include "offline/precompute/contact_truth.hpp"

namespace palpate {

// Truths of a level. Pushes are shorter where the pack's sampled domain is shorter.
struct LevelTruths {
  double part = 1;  // fraction of the pack's largest |d|
  std::vector<ContactTruth> truths;
};

// Contact sets of a level, before their solves.
struct LevelSets {
  double part = 1;
  std::vector<std::vector<LinearContact>> sets;
};

// Maps the unit ball to the displacements of a site, length unit.
using SiteDomain = std::function<Eigen::Matrix3d(size_t site)>;

// Returns the median of the organ's thickness inward of each site: length unit, possibly infinite.
double median_thickness(const Organ& organ);

// Returns the levels of a comparison as fractions of the largest |d|: quarters. Where the largest |d| is 30 %
// strain, returns the levels of Zhong et al. 2005: 5, 10, 20 and 30 % strain.
std::vector<double> compared_parts(const Organ& organ);

// Draws `count` single contacts for each level of `parts`, at `sites` in turn. solve_levels() also solves.
std::vector<LevelSets> draw_levels(const Organ& organ, const SiteDomain& domain,
                                   const std::vector<double>& parts, const std::vector<size_t>& sites,
                                   int count, std::int64_t seed);
std::vector<LevelTruths> solve_levels(const OpenedPack& opened, const Organ& organ,
                                      const std::vector<double>& parts, const std::vector<size_t>& sites,
                                      int count, std::int64_t seed, int jobs);

// Draws `count` sets of `contacts` contacts for each level, at random sites whose patches share no node.
// Returns fewer sets where such sites are rare. solve_several() also solves.
std::vector<LevelSets> draw_several(const Organ& organ, const SiteDomain& domain,
                                    const std::vector<double>& parts, int contacts, int count,
                                    std::int64_t seed);
std::vector<LevelTruths> solve_several(const OpenedPack& opened, const Organ& organ,
                                       const std::vector<double>& parts, int contacts, int count,
                                       std::int64_t seed, int jobs);

}  // namespace palpate
