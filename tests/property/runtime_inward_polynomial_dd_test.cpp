// Polynomials sampled only for inward displacements, which fade to linear_dd behind the surface.
#include <gtest/gtest.h>

#include "tests/support/runtime_polynomial_dd_fixture.hpp"

namespace palpate::test::runtime_polynomial_dd_fixture {
namespace runtime_inward_polynomial_dd_test {

// ---- Sites sampled only for inward displacements

class InwardTest : public PolynomialDdTest {
 protected:
  using PolynomialDdTest::PolynomialDdTest;

  // A displacement with d . n |A n| = c and |A d| = reach.
  Eigen::Vector3d tilted(uint32_t site, double c, double reach) {
    const Eigen::Vector3d n = normal(site);
    const Eigen::Matrix3d& A = polynomial(site).to_unit;
    const Eigen::Vector3d any = any_direction();
    const Eigen::Vector3d across = any - any.dot(n) * n;
    const Eigen::Vector3d start = c / (A * n).norm() * n;
    // |A (start + t across)| = reach
    const double a = (A * across).squaredNorm();
    const double b = (A * across).dot(A * start);
    const double t = (-b + std::sqrt(b * b - a * (c * c - reach * reach))) / a;
    return start + t * across;
  }
};

class InwardPolynomialDd : public InwardTest, public ::testing::WithParamInterface<Kind> {
 protected:
  InwardPolynomialDd() : InwardTest(organ(GetParam(), true)) {}
};

INSTANTIATE_TEST_SUITE_P(, InwardPolynomialDd, kKinds, name_of);

class InwardFittedPolynomialDd : public InwardTest {
 protected:
  InwardFittedPolynomialDd() : InwardTest(organ(Kind::fitted, true)) {}
};

TEST_F(InwardFittedPolynomialDd, InsideItIsThePlainPolynomial) {
  const OpenPack plain(small_pack_bytes());
  OwnedSession session(plain.get(), PAL_MODEL_POLYNOMIAL, 1, 0);
  for (uint32_t site = 0; site < 12; ++site) {
    const Eigen::Vector3d d = tilted(site, 0.3, 0.8);
    const auto result = touch(site, d);
    EXPECT_EQ(result.flags, 0U);
    EXPECT_EQ(result.displacement_error, small_.surveys[1].table.bins.back().displacement.bound);
    const auto expected = session.touch({{site, {d[0], d[1], d[2]}, 0, {}, {}, {}}}).front();
    const Eigen::Vector3d force(expected.force);
    EXPECT_LE((Eigen::Vector3d(result.force) - force).norm(),
              1e-14 * force.norm());  // the same sum in another order
    EXPECT_EQ(session_.field(), session.field());
  }
}

TEST_P(InwardPolynomialDd, BehindTheSurfaceItSaysSo) {
  OwnedSession linear(pack_.get(), PAL_MODEL_LINEAR, 1, 0);
  for (uint32_t site = 0; site < 12; ++site) {
    for (const double c : {-1e-3, -0.2, -0.7}) {
      const Eigen::Vector3d d = tilted(site, c, 0.8);
      const auto result = touch(site, d);
      EXPECT_EQ(result.flags, static_cast<uint32_t>(PAL_FLAG_EXTRAPOLATED));
      EXPECT_EQ(result.displacement_error, 1);
      EXPECT_EQ(result.force_error, 1);
      const auto other = linear.touch({{site, {d[0], d[1], d[2]}, 0, {}, {}, {}}}).front();
      EXPECT_EQ(other.flags, static_cast<uint32_t>(PAL_FLAG_EXTRAPOLATED));
      EXPECT_EQ(other.displacement_error, 1);
    }
  }
}

TEST_F(InwardFittedPolynomialDd, DeepBehindTheSurfaceItIsTheExactLinearAnswer) {
  OwnedSession linear(pack_.get(), PAL_MODEL_LINEAR, 1, 0);
  for (uint32_t site = 0; site < 12; ++site) {
    const Eigen::Vector3d d = tilted(site, -0.6, 0.9);
    const Eigen::Vector3d f = force(site, d);
    const auto expected = linear.touch({{site, {d[0], d[1], d[2]}, 0, {}, {}, {}}}).front();
    EXPECT_LE((f - Eigen::Vector3d(expected.force)).norm(), 1e-9 * f.norm());  // two float64 factorisations
    const std::vector<pal_real> field = session_.field();
    const std::vector<pal_real> linear_field = linear.field();
    for (size_t i = 0; i < field.size(); ++i)
      EXPECT_NEAR(field[i], linear_field[i], field_tolerance(2e-6) * d.norm());
  }
}

// Points of the fade, before and after, inside and outside the ellipsoid.
constexpr double kFades[] = {0.3, -0.05, -0.25, -0.45, -0.55};

TEST_P(InwardPolynomialDd, ForceAndStiffnessAreThoseOfTheFadedEnergy) {
  for (uint32_t site = 0; site < 12; ++site) {
    for (const double c : kFades) {
      for (const double reach : {0.8, 1.5}) {
        const Eigen::Vector3d d = tilted(site, c, reach);
        expect_gradient_of_packed_energy(site, d);
        expect_stiffness_is_slope(site, d);
      }
    }
  }
}

TEST_P(InwardPolynomialDd, FieldIsThePackedPolynomialFaded) {
  for (uint32_t site = 0; site < 12; ++site) {
    for (const double c : kFades) {
      for (const double reach : {0.8, 1.5}) expect_packed_field(site, tilted(site, c, reach));
    }
  }
}

TEST_P(InwardPolynomialDd, StiffnessHasNoStepWhereItBeginsOrEndsToFade) {
  constexpr double kGap = 1e-6;
  for (uint32_t site = 0; site < 12; ++site) {
    for (const double c : {0.0, -0.5}) {
      const Eigen::Vector3d d = tilted(site, c, 0.8);
      const Eigen::Vector3d gap = kGap * reach(site) * normal(site);
      const Eigen::Matrix3d S = stiffness_of(touch(site, d + gap));
      EXPECT_LE((stiffness_of(touch(site, d - gap)) - S).norm(), 1e3 * kGap * S.norm());
    }
  }
}

}  // namespace runtime_inward_polynomial_dd_test
}  // namespace palpate::test::runtime_polynomial_dd_fixture
