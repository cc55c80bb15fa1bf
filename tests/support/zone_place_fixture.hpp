// Contacts between sites on packs with nonlinear zones.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <tuple>
#include <vector>

#include "runtime/src/session/session_state.hpp"
#include "tests/support/runtime_session.hpp"
#include "tests/support/small_pack.hpp"
#include "tests/support/tool_session.hpp"
#include "tests/support/zone_block.hpp"

namespace palpate::test::zone_place_fixture {

inline const Eigen::Vector3d kPush(0.01, -0.012, -0.03);

using test::force_of;
inline Eigen::Vector3d force_of(const pal_contact_result& result) {
  return Eigen::Vector3d(result.force);
}

inline pal_contact at_site(uint32_t site, const Eigen::Vector3d& d) {
  return {site, {d[0], d[1], d[2]}, 0, {}, {}, {}};
}

// Packs with zones; the parameter says whether polynomials stand beside them.
class ZonePlaces : public testing::TestWithParam<bool> {
 protected:
  static const AlignedBytes& bytes() {
    if (GetParam()) return zone_pack_bytes();
    static const AlignedBytes alone = [] {
      PackContent content = small_pack().content();
      content.polynomials = nullptr;
      content.zone = &small_pack().zone;
      return write_pack(content);
    }();
    return alone;
  }

  pal_surface_point point_at(const Eigen::Vector3d& position) const {
    pal_surface_point point;
    require(pal_pack_find_surface_point(pack_.get(), position.data(), &point), "surface point");
    return point;
  }

  pal_contact contact_at(const Eigen::Vector3d& position, const Eigen::Vector3d& d) const {
    const pal_surface_point point = point_at(position);
    return pal_contact_at(&point, d.data());
  }

  struct Answer {
    Eigen::Vector3d force;
    Eigen::VectorXd field;
  };

  // The converged response, from rest.
  Answer settled(const std::vector<pal_contact>& contacts) const {
    OwnedSession session(pack_.get(), PAL_MODEL_ZONE);
    std::vector<pal_contact_result> results;
    for (int frame = 0; frame <= PAL_ZONE_STIFFNESS_FRAMES; ++frame) {
      results = session.touch(contacts);
      refine(session);
    }
    EXPECT_EQ(results.front().flags, 0U);
    EXPECT_EQ(results.front().model, PAL_MODEL_ZONE);
    return {force_of(results.front()), as_vector(session.field())};
  }

  // The blend of the zone responses at the corners of `position`.
  Answer blended(const Eigen::Vector3d& position, const Eigen::Vector3d& d) const {
    const pal_surface_point point = point_at(position);
    Answer blend = {Eigen::Vector3d::Zero(), {}};
    for (int corner = 0; corner < 3; ++corner) {
      const Answer own = settled({at_site(point.sites[corner], d)});
      if (corner == 0) blend.field = Eigen::VectorXd::Zero(own.field.size());
      blend.force += point.weights[corner] * own.force;
      blend.field += point.weights[corner] * own.field;
    }
    return blend;
  }

  const Eigen::Vector3d kPlace{0.17, 0.22, 0.375};
  OpenPack pack_{bytes()};
};

}  // namespace palpate::test::zone_place_fixture
