// At small strains zones of any size are exact, and first order is enough outside.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <vector>

#include "runtime/src/session/session_state.hpp"
#include "tests/support/zone_block.hpp"

namespace palpate::test {
namespace zone_small_strain_test {

using Eigen::Vector3d;

constexpr LinearElastic kTissue = {1.0, 2.0};
constexpr double kFieldTolerance = field_tolerance(2e-6);
constexpr double kForceTolerance = 1e-11;
constexpr double kGivenTolerance = 1e-5;  // error of iterations between groups

// Each contact moves by an edge, in its own direction.
std::vector<pal_contact> pushes_at(const ZoneBlock& organ, const std::vector<uint32_t>& sites) {
  const Vector3d ways[] = {{0.3, -0.2, -0.93}, {-0.5, 0.6, 0.62}, {0.8, 0.1, -0.59}};
  std::vector<pal_contact> contacts;
  for (size_t c = 0; c < sites.size(); ++c) {
    const Vector3d d = organ.block.sites.mean_surface_edge * ways[c];
    contacts.push_back({sites[c], {d[0], d[1], d[2]}, 0, {}, {}, {}});
  }
  return contacts;
}

// Compares with the full solve, and returns the number of groups.
uint32_t expect_truth(const ZoneBlock& organ, const std::vector<uint32_t>& sites) {
  pal_session_config config = organ.config(3);
  config.max_fixed = 1;
  OwnedSession session(organ.pack->get(), config);
  std::vector<pal_contact> contacts = pushes_at(organ, sites);
  const auto expect = [&](const std::vector<int>& fixed) {
    session.fix(contact_nodes_at(organ, fixed));
    auto results = settle(session, contacts);
    const ZoneErrors errors = errors_where_it_is(organ, session, contacts, results, fixed);
    EXPECT_LE(errors.field, kFieldTolerance);
    EXPECT_LE(errors.force, kForceTolerance);
    return results;
  };
  const auto free = expect({});
  const uint32_t groups = session.get()->tissue.zone.active.num_groups;
  const auto fixed = expect({organ.block.sites.sites[organ.block.sites.sites.size() / 4].node});
  EXPECT_GE(worst_force_error(fixed, free), 1e-3) << "it has to matter";
  contacts[0].force_axes = 4;
  contacts[0].force[2] = 0.7 * free[0].force[2];
  const auto given = expect({});
  EXPECT_NEAR(given[0].force[2], contacts[0].force[2], kGivenTolerance * largest_force(given));
  return groups;
}

TEST(ZoneSmallStrain, IsTheFullSolveWhateverIsOutside) {
  struct Shape {
    int rings;
    bool quadratic;
    int cells;
    double tip_radius;  // large enough that patches of neighbours share nodes
    uint32_t groups;    // largest number of groups
  };
  for (const auto& [rings, quadratic, cells, tip_radius, groups] :
       {Shape{1, false, 6, 0.18, 2}, {2, false, 8, 0.13, 2}, {1, true, 4, 0.13, 2}, {2, true, 4, 0.13, 1}}) {
    for (const Vector3d& gravity : {Vector3d(0, 0, 0), {0.02, 0.01, -0.06}}) {
      SCOPED_TRACE(testing::Message() << rings << " rings, " << quadratic << ", gravity " << gravity.norm());
      const ZoneBlock organ(rings, kTissue, quadratic, gravity, cells, tip_radius);
      ASSERT_GT(organ.zone.most_boundary_nodes, 0);
      const uint32_t last = static_cast<uint32_t>(organ.block.sites.sites.size()) - 1;
      const uint32_t middle = last / 2;
      uint32_t most_groups = 0;
      for (const std::vector<uint32_t>& sites :
           {std::vector{middle}, {middle, middle + 1}, {0, last}, {0, 1, last}, {0, middle, last}})
        most_groups = std::max(most_groups, expect_truth(organ, sites));
      EXPECT_EQ(most_groups, groups);
    }
  }
}

}  // namespace zone_small_strain_test
}  // namespace palpate::test
