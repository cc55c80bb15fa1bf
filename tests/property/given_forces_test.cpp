// Contacts with a prescribed force along some axes and a prescribed displacement along the others.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <limits>
#include <random>

#include "tests/support/dense_reference.hpp"
#include "tests/support/runtime_session.hpp"
#include "tests/support/small_pack.hpp"

namespace palpate::test {
namespace given_forces_test {

// Two float64 factorisations, as in runtime_linear_dd_test.cpp.
constexpr double kForceTolerance = 1e-10;
constexpr double kFieldTolerance = field_tolerance(1e-5);
constexpr double kNotRead = 77;  // fills the entries that the runtime must not read

Eigen::Vector3d vector(const double numbers[3]) {
  return Eigen::Vector3d(numbers[0], numbers[1], numbers[2]);
}

class GivenForces : public ::testing::Test {
 protected:
  GivenForces() : pack_(small_pack_bytes()), session_(pack_.get(), PAL_MODEL_LINEAR, 4, 8) {}

  pal_contact contact(uint32_t site, uint32_t force_axes) {
    std::uniform_real_distribution<double> component(-1, 1);
    pal_contact contact = {site, {}, force_axes, {}, {}, {}};
    for (uint32_t axis = 0; axis < 3; ++axis) {
      const bool given = (force_axes >> axis & 1) != 0;
      contact.displacement[axis] = given ? kNotRead : 0.3 * kMaxDisplacement * component(random_);
      contact.force[axis] = given ? 0.01 * component(random_) : kNotRead;
    }
    return contact;
  }

  // The result has the prescribed values. The found displacements, prescribed in turn, give the same forces
  // and field. Both match a dense solve of the whole organ.
  void expect_right(const std::vector<pal_contact>& contacts) {
    const auto results = session_.touch(contacts);
    const std::vector<pal_real> field = session_.field();
    std::vector<pal_contact> moved = contacts;
    std::vector<std::pair<size_t, Eigen::Vector3d>> held;
    double largest = 0;
    for (size_t c = 0; c < contacts.size(); ++c) {
      largest = std::max(largest, vector(results[c].force).norm());
      std::copy_n(results[c].displacement, 3, moved[c].displacement);
      moved[c].force_axes = 0;
      held.emplace_back(contacts[c].site, vector(results[c].displacement));
    }
    ASSERT_GT(largest, 0);
    const auto again = session_.touch(moved);
    const DenseReference::Answer truth = dense_.solve(dense_.hold(held, {}));
    for (size_t c = 0; c < contacts.size(); ++c) {
      for (uint32_t axis = 0; axis < 3; ++axis) {
        const bool given = (contacts[c].force_axes >> axis & 1) != 0;
        if (given) {
          EXPECT_NEAR(results[c].force[axis], contacts[c].force[axis], kForceTolerance * largest);
        } else {
          EXPECT_EQ(results[c].displacement[axis], contacts[c].displacement[axis]);
        }
      }
      EXPECT_LE((vector(results[c].force) - vector(again[c].force)).norm(), kForceTolerance * largest);
      EXPECT_LE((vector(results[c].force) - dense_.tool_force(held, c, {}, truth)).norm(),
                kForceTolerance * largest);
      EXPECT_EQ(results[c].model, PAL_MODEL_LINEAR);
    }
    const Eigen::VectorXd expected = dense_.packed(truth.field);
    for (size_t i = 0; i < field.size(); ++i) {
      EXPECT_NEAR(static_cast<double>(field[i]), expected[static_cast<Eigen::Index>(i)],
                  kFieldTolerance * expected.lpNorm<Eigen::Infinity>());
    }
  }

  std::mt19937_64 random_{5};
  const SmallPack& small_ = small_pack();
  Assembly assembly_{small_.model, small_.model.fixed_dofs()};
  DenseReference dense_{assembly_, small_.sites};
  OpenPack pack_;
  OwnedSession session_;
};

TEST_F(GivenForces, EveryChoiceOfAxesOfOneContact) {
  for (uint32_t axes = 0; axes < 8; ++axes) {
    SCOPED_TRACE(axes);
    expect_right({contact(4, axes)});
  }
}

TEST_F(GivenForces, EveryChoiceOfAxesOfSeveralContacts) {
  for (uint32_t axes = 0; axes < 64; axes += 5) {
    SCOPED_TRACE(axes);
    expect_right({contact(0, axes % 8), contact(5, axes / 8), contact(11, (axes * 3) % 8)});
  }
}

// A contact with zero force follows the other contacts.
TEST_F(GivenForces, ZeroForcesFollowTheOtherContacts) {
  pal_contact free = contact(11, 7);
  std::fill_n(free.force, 3, 0.0);
  const auto results = session_.touch({{0, {0.02, 0.01, -0.02}, 0, {}, {}, {}}, free});
  EXPECT_LE(vector(results[1].force).norm(), kForceTolerance * vector(results[0].force).norm());
  EXPECT_GT(vector(results[1].displacement).norm(), 0);
}

TEST_F(GivenForces, OnFixedNodesMoveNothingAndAreFlagged) {
  const std::vector<int>& patch = small_.sites.sites[4].patch;
  session_.fix({patch.begin(), patch.end()});
  const auto result = session_.touch({contact(4, 7)}).front();
  EXPECT_TRUE(result.flags & PAL_FLAG_ILL_CONDITIONED);
  EXPECT_EQ(vector(result.displacement).norm(), 0);
  EXPECT_EQ(vector(result.force).norm(), 0);
}

TEST_F(GivenForces, AbsurdOnesAreCut) {
  for (const double size : {1e12, 1e300}) {
    pal_contact pushed = contact(4, 4);
    pushed.force[2] = -size;
    const auto results = session_.touch({pushed, contact(11, 3)});
    EXPECT_TRUE(results[0].flags & PAL_FLAG_CLAMPED);
    EXPECT_TRUE(all_finite(results[0]));
    EXPECT_LE(vector(results[0].displacement).norm(), 2e6 * kMaxDisplacement);
    EXPECT_TRUE(all_finite(session_.field()));
  }
}

TEST_F(GivenForces, OnlyEntriesInUseMustBeFinite) {
  pal_contact pushed = contact(4, 4);
  const auto expected = session_.touch({pushed}).front();
  for (const double unread : {0.0, 1e300, std::nan(""), std::numeric_limits<double>::infinity()}) {
    pushed.displacement[2] = pushed.force[0] = unread;
    const auto result = session_.touch({pushed}).front();
    EXPECT_EQ(vector(result.force), vector(expected.force)) << unread;
    EXPECT_EQ(vector(result.displacement), vector(expected.displacement)) << unread;
    EXPECT_EQ(result.flags, expected.flags);
  }
  pushed.force[2] = std::nan("");
  EXPECT_EQ(pal_contact_frame(session_.get(), &pushed, 1, nullptr), PAL_STATUS_NOT_FINITE);
  pushed = contact(4, 8);
  EXPECT_EQ(pal_contact_frame(session_.get(), &pushed, 1, nullptr), PAL_STATUS_BAD_ARGUMENT);
}

TEST_F(GivenForces, NeedLinearDd) {
  const pal_contact pushed = contact(4, 4);
  OwnedSession automatic(pack_.get(), PAL_MODEL_AUTO, 2, 0);
  const auto result = automatic.touch({pushed}).front();
  EXPECT_EQ(result.model, PAL_MODEL_LINEAR);
  EXPECT_TRUE(result.flags & PAL_FLAG_LINEAR_FALLBACK);
  OwnedSession polynomial(pack_.get(), PAL_MODEL_POLYNOMIAL, 2, 0);
  EXPECT_EQ(pal_contact_frame(polynomial.get(), &pushed, 1, nullptr), PAL_STATUS_MODEL_CANNOT_ANSWER);
}

// Forces are in newtons where the scene states its units.
TEST_F(GivenForces, AreInNewtons) {
  const pal_contact pushed = contact(4, 7);
  const auto plain = session_.touch({pushed}).front();
  const AlignedBytes bytes = small_.write_with_units();
  const OpenPack pack(bytes);
  OwnedSession session(pack.get(), PAL_MODEL_LINEAR, 1, 0);
  pal_contact scaled = pushed;
  for (double& component : scaled.force) component *= 1e-3;
  const auto result = session.touch({scaled}).front();
  EXPECT_LE((vector(result.displacement) - 1e-3 * vector(plain.displacement)).norm(),
            1e-12 * vector(result.displacement).norm());
}

}  // namespace given_forces_test
}  // namespace palpate::test
