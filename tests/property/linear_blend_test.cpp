// Several contacts between sites in linear_dd: the response is the blend of responses at the sites around
// them.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <random>

#include "tests/support/blended_answers.hpp"
#include "tests/support/compressed_pack.hpp"
#include "tests/support/small_pack.hpp"
#include "tests/support/tool_session.hpp"

namespace palpate::test {
namespace linear_blend_test {

using Contacts = std::vector<pal_contact>;

// Rounding of the same float64 sums in another order, where forces of near contacts nearly cancel.
constexpr double kForceTolerance = 1e-9;
constexpr double kFieldTolerance = field_tolerance(1e-5);

Eigen::Vector3d contact_force(const pal_contact_result& result) {
  return Eigen::Vector3d(result.force);
}

Eigen::Matrix3d stiffness_between(const pal_contact_result& result) {
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(&result.stiffness[0][0]);
}

class LinearBlends : public ::testing::Test {
 protected:
  explicit LinearBlends(const AlignedBytes& bytes = small_pack_bytes()) : pack_(bytes) {}

  Eigen::Vector3d any_displacement() {
    return 0.3 * kMaxDisplacement *
           Eigen::Vector3d(component_(random_), component_(random_), component_(random_));
  }

  // A random point on the touchable surface, sometimes a site or a point of an edge.
  pal_hold any_hold() {
    const pal_contact contact = any_contact();
    pal_hold hold = pal_default_hold(contact.site);
    for (int i = 0; i < 2; ++i) {
      hold.sites[i + 1] = contact.neighbours[i];
      hold.weights[i + 1] = contact.neighbour_weights[i];
    }
    hold.weights[0] = 1 - hold.weights[1] - hold.weights[2];
    return hold;
  }

  // Three tools that hold the same points, with and without a budget, and their poses.
  struct Grasped {
    ToolSession at_once;
    ToolSession tools;
    std::vector<pal_pose> poses;
  };
  Grasped grasp_between_sites() {
    const pal_session_config config = session_config(pack_.get(), PAL_MODEL_LINEAR, 3, 4);
    pal_session_config bounded = config;
    bounded.budget_operations = 5000;
    Grasped grasped = {{pack_.get(), config}, {pack_.get(), bounded}, {}};
    for (uint32_t tool = 0; tool < 3; ++tool) {
      const pal_hold hold = any_hold();
      for (ToolSession* session : {&grasped.tools, &grasped.at_once}) session->hold(tool, hold);
      grasped.poses.push_back(at(any_displacement()));
    }
    return grasped;
  }

  pal_contact any_contact() {
    const pal_geometry geometry = pack_.face().geometry();
    const Eigen::Map<const Eigen::Matrix3Xd> nodes(geometry.positions, 3, geometry.num_nodes);
    const Eigen::Vector3d low = nodes.rowwise().minCoeff();
    const Eigen::Vector3d size = nodes.rowwise().maxCoeff() - low;
    const Eigen::Vector3d place(low +
                                Eigen::Vector3d(share_(random_), share_(random_), 1).cwiseProduct(size));
    pal_surface_point point;
    require(pal_pack_find_surface_point(pack_.get(), place.data(), &point), "surface point");
    pal_contact contact = pal_contact_at(&point, any_displacement().data());
    const double kind = share_(random_);
    if (kind < 0.4) contact.neighbour_weights[1] = 0;
    if (kind < 0.2) contact.neighbour_weights[0] = 0;
    return contact;
  }

  void expect_blend(OwnedSession& session, const Contacts& contacts) {
    const BlendedAnswers sum = blend_answers(at_sites_, contacts);
    const auto results = session.touch(contacts);
    EXPECT_NEAR(session.get()->tissue.stored_energy, sum.energy, kForceTolerance * std::abs(sum.energy));
    double largest = 0;
    double stiffest = 0;
    for (size_t c = 0; c < contacts.size(); ++c) {
      largest = std::max(largest, sum.forces[c].norm());
      stiffest = std::max(stiffest, sum.stiffness[c].norm());
    }
    for (size_t c = 0; c < contacts.size(); ++c) {
      EXPECT_LE((contact_force(results[c]) - sum.forces[c]).norm(), kForceTolerance * largest)
          << "contact " << c;
      EXPECT_LE((stiffness_between(results[c]) - sum.stiffness[c]).norm(), kForceTolerance * stiffest);
      EXPECT_EQ(stiffness_between(results[c]), stiffness_between(results[c]).transpose());
      EXPECT_EQ(results[c].flags & PAL_FLAG_NEAREST_SITE, 0U);
    }
    EXPECT_LE((as_vector(session.field()) - sum.field).lpNorm<Eigen::Infinity>(),
              kFieldTolerance * std::max(sum.field.lpNorm<Eigen::Infinity>(), 0.01 * kMaxDisplacement));
  }

  OpenPack pack_;
  OwnedSession session_{pack_.get(), PAL_MODEL_LINEAR, 3, 4};
  OwnedSession at_sites_{pack_.get(), PAL_MODEL_LINEAR, 3, 4};
  std::mt19937_64 random_{11};
  std::uniform_real_distribution<double> component_{-1, 1};
  std::uniform_real_distribution<double> share_{0, 1};
};

class LinearBlendsOfASurface : public LinearBlends {
 protected:
  LinearBlendsOfASurface() : LinearBlends(dense_surface_pack()) {}
};

class LinearBlendsOfACompressedSurface : public LinearBlends {
 protected:
  LinearBlendsOfACompressedSurface() : LinearBlends(compressed_surface_pack()) {}
};

TEST_F(LinearBlends, AreTheMeanOverAllCorners) {
  for (int i = 0; i < 20; ++i) {
    expect_blend(session_, {any_contact(), any_contact()});
    expect_blend(session_, {any_contact(), any_contact(), any_contact()});
  }
}

TEST_F(LinearBlendsOfASurface, AreTheMeanOverAllCorners) {
  for (int i = 0; i < 5; ++i) expect_blend(session_, {any_contact(), any_contact(), any_contact()});
}

TEST_F(LinearBlendsOfACompressedSurface, AreTheMeanOverAllCorners) {
  for (int i = 0; i < 3; ++i) expect_blend(session_, {any_contact(), any_contact(), any_contact()});
}

// Sets are reused: contacts of other sessions and other fixed nodes before leave no trace.
TEST_F(LinearBlends, DoNotDependOnThePast) {
  OwnedSession many(pack_.get(), PAL_MODEL_LINEAR, 5, 4);
  Contacts contacts = {any_contact(), any_contact(), any_contact()};
  for (int i = 0; i < 60; ++i) {
    const auto kind = static_cast<int>(7 * share_(random_));
    if (kind < 3) contacts[static_cast<size_t>(kind)] = any_contact();
    if (kind == 3) many.touch({any_contact(), any_contact(), any_contact(), any_contact(), any_contact()});
    if (kind == 4) many.touch({any_contact()});
    if (kind == 5) {
      const std::vector<uint32_t> fixed = {static_cast<uint32_t>(10 * share_(random_))};
      many.fix(fixed);
      at_sites_.fix(fixed);
    }
    expect_blend(many, contacts);
  }
}

TEST_F(LinearBlends, HoldFixedNodes) {
  const std::vector<int> labels = {54, 59};
  std::vector<uint32_t> fixed(labels.size());
  for (size_t i = 0; i < labels.size(); ++i)
    require(pal_pack_find_contact_node(pack_.get(), labels[i], &fixed[i]), "contact node");
  session_.fix(fixed);
  at_sites_.fix(fixed);
  const pal_geometry geometry = pack_.face().geometry();
  for (int i = 0; i < 5; ++i) {
    expect_blend(session_, {any_contact()});
    expect_blend(session_, {any_contact(), any_contact()});
    const Eigen::VectorXd field = as_vector(session_.field());
    for (uint32_t node = 0; node < geometry.num_nodes; ++node) {
      const bool is_fixed = std::count(labels.begin(), labels.end(), geometry.labels[node]) > 0;
      if (!is_fixed) continue;
      EXPECT_LE(field.segment<3>(3 * node).norm(), kFieldTolerance * kMaxDisplacement);
    }
  }
}

// Betti: the work of one state's forces on the other state's displacements is mutual.
TEST_F(LinearBlends, AreReciprocal) {
  Contacts one = {any_contact(), any_contact(), any_contact()};
  Contacts other = one;
  for (pal_contact& contact : other) {
    const Eigen::Vector3d d = any_displacement();
    std::copy_n(d.data(), 3, contact.displacement);
  }
  const auto of_one = session_.touch(one);
  const auto of_other = session_.touch(other);
  double there = 0;
  double back = 0;
  for (size_t c = 0; c < 3; ++c) {
    there += contact_force(of_one[c]).dot(Eigen::Vector3d(other[c].displacement));
    back += contact_force(of_other[c]).dot(Eigen::Vector3d(one[c].displacement));
  }
  EXPECT_GT(std::abs(there), 1e-6);
  EXPECT_LE(std::abs(there - back), kForceTolerance * std::abs(there));
}

TEST_F(LinearBlends, TakeGivenForces) {
  for (const size_t count : {1U, 2U, 3U}) {
    Contacts contacts;
    for (size_t c = 0; c < count; ++c) {
      contacts.push_back(any_contact());
      contacts[c].force_axes = c == 1 ? 5 : 7;
      const Eigen::Vector3d force = 0.01 * Eigen::Vector3d(component_(random_), component_(random_), -1);
      std::copy_n(force.data(), 3, contacts[c].force);
    }
    const auto results = session_.touch(contacts);
    Contacts moved = contacts;
    for (size_t c = 0; c < count; ++c) {
      for (uint32_t axis = 0; axis < 3; ++axis) {
        if ((contacts[c].force_axes >> axis & 1) == 0) continue;
        EXPECT_NEAR(results[c].force[axis], contacts[c].force[axis], 1e-8) << count << " " << c;
      }
      std::copy_n(results[c].displacement, 3, moved[c].displacement);
      moved[c].force_axes = 0;
    }
    const auto again = session_.touch(moved);
    for (size_t c = 0; c < count; ++c)
      EXPECT_LE((contact_force(again[c]) - contact_force(results[c])).norm(), 1e-8) << count << " " << c;
  }
}

// More than three contacts act at their nearest sites, with a flag.
TEST_F(LinearBlends, AreOfThreeContactsAtMost) {
  OwnedSession many(pack_.get(), PAL_MODEL_LINEAR, 4, 0);
  pal_contact between = {4, {0, 0, -0.02}, 0, {}, {5, 0}, {0.6, 0}};
  const Contacts others = {
      {0, {0, 0, -0.01}, 0, {}, {}, {}}, {3, {0.01, 0, 0}, 0, {}, {}, {}}, {9, {0, 0.01, 0}, 0, {}, {}, {}}};
  const auto results = many.touch({between, others[0], others[1], others[2]});
  const pal_contact nearest = {5, {0, 0, -0.02}, 0, {}, {}, {}};
  const auto expected = many.touch({nearest, others[0], others[1], others[2]});
  EXPECT_TRUE(results[0].flags & PAL_FLAG_NEAREST_SITE);
  EXPECT_FALSE(results[1].flags & PAL_FLAG_NEAREST_SITE);
  for (size_t c = 0; c < 4; ++c) {
    EXPECT_LE((contact_force(results[c]) - contact_force(expected[c])).norm(),
              1e-10 * contact_force(expected[c]).norm());
    EXPECT_EQ(results[c].displacement_error, 1.0);
  }
}

// Two contacts slide past each other over many triangles, a hundredth of an edge at a time. A third contact
// stays.
TEST_F(LinearBlendsOfASurface, SlideWithoutAJump) {
  const double edge = pack_.info().mean_surface_edge;
  const auto on_top = [&](double x, double y, const Eigen::Vector3d& d) {
    const Eigen::Vector3d place(x, y, 1);
    pal_surface_point point;
    require(pal_pack_find_surface_point(pack_.get(), place.data(), &point), "surface point");
    return pal_contact_at(&point, d.data());
  };
  const auto at_nearest = [](pal_contact contact) {
    const double rest = 1 - contact.neighbour_weights[0] - contact.neighbour_weights[1];
    for (int i = 0; i < 2; ++i) {
      const double other = contact.neighbour_weights[1 - i];
      if (contact.neighbour_weights[i] > rest && contact.neighbour_weights[i] >= other)
        contact.site = contact.neighbours[i];
    }
    contact.neighbour_weights[0] = contact.neighbour_weights[1] = 0;
    return contact;
  };
  const int steps = static_cast<int>(0.6 / (0.01 * edge));
  std::vector<pal_contact_result> before;
  std::vector<pal_contact_result> nearest_before;
  Eigen::VectorXd field_before;
  double peak = 0;
  double jump = 0;
  double nearest_jump = 0;
  double field_jump = 0;
  for (int i = 0; i <= steps; ++i) {
    const double way = 0.6 * i / steps;
    const Contacts contacts = {on_top(0.2 + way, 0.4, {0.02, -0.01, -0.05}),
                               on_top(0.82 - way, 0.73, {-0.01, 0.02, -0.04}),
                               on_top(0.52, 0.15, {0, 0.01, -0.05})};
    Contacts nearest = contacts;
    for (pal_contact& contact : nearest) contact = at_nearest(contact);
    const auto of_nearest = at_sites_.touch(nearest);
    const auto results = session_.touch(contacts);
    const Eigen::VectorXd field = as_vector(session_.field());
    for (size_t c = 0; c < contacts.size(); ++c) {
      peak = std::max(peak, contact_force(results[c]).norm());
      if (i == 0) continue;
      jump = std::max(jump, (contact_force(results[c]) - contact_force(before[c])).norm());
      nearest_jump =
          std::max(nearest_jump, (contact_force(of_nearest[c]) - contact_force(nearest_before[c])).norm());
    }
    if (i > 0) field_jump = std::max(field_jump, (field - field_before).lpNorm<Eigen::Infinity>());
    before = results;
    nearest_before = of_nearest;
    field_before = field;
  }
  EXPECT_LE(jump, 0.01 * peak);
  EXPECT_GE(nearest_jump, 3 * jump);
  EXPECT_LE(field_jump, 0.02 * 0.06);
}

// A tool's stiffness sums over all its contacts, with their interaction.
TEST_F(LinearBlends, ArePartsOfATool) {
  ToolSession tools(pack_.get(), session_config(pack_.get(), PAL_MODEL_LINEAR, 3, 0));
  for (int i = 0; i < 3; ++i) tools.hold(0, any_hold());
  const Eigen::Vector3d place = any_displacement();
  const auto force_at = [&](const Eigen::Vector3d& p) { return force_of(tools.frame({at(p)})[0]); };
  const Eigen::Matrix3d stiffness = stiffness_of(tools.frame({at(place)})[0]);
  const double step = 0.1 * kMaxDisplacement;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d by = step * Eigen::Vector3d::Unit(axis);
    EXPECT_LE(((force_at(place + by) - force_at(place)) / step - stiffness.col(axis)).norm(),
              kForceTolerance * stiffness.norm());
  }
}

// Contacts of another caller, or other fixed nodes, interrupt a blend under preparation.
TEST_F(LinearBlends, InterruptionsDelayButDoNotMislead) {
  Grasped grasped = grasp_between_sites();
  auto& [at_once, tools, poses] = grasped;
  const Contacts others = {any_contact(), any_contact()};
  for (int frame = 0; frame < 60; ++frame) {
    EXPECT_TRUE(force_of(tools.frame(poses)[0]).allFinite());
    if (frame % 20 == 7) expect_blend(tools, others);
    if (frame % 20 != 14) continue;
    const std::vector<uint32_t> fixed = {static_cast<uint32_t>(frame / 10)};
    for (OwnedSession* session :
         {static_cast<OwnedSession*>(&tools), static_cast<OwnedSession*>(&at_once), &at_sites_})
      session->fix(fixed);
  }
  int frames = 0;
  while ((tools.frame(poses)[0].flags & PAL_FLAG_PREPARING) != 0) ASSERT_LT(++frames, 10000);
  EXPECT_GT(frames, 10);
  const auto& expected = at_once.frame(poses);
  for (size_t tool = 0; tool < 3; ++tool) EXPECT_TRUE(are_alike(tools.last()[tool], expected[tool])) << tool;
}

// Tools hold points between sites, and their blend takes many frames to prepare.
TEST_F(LinearBlends, ArePreparedWithinABudget) {
  Grasped grasped = grasp_between_sites();
  auto& [at_once, tools, poses] = grasped;
  int frames = 0;
  while ((tools.frame(poses)[0].flags & PAL_FLAG_PREPARING) != 0) ASSERT_LT(++frames, 10000);
  EXPECT_GT(frames, 27);
  const auto& expected = at_once.frame(poses);
  for (size_t tool = 0; tool < 3; ++tool) {
    EXPECT_LE((force_of(tools.last()[tool]) - force_of(expected[tool])).norm(),
              kForceTolerance * force_of(expected[tool]).norm());
    EXPECT_EQ(tools.last()[tool].flags & PAL_FLAG_NEAREST_SITE, 0U);
  }
  EXPECT_LE((as_vector(tools.field()) - as_vector(at_once.field())).lpNorm<Eigen::Infinity>(),
            kFieldTolerance * kMaxDisplacement);
}

}  // namespace linear_blend_test
}  // namespace palpate::test
