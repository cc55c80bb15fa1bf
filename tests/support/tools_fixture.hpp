// Helpers shared by the tests of tools.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>

#include "tests/support/runtime_session.hpp"
#include "tests/support/small_pack.hpp"
#include "tests/support/tool_session.hpp"

namespace palpate::test::tools_fixture {

// Rounding of sums of a few products of doubles near 1, for displacements near 0.05.
inline constexpr double kRounding = 1e-12;

inline Eigen::Vector3d site_position(const OpenPack& pack, uint32_t site) {
  uint32_t node = 0;
  require(pal_pack_get_site_node(pack.get(), site, &node), "site node");
  return Eigen::Map<const Eigen::Vector3d>(pack.face().geometry().positions + size_t{3} * node);
}

inline pal_session_config raw_config(const OpenPack& pack, pal_model model = PAL_MODEL_AUTO) {
  return session_config(pack.get(), model, 4, 4);
}

class Tools : public ::testing::Test {
 protected:
  OpenPack pack_{small_pack_bytes()};
  ToolSession tools_{pack_.get(), raw_config(pack_)};
  OwnedSession contacts_{pack_.get(), PAL_MODEL_AUTO, 4, 4};
};

inline void expect_near(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b, double tolerance,
                        const char* what) {
  EXPECT_LE((a - b).norm(), tolerance * (b.norm() + 1e-3)) << what << "\n" << a << "\nagainst\n" << b;
}

}  // namespace palpate::test::tools_fixture
