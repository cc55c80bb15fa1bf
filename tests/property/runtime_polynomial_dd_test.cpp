// The runtime's polynomial_dd: conservative, smooth across the edge of the sampled domain, and equal to the
// packed polynomial to rounding.
#include <gtest/gtest.h>

#include "tests/support/runtime_polynomial_dd_fixture.hpp"

namespace palpate::test::runtime_polynomial_dd_fixture {
namespace runtime_polynomial_dd_test {

// All kinds of fit and of storage.
class RuntimePolynomialDd : public PolynomialDdTest, public ::testing::WithParamInterface<Kind> {
 protected:
  RuntimePolynomialDd() : PolynomialDdTest(organ(GetParam(), false)) {}
};

INSTANTIATE_TEST_SUITE_P(, RuntimePolynomialDd, kKinds, name_of);

// The fit of the small organ.
class FittedPolynomialDd : public PolynomialDdTest {
 protected:
  FittedPolynomialDd() : PolynomialDdTest(organ(Kind::fitted, false)) {}
};

// |A d|: inside, near the edge on both sides, outside.
constexpr double kReaches[] = {0.05, 0.5, 0.97, 0.9999, 1.0001, 1.03, 1.7, 3.9};

TEST_P(RuntimePolynomialDd, ForceIsTheGradientOfThePackedEnergy) {
  for (uint32_t site = 0; site < 12; ++site) {
    for (const double reach : kReaches)
      expect_gradient_of_packed_energy(site, at(site, reach * any_direction()));
  }
}

TEST_P(RuntimePolynomialDd, StiffnessIsTheDerivativeOfTheForce) {
  for (uint32_t site = 0; site < 12; ++site) {
    for (const double reach : kReaches) expect_stiffness_is_slope(site, at(site, reach * any_direction()));
  }
}

TEST_P(RuntimePolynomialDd, FieldIsThePackedPolynomial) {
  for (uint32_t site = 0; site < 12; ++site) {
    for (const double reach : kReaches) expect_packed_field(site, at(site, reach * any_direction()));
  }
}

// Across |x| = 1 force and stiffness are continuous: the jump over a gap is as small as the gap.
TEST_P(RuntimePolynomialDd, ContinuousAcrossTheEdgeOfTheSamples) {
  constexpr double kGap = 2e-9;
  for (uint32_t site = 0; site < 12; ++site) {
    const Eigen::Vector3d edge = at(site, any_direction());
    const auto inside = touch(site, (1 - kGap) * edge);
    const Eigen::VectorXd field_inside = as_vector(session_.field());
    const auto outside = touch(site, (1 + kGap) * edge);
    const Eigen::VectorXd field_outside = as_vector(session_.field());
    EXPECT_EQ(inside.flags, 0U);
    EXPECT_EQ(outside.flags, static_cast<uint32_t>(PAL_FLAG_EXTRAPOLATED));
    const Eigen::Matrix3d S = stiffness_of(inside);
    // The expected change over the gap is of first order. Ten times the change bounds the next term of the
    // stiffness.
    EXPECT_LE((Eigen::Vector3d(outside.force) - Eigen::Vector3d(inside.force)).norm(),
              10 * kGap * edge.norm() * S.norm());
    EXPECT_LE((stiffness_of(outside) - S).norm(), 100 * kGap * S.norm());
    const PackedField packed = packed_field_at(site, edge);
    EXPECT_LE((field_outside - field_inside).lpNorm<Eigen::Infinity>(),
              100 * kGap * packed.field.lpNorm<Eigen::Infinity>() + 2 * packed.rounding);
  }
}

// The scene's largest displacement belongs to the domain, whatever units do to its last digit.
TEST_F(FittedPolynomialDd, TheEdgeItselfIsInside) {
  const AlignedBytes bytes = small_.write_with_units();
  const OpenPack in_units(bytes);
  OwnedSession session(in_units.get(), PAL_MODEL_POLYNOMIAL, 1, 0);
  for (uint32_t site = 0; site < 12; ++site) {
    for (int i = 0; i < 20; ++i) {
      const Eigen::Vector3d d = at(site, any_direction());
      EXPECT_EQ(touch(site, d).flags, 0U);
      const auto result =
          session.touch({{site, {1e-3 * d[0], 1e-3 * d[1], 1e-3 * d[2]}, 0, {}, {}, {}}}).front();
      EXPECT_EQ(result.flags, 0U);
    }
  }
}

TEST_F(FittedPolynomialDd, LinearPartIsTheExactLinearStiffness) {
  OwnedSession linear(pack_.get(), PAL_MODEL_LINEAR, 1, 0);
  for (uint32_t site = 0; site < 12; ++site) {
    const Eigen::Matrix3d S = stiffness_of(touch(site, Eigen::Vector3d::Zero()));
    const Eigen::Matrix3d expected = stiffness_of(linear.touch({{site, {0, 0, 0}, 0, {}, {}, {}}}).front());
    EXPECT_LE((S - expected).norm(), 1e-9 * expected.norm());  // two float64 factorisations
    EXPECT_EQ(force(site, Eigen::Vector3d::Zero()).norm(), 0);
  }
}

// Work around a closed polygon, over the work on its sides.
struct ClosedWork {
  double total = 0;
  double moved = 0;
};

template <typename Work>
ClosedWork around(const std::vector<Eigen::Vector3d>& corners, const Work& work) {
  ClosedWork result;
  for (size_t i = 0; i < corners.size(); ++i) {
    const double piece = work(corners[i], corners[(i + 1) % corners.size()]);
    result.total += piece;
    result.moved += std::abs(piece);
  }
  return result;
}

constexpr double kClosedWork = 1e-12;  // rounding of 500 forces

// Closed paths do no work: inside, across the edge, and outside.
TEST_P(RuntimePolynomialDd, ClosedPathsDoNoWork) {
  for (uint32_t site = 0; site < 12; site += 3) {
    for (const double reach : {0.6, 1.3, 3.0}) {
      std::vector<Eigen::Vector3d> corners(6);
      for (Eigen::Vector3d& corner : corners) corner = at(site, reach * any_direction());
      const ClosedWork closed =
          around(corners, [&](const auto& a, const auto& b) { return work(site, a, b); });
      EXPECT_GT(closed.moved, 0);
      EXPECT_LE(std::abs(closed.total), kClosedWork * closed.moved) << "site " << site << " reach " << reach;
    }
  }
}

// Breaks the check on purpose: a force with a millionth of a swirl about z is no gradient.
TEST_F(FittedPolynomialDd, WorkOfASwirlIsSeen) {
  const double r = 0.5 * reach(0);
  const double swirl = 1e-6 * force(0, {r, 0, 0}).norm() / r;
  const ClosedWork closed =
      around({{r, 0, 0}, {0, r, 0}, {-r, 0, 0}, {0, -r, 0}}, [&](const auto& a, const auto& b) {
        return work(0, a, b, [&](const Eigen::Vector3d& d) -> Eigen::Vector3d {
          return force(0, d) + swirl * Eigen::Vector3d(-d.y(), d.x(), 0);
        });
      });
  EXPECT_NEAR(closed.total, 2 * swirl * 2 * r * r, 1e-4 * std::abs(closed.total)) << "curl times area";
  EXPECT_GT(std::abs(closed.total), kClosedWork * closed.moved);
}

TEST_P(RuntimePolynomialDd, WorkIsTheChangeOfStoredEnergy) {
  for (uint32_t site = 0; site < 12; site += 4) {
    for (const double reach : {0.8, 2.5}) {
      const Eigen::Vector3d d = at(site, reach * any_direction());
      const auto energy =
          static_cast<double>(packed_energy(polynomial(site), normal(site), d.cast<long double>()));
      EXPECT_NEAR(work(site, Eigen::Vector3d::Zero(), d), energy, 1e-11 * std::abs(energy));
    }
  }
}

TEST_P(RuntimePolynomialDd, ClampedBeyondFourRadii) {
  constexpr double kGap = 1e-12;
  for (uint32_t site = 0; site < 12; ++site) {
    const Eigen::Vector3d limit = at(site, 4 * any_direction());
    const auto at_limit = touch(site, (1 - kGap) * limit);
    const Eigen::VectorXd field = as_vector(session_.field());
    const double energy = session_.get()->tissue.stored_energy;
    const Eigen::Vector3d force(at_limit.force);
    EXPECT_EQ(at_limit.flags, static_cast<uint32_t>(PAL_FLAG_EXTRAPOLATED));
    for (const double beyond : {1 + 1e-9, 2.0, 1e3, 1e12, 1e300}) {
      const auto result = touch(site, beyond * limit);
      EXPECT_EQ(result.flags, static_cast<uint32_t>(PAL_FLAG_EXTRAPOLATED | PAL_FLAG_CLAMPED));
      const Eigen::Vector3d goes_on(result.force);
      EXPECT_NEAR(goes_on.dot(limit), force.dot(limit), 1e-8 * force.norm() * limit.norm())
          << "along the ray";
      if (beyond < 1.1) {
        EXPECT_LE((goes_on - force).norm(), 1e-7 * force.norm()) << "it is continuous";
      }
      if (beyond < 1e4) {
        const double rise = (beyond - 1) * force.dot(limit);
        EXPECT_NEAR(session_.get()->tissue.stored_energy, energy + rise,
                    1e-9 * (std::abs(energy) + std::abs(rise)));
      }
      EXPECT_EQ(result.displacement_error, 1);
      EXPECT_LE((as_vector(session_.field()) - field).lpNorm<Eigen::Infinity>(),
                2 * packed_field_at(site, limit).rounding + 10 * kGap * field.lpNorm<Eigen::Infinity>());
    }
  }
}

// For shortened displacements, too, the force is the gradient of the stored energy.
TEST_P(RuntimePolynomialDd, ClampedForceIsTheGradientOfItsEnergy) {
  for (uint32_t site = 0; site < 12; ++site) {
    const Eigen::Vector3d d = at(site, 6.5 * any_direction());
    const auto energy_at = [&](const Eigen::Vector3d& place) {
      touch(site, place);
      return session_.get()->tissue.stored_energy;
    };
    const Eigen::Vector3d force(touch(site, d).force);
    const double step = 1e-5 * d.norm();
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d by = step * Eigen::Vector3d::Unit(axis);
      EXPECT_NEAR((energy_at(d + by) - energy_at(d - by)) / (2 * step), force[axis], 1e-6 * force.norm());
    }
  }
}

// The bound on the rounding of x and z distinguishes fields, and has little slack.
TEST_F(FittedPolynomialDd, RoundedFieldsAreNearUnroundedFields) {
  const Organ& rounded = organ(Kind::any_rounded, false);
  const Organ& plain = organ(Kind::any, false);
  const OpenPack pack(rounded.bytes);
  OwnedSession session(pack.get(), PAL_MODEL_POLYNOMIAL, 1, 0);
  double worst = 0;
  for (const uint32_t site : {1U, 2U, 4U}) {
    const SitePolynomial& polynomial = rounded.polynomials[site].polynomial;
    ASSERT_EQ(polynomial.basis.cols(), plain.polynomials[site].polynomial.basis.cols());
    for (int i = 0; i < 20; ++i) {
      const Eigen::Vector3d d = polynomial.to_unit.inverse() * any_direction();
      session.touch({{site, {d[0], d[1], d[2]}, 0, {}, {}, {}}});
      const PackedField packed = packed_field(polynomial, Eigen::Vector3d::Zero(), true, d);
      const Eigen::VectorXd nonlinear = packed.field - polynomial.linear * (polynomial.to_unit * d);
      EXPECT_LE(packed.rounding, 1e-3 * packed.field.lpNorm<Eigen::Infinity>());
      EXPECT_GT(nonlinear.lpNorm<Eigen::Infinity>(), 10 * packed.rounding);
      const double error = (as_vector(session.field()) - packed.field).lpNorm<Eigen::Infinity>();
      worst = std::max(worst, error / packed.rounding);
    }
  }
  EXPECT_LE(worst, 1);
  EXPECT_GT(worst, 0.1);
}

TEST_F(FittedPolynomialDd, AgreesWithHeldOutSolves) {
  // Twice the largest error of a cubic at 0.4 h.
  constexpr double kFitTolerance = 0.02;
  for (uint32_t site = 0; site < 12; ++site) {
    for (const SurveySample& sample : small_.polynomials[site].survey) {
      const Eigen::Vector3d f = force(site, sample.truth.displacement);
      EXPECT_LE((f - sample.truth.force).norm(), kFitTolerance * sample.truth.force.norm());
    }
  }
}

TEST_F(FittedPolynomialDd, WithoutLinearDdSeveralContactsAreRefused) {
  const AlignedBytes bytes = small_.write_polynomial_only();
  const OpenPack pack(bytes);
  OwnedSession session(pack.get(), PAL_MODEL_AUTO, 2, 2);
  const pal_contact contacts[2] = {{0, {0, 0, -0.01}, 0, {}, {}, {}}, {5, {0, 0, -0.01}, 0, {}, {}, {}}};
  const uint32_t node = 0;
  EXPECT_EQ(pal_contact_frame(session.get(), contacts, 2, nullptr), PAL_STATUS_MODEL_CANNOT_ANSWER);
  EXPECT_EQ(pal_session_set_fixed(session.get(), &node, 1), PAL_STATUS_MODEL_CANNOT_ANSWER);
  EXPECT_EQ(session.touch({contacts[0]})[0].model, PAL_MODEL_POLYNOMIAL);
}

// Outside an ellipsoid, though no further than the longest axis: both models set the flag.
TEST_F(FittedPolynomialDd, FlagsUnsampledPushesAlongAShortAxis) {
  const Organ& any = organ(Kind::any, false);
  const OpenPack pack(any.bytes);
  for (const pal_model model : {PAL_MODEL_POLYNOMIAL, PAL_MODEL_LINEAR}) {
    OwnedSession session(pack.get(), model, 1, 0);
    for (uint32_t site = 0; site < 12; ++site) {
      const Eigen::JacobiSVD<Eigen::Matrix3d> axes(any.polynomials[site].polynomial.to_unit,
                                                   Eigen::ComputeFullV);
      const auto flags_along = [&](int axis, double part) {
        const Eigen::Vector3d d = part / axes.singularValues()[axis] * axes.matrixV().col(axis);
        return session.touch({{site, {d[0], d[1], d[2]}, 0, {}, {}, {}}}).front().flags;
      };
      for (const int axis : {0, 1, 2}) {
        EXPECT_EQ(flags_along(axis, 1 - 1e-6), 0U);
        EXPECT_EQ(flags_along(axis, 1 + 1e-6), static_cast<uint32_t>(PAL_FLAG_EXTRAPOLATED));
      }
    }
  }
}

}  // namespace runtime_polynomial_dd_test
}  // namespace palpate::test::runtime_polynomial_dd_fixture
