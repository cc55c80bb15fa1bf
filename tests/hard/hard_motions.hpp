// What a tool does at a site that no tool should: jumps, places outside of the domain, swipes from site to site.
// Asked of every model that may answer, the default first.
#pragma once

#include <vector>

#include "tests/hard/hard_organ.hpp"

namespace palpate::hard {

inline constexpr int kFramesToRest = 60;

// Along these displacements in turn, each held for some frames; after as many at the last beside the truth, and of
// zones the frame of the last jump itself.
std::vector<Answer> jump(const Organ& organ, std::uint32_t site, const std::vector<Eigen::Vector3d>& path);

// So many times the largest displacement, four ways. Beside the full solve where there may be one.
std::vector<Answer> outside(const Organ& organ, std::uint32_t site, double times);

// A displacement with this component.
std::vector<Answer> not_finite(const Organ& organ, std::uint32_t site, double component);

// Along the surface from one place to another, moved by d: the truth between sites is the blend of the full solves at
// the corners of the triangle. Of each model the worst frame.
std::vector<Answer> swipe(const Organ& organ, const Eigen::Vector3d& from, const Eigen::Vector3d& to,
                          const Eigen::Vector3d& d);

// Along the way from rest through these displacements in steps of so many edges, one frame a step; every tenth part of it beside
// the full solve there, as it comes. Of each model the worst frame.
std::vector<Answer> drag(const Organ& organ, std::uint32_t site, const std::vector<Eigen::Vector3d>& way,
                         double step);

}  // namespace palpate::hard
