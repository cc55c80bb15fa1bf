// Blocks and contacts for the tests of nonlinear zones.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <utility>

#include "tests/support/nightly.hpp"
#include "tests/support/tool_session.hpp"
#include "tests/support/zone_block.hpp"

namespace palpate::test::nonlinear_zone_fixture {

inline const std::vector<pal_contact> kOne = {{4, {0.03, -0.02, -0.1}, 0, {}, {}, {}}};

// Contacts with patches that share nodes, and contacts with separate patches.
inline const std::vector<pal_contact> kAdjacent = {{3, {0.02, 0, -0.08}, 0, {}, {}, {}},
                                                   {4, {0, 0.02, -0.05}, 0, {}, {}, {}}};

inline const std::vector<pal_contact> kApart = {{0, {0.03, 0, -0.08}, 0, {}, {}, {}},
                                                {8, {0, 0.04, 0.03}, 0, {}, {}, {}}};

inline const InvariantLaw kYeoh = {0.5, 0, 0.1, 0.05, {{0.6, 0.2, 0}}};

inline ZoneBlock sharing_block(int rings, const Law& law, bool quadratic = false,
                               const Eigen::Vector3d& gravity = Eigen::Vector3d::Zero(), int cells = 4,
                               double tip_radius = 0.26) {
  return {rings, law, quadratic, gravity, cells, tip_radius, true};
}

}  // namespace palpate::test::nonlinear_zone_fixture
