// Patches that rotate, and the full solve as reference.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "tests/support/small_pack.hpp"
#include "tests/support/tool_session.hpp"
#include "tests/support/zone_block.hpp"

namespace palpate::test::patch_rotation_fixture {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Wrench = Eigen::Matrix<double, 6, 1>;
inline const Vector3d kTwist(0.1, -0.15, 0.3);  // 20 degrees

inline pal_session_config turning(const ZoneBlock& organ, uint32_t max_contacts = 3) {
  pal_session_config config = organ.config(max_contacts);
  config.patches_turn = 1;
  return config;
}

inline void orient(OwnedSession& session, const std::vector<Matrix3d>& rotations) {
  std::vector<double> orientations;
  for (const Matrix3d& rotation : rotations) {
    const Eigen::Quaterniond q(rotation);
    orientations.insert(orientations.end(), {q.w(), q.x(), q.y(), q.z()});
  }
  require(pal_session_set_orientations(session.get(), orientations.data(),
                                       static_cast<uint32_t>(rotations.size())),
          "orientations");
}

inline pal_contact_torque torque_of(const OwnedSession& session, uint32_t contact) {
  pal_contact_torque torque = {};
  torque.struct_size = sizeof torque;
  require(pal_session_get_torque(session.get(), contact, &torque), "torque");
  return torque;
}

inline const std::vector<pal_contact> kPress = {{4, {0.03, -0.02, -0.08}, 0, {}, {}, {}}};

}  // namespace palpate::test::patch_rotation_fixture
