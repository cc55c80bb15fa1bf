// The pushes of a report and their truths.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "offline/pipeline/carried_scene.hpp"
#include "offline/pipeline/opened_pack.hpp"
#include "offline/precompute/contact_truth.hpp"

namespace palpate {

// Truths of pushes of the same |d|, but where the pack's domain is shortened.
struct LevelTruths {
  double part = 1;  // of the pack's largest |d|
  std::vector<ContactTruth> truths;
};

// Contacts that are to be solved, all with the same |d|.
struct LevelSets {
  double part = 1;
  std::vector<std::vector<LinearContact>> sets;
};

// From the unit ball to the displacements of a site, length unit.
using SiteDomain = std::function<Eigen::Matrix3d(size_t site)>;

// How thick the organ is inward of its sites, the median: length unit; infinite where no ray leads into it.
double median_thickness(const Organ& organ);

// Of the largest |d|, at which methods are compared: quarters of it; where that is the 30 % strain that Zhong et al.
// 2005 go to, 5, 10, 20 and 30 %.
std::vector<double> compared_parts(const Organ& organ);

// One contact, at one of `sites` after the other, `count` of them for each of `parts`.
std::vector<LevelSets> draw_levels(const Organ& organ, const SiteDomain& domain,
                                   const std::vector<double>& parts, const std::vector<size_t>& sites,
                                   int count, std::int64_t seed);
std::vector<LevelTruths> solve_levels(const OpenedPack& opened, const Organ& organ,
                                      const std::vector<double>& parts, const std::vector<size_t>& sites,
                                      int count, std::int64_t seed, int jobs);

// `contacts` of them at a time, at random sites whose patches share no node, all with the same |d|; fewer sets, or
// none, where such sites are hard to find.
std::vector<LevelSets> draw_several(const Organ& organ, const SiteDomain& domain,
                                    const std::vector<double>& parts, int contacts, int count,
                                    std::int64_t seed);
std::vector<LevelTruths> solve_several(const OpenedPack& opened, const Organ& organ,
                                       const std::vector<double>& parts, int contacts, int count,
                                       std::int64_t seed, int jobs);

}  // namespace palpate
