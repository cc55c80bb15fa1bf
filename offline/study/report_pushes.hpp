// The pushes of a report and their truths.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "offline/pipeline/carried_scene.hpp"
#include "offline/pipeline/opened_pack.hpp"
#include "offline/precompute/contact_truth.hpp"

namespace palpate {

// Truths of pushes with the same |d|, except where the pack's domain is shortened.
struct LevelTruths {
  double part = 1;  // fraction of the pack's largest |d|
  std::vector<ContactTruth> truths;
};

// Contact sets to be solved, all with the same |d|.
struct LevelSets {
  double part = 1;
  std::vector<std::vector<LinearContact>> sets;
};

// Maps the unit ball to the displacements of a site, length unit.
using SiteDomain = std::function<Eigen::Matrix3d(size_t site)>;

// Median thickness of the organ inward of its sites: length unit; infinite where no ray enters the organ.
double median_thickness(const Organ& organ);

// Fractions of the largest |d| in a comparison: quarters. Where the largest |d| is 30 % strain (Zhong et al.
// 2005): 5, 10, 20 and 30 % strain.
std::vector<double> compared_parts(const Organ& organ);

// Draws `count` single contacts for each of `parts`, cycling through `sites`.
std::vector<LevelSets> draw_levels(const Organ& organ, const SiteDomain& domain,
                                   const std::vector<double>& parts, const std::vector<size_t>& sites,
                                   int count, std::int64_t seed);
std::vector<LevelTruths> solve_levels(const OpenedPack& opened, const Organ& organ,
                                      const std::vector<double>& parts, const std::vector<size_t>& sites,
                                      int count, std::int64_t seed, int jobs);

// Draws sets of `contacts` contacts with equal |d| at random sites whose patches share no node. Returns fewer
// sets where such sites are rare.
std::vector<LevelSets> draw_several(const Organ& organ, const SiteDomain& domain,
                                    const std::vector<double>& parts, int contacts, int count,
                                    std::int64_t seed);
std::vector<LevelTruths> solve_several(const OpenedPack& opened, const Organ& organ,
                                       const std::vector<double>& parts, int contacts, int count,
                                       std::int64_t seed, int jobs);

}  // namespace palpate
