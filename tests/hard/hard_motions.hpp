// Tool motions beyond good practice: jumps, places outside the domain, swipes from site to site. Each runs on
// every response model, the default first.
#pragma once

#include <vector>

#include "tests/hard/hard_organ.hpp"

namespace palpate::hard {

inline constexpr int kFramesToRest = 60;

// Jumps along these displacements, each held for some frames. Compares the last with the full solve after as
// many frames; for zones also in the frame of the last jump.
std::vector<Answer> jump(const Organ& organ, std::uint32_t site, const std::vector<Eigen::Vector3d>& path);

// Four pushes of so many times the largest displacement, compared with the full solve where it exists.
std::vector<Answer> outside(const Organ& organ, std::uint32_t site, double times);

// A displacement with this component.
std::vector<Answer> not_finite(const Organ& organ, std::uint32_t site, double component);

// Along the surface from one place to another, displaced by d. Between sites the reference is the blend of
// the full solves at the triangle's corners. The worst frame of each model.
std::vector<Answer> swipe(const Organ& organ, const Eigen::Vector3d& from, const Eigen::Vector3d& to,
                          const Eigen::Vector3d& d);

// From rest through these displacements in steps of so many edges, one a frame. Every tenth part is compared
// with the full solve there, without waiting. The worst frame of each model.
std::vector<Answer> drag(const Organ& organ, std::uint32_t site, const std::vector<Eigen::Vector3d>& way,
                         double step);

}  // namespace palpate::hard
