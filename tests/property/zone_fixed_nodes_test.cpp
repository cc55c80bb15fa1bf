// Nodes fixed while running, inside and outside nonlinear zones, compared with full solves and linear_dd.
#include <gtest/gtest.h>

#include <Eigen/Core>

#include "tests/support/tool_session.hpp"
#include "tests/support/zone_block.hpp"

namespace palpate::test {
namespace zone_fixed_nodes_test {

using Eigen::Vector3d;

constexpr uint32_t kMostFixed = 40;

int centre_of(const ZoneBlock& organ, uint32_t site) {
  return organ.block.sites.sites[site].node;
}

pal_session_config config_of(const ZoneBlock& organ, uint32_t max_contacts = 3) {
  pal_session_config config = organ.config(max_contacts);
  config.max_fixed = kMostFixed;
  return config;
}

ZoneErrors errors_of(const ZoneBlock& organ, const std::vector<pal_contact>& contacts,
                     const std::vector<int>& fixed) {
  OwnedSession session(organ.pack->get(), config_of(organ));
  session.fix(contact_nodes_at(organ, fixed));
  const auto results = settle(session, contacts);
  return errors_where_it_is(organ, session, contacts, results, fixed);
}

const std::vector<pal_contact> kPress = {{4, {0.03, -0.02, -0.1}, 0, {}, {}, {}}};
const std::vector<pal_contact> kApart = {{0, {0.03, 0, -0.08}, 0, {}, {}, {}},
                                         {8, {0, 0.04, 0.03}, 0, {}, {}, {}}};

// Fixed: the patch's own centre, and centres of neighbouring patches; with ten-node elements, and under
// gravity.
TEST(ZoneFixedNodes, IsTheFullSolveWhereTheZoneIsTheWholeOrgan) {
  const ZoneBlock& organ = tissue_block(8);
  for (const auto& sites : {std::vector<uint32_t>{5}, {4}, {0, 2, 4}}) {
    std::vector<int> fixed;
    for (const uint32_t site : sites) fixed.push_back(centre_of(organ, site));
    const ZoneErrors errors = errors_of(organ, kPress, fixed);
    EXPECT_LE(errors.field, field_tolerance(2e-6));
    EXPECT_LE(errors.force, 1e-6);
  }
  const ZoneBlock& heavy = tissue_block(8, false, {0, 0, -0.2});
  EXPECT_LE(errors_of(heavy, kPress, {centre_of(heavy, 1)}).force, 1e-6);
  const ZoneBlock& quadratic = tissue_block(8, true, Vector3d::Zero(), 2, 0.3);
  const std::vector<int>& patch = quadratic.block.sites.sites[0].patch_nodes;
  EXPECT_LE(errors_of(quadratic, {{0, {0.02, -0.01, -0.05}, 0, {}, {}, {}}}, {patch.back()}).force, 1e-6);
}

// A push of 1e-5 edges equals linear_dd, with fixed nodes in, between and outside zones.
TEST(ZoneFixedNodes, IsLinearForSmallDisplacements) {
  const ZoneBlock& organ = tissue_block(1, false, Vector3d::Zero(), 6, 0.18);
  const uint32_t last = static_cast<uint32_t>(organ.block.sites.sites.size()) - 1;
  const std::vector<pal_contact> contacts = {{0, {1e-6, 0, -2e-6}, 0, {}, {}, {}},
                                             {last, {0, 2e-6, 1e-6}, 0, {}, {}, {}}};
  for (const auto& sites : {std::vector<uint32_t>{12}, {0, 6}, {4, 20, 1, last}}) {
    std::vector<int> fixed;
    for (const uint32_t site : sites) fixed.push_back(centre_of(organ, site));
    OwnedSession zone(organ.pack->get(), config_of(organ));
    pal_session_config config = config_of(organ);
    config.model = PAL_MODEL_LINEAR;
    OwnedSession linear(organ.pack->get(), config);
    const std::vector<pal_real> free = (settle(zone, contacts), zone.field());
    zone.fix(contact_nodes_at(organ, fixed));
    linear.fix(contact_nodes_at(organ, fixed));
    const auto found = settle(zone, contacts);
    const auto expected = settle(linear, contacts);
    for (size_t c = 0; c < contacts.size(); ++c) {
      EXPECT_EQ(found[c].flags, 0U);
      const Vector3d force(expected[c].force);
      EXPECT_LE((Vector3d(found[c].force) - force).norm(), 5e-4 * force.norm()) << sites.size();
    }
    const Eigen::VectorXd field = as_vector(linear.field());
    EXPECT_LE((as_vector(zone.field()) - field).lpNorm<Eigen::Infinity>(), 5e-4 * 2.3e-6) << sites.size();
    EXPECT_GE((as_vector(free) - field).lpNorm<Eigen::Infinity>(), 2e-2 * 2.3e-6) << "it has to matter";
  }
}

// Two rings, a push of half an edge.
TEST(ZoneFixedNodes, IsTheFullSolveWithAnExterior) {
  const ZoneBlock& organ = tissue_block(2, false, Vector3d::Zero(), 6, 0.18);
  const std::vector<pal_contact> contacts = {{12, {0.02, -0.02, -0.07}, 0, {}, {}, {}}};
  for (const uint32_t site : {12U, 13U, 14U, 0U}) {
    const ZoneErrors errors = errors_of(organ, contacts, {centre_of(organ, site)});
    EXPECT_LE(errors.field, field_tolerance(2e-6)) << site;
    EXPECT_LE(errors.force, 1e-6) << site;
  }
}

TEST(ZoneFixedNodes, DoNotMoveAndLeaveNothingBehind) {
  const ZoneBlock& organ = tissue_block(2, false, Vector3d::Zero(), 4, 0.26, true);
  const int node = centre_of(organ, 5);
  OwnedSession session(organ.pack->get(), config_of(organ));
  for (const auto* contacts : {&kPress, &kApart}) {
    const auto before = settle(session, *contacts);
    EXPECT_GT(as_vector(session.field()).segment<3>(3 * node).norm(), 1e-3);
    session.fix(contact_nodes_at(organ, {node}));
    const auto held = settle(session, *contacts);
    EXPECT_EQ(as_vector(session.field()).segment<3>(3 * node).norm(), 0);
    EXPECT_GE((Vector3d(held[0].force) - Vector3d(before[0].force)).norm(),
              1e-3 * Vector3d(before[0].force).norm());
    session.fix({});
    const auto after = settle(session, *contacts);
    for (size_t c = 0; c < contacts->size(); ++c) {
      EXPECT_LE((Vector3d(after[c].force) - Vector3d(before[c].force)).norm(),
                1e-5 * Vector3d(before[c].force).norm());
    }
  }
}

// A whole patch is fixed: the tool moves no node.
TEST(ZoneFixedNodes, HoldAWholePatch) {
  const ZoneBlock& organ = tissue_block(2);
  OwnedSession session(organ.pack->get(), config_of(organ));
  session.fix(contact_nodes_at(organ, organ.block.sites.sites[4].patch_nodes));
  const auto results = settle(session, kPress);
  EXPECT_EQ(Vector3d(results[0].force).norm(), 0);
  EXPECT_EQ(as_vector(session.field()).norm(), 0);
}

// A closed path with fixed nodes does no work.
TEST(ZoneFixedNodes, GivesBackWhatItTakes) {
  const ZoneBlock& organ = tissue_block(2);
  OwnedSession session(organ.pack->get(), config_of(organ));
  session.fix(contact_nodes_at(organ, {centre_of(organ, 1), centre_of(organ, 5)}));
  double work = 0;
  double given = 0;
  Vector3d last_force = Vector3d::Zero();
  Vector3d last = Vector3d::Zero();
  constexpr int kFrames = 2000;
  for (int frame = 0; frame <= kFrames; ++frame) {
    const double angle = 2 * 3.14159265358979 * frame / kFrames;
    const Vector3d d = 0.08 * Vector3d(std::sin(angle), std::sin(2 * angle), -0.5 * (1 - std::cos(angle)));
    const auto result = session.touch({{4, {d[0], d[1], d[2]}, 0, {}, {}, {}}})[0];
    const Vector3d force(result.force);
    const double step = 0.5 * (force + last_force).dot(d - last);
    work += step;
    given += std::abs(step);
    last = d;
    last_force = force;
  }
  EXPECT_LE(std::abs(work), 1e-3 * given);
}

// More fixed nodes than a zone's capacity: linear_dd answers, with a flag.
TEST(ZoneFixedNodes, AreLinearWhereTheyAreMany) {
  const ZoneBlock& organ = tissue_block(1, false, Vector3d::Zero(), 8, 0.2);
  pal_session_config config = config_of(organ);
  config.model = PAL_MODEL_AUTO;
  OwnedSession session(organ.pack->get(), config);
  std::vector<uint32_t> many;
  for (uint32_t node = 0; node < 33; ++node) many.push_back(node);
  session.fix(many);
  const pal_contact contact = {24, {0, 0, -0.01}, 0, {}, {}, {}};
  EXPECT_EQ(session.touch({contact})[0].model, PAL_MODEL_LINEAR);
  many.pop_back();
  session.fix(many);
  EXPECT_EQ(session.touch({contact})[0].model, PAL_MODEL_ZONE);
}

}  // namespace zone_fixed_nodes_test
}  // namespace palpate::test
