// polynomial_dd as the runtime answers it: conservative, smooth across the edge of what was sampled, and the
// packed polynomial to rounding.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <Eigen/LU>
#include <cmath>
#include <random>

#include "runtime/src/field_kernel.hpp"
#include "schemas/monomials.hpp"
#include "tests/support/runtime_session.hpp"
#include "tests/support/small_pack.hpp"

namespace palpate::test {
namespace {

// Central differences in long double with a step of 1e-6 of the radius: truncation 1e-12 times a third
// derivative of the order of a hundred, rounding 1e-19 / 1e-6.
constexpr double kDifferenceTolerance = 1e-9;
// Central differences of the runtime's doubles with a step of 1e-5: truncation 1e-10, rounding 1e-16 / 1e-5.
constexpr double kDoubleDifferenceTolerance = 1e-8;
// Sums of some thirty float64 terms.
constexpr double kRounding = 1e-13;
// Sums of 19 terms.
constexpr double kFieldTolerance = field_tolerance(2e-6);

using Vector3l = Eigen::Matrix<long double, 3, 1>;

// The stored energy straight from the definition in runtime/src/polynomial_dd.hpp, term by term.
long double packed_energy(const SitePolynomial& polynomial, uint32_t degree, const Vector3l& d) {
  const Vector3l x = d / static_cast<long double>(polynomial.radius);
  const long double s = x.norm();
  long double energy = 0;
  pack::for_each_monomial(degree + 1, [&](uint32_t index, uint32_t a, uint32_t b, uint32_t c) {
    const uint32_t n = a + b + c;
    if (n < 2) return;
    long double continued = 1;
    if (s > 1) {
      const long double t = s - 1;
      continued = (1 + n * t + 0.5L * n * (n - 1.0L) * t * t) / std::pow(s, static_cast<long double>(n));
    }
    const auto coefficient = static_cast<long double>(polynomial.energy[index - pack::monomial_start(2)]);
    energy += coefficient * continued * std::pow(x[0], static_cast<int>(a)) *
              std::pow(x[1], static_cast<int>(b)) * std::pow(x[2], static_cast<int>(c));
  });
  return energy;
}

class RuntimePolynomialDd : public ::testing::Test {
 protected:
  RuntimePolynomialDd() : RuntimePolynomialDd(small_pack_bytes()) {}
  explicit RuntimePolynomialDd(const AlignedBytes& bytes)
      : pack_(bytes), session_(pack_.get(), PAL_MODEL_POLYNOMIAL, 1, 0) {}

  double radius(uint32_t site) const { return small_.polynomials[site].polynomial.radius; }

  Eigen::Vector3d any_direction() {
    std::normal_distribution<double> component;
    return Eigen::Vector3d(component(random_), component(random_), component(random_)).normalized();
  }

  pal_contact_result touch(uint32_t site, const Eigen::Vector3d& d) {
    return session_.touch({{site, {d[0], d[1], d[2]}, 0, {}}}).front();
  }
  Eigen::Vector3d force(uint32_t site, const Eigen::Vector3d& d) {
    return Eigen::Vector3d(touch(site, d).force);
  }
  static Eigen::Matrix3d stiffness_of(const pal_contact_result& result) {
    return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(&result.stiffness[0][0]);
  }

  // Work of the tool along the straight piece from a to b; Gauss points, split where the piece crosses |d| =
  // r.
  double work(uint32_t site, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    return work(site, a, b, [&](const Eigen::Vector3d& d) { return force(site, d); });
  }
  template <typename Force>
  double work(uint32_t site, const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Force& force_at) {
    std::vector<double> cuts = {0, 1};
    const Eigen::Vector3d along = b - a;
    const double A = along.squaredNorm();
    const double B = a.dot(along);
    const double C = a.squaredNorm() - radius(site) * radius(site);
    if (const double root = B * B - A * C; A > 0 && root > 0) {
      for (const double sign : {-1.0, 1.0}) {
        const double t = (-B + sign * std::sqrt(root)) / A;
        if (t > 0 && t < 1) cuts.insert(cuts.end() - 1, t);
      }
    }
    // Five Gauss points on each of sixteen parts: exact inside, where the force is of degree 3; outside it is
    // analytic, and the rule's error is of order (1/16)^10.
    constexpr double kPoints[] = {0, 0.5384693101056831, 0.9061798459386640};
    constexpr double kWeights[] = {0.5688888888888889, 0.4786286704993665, 0.2369268850561891};
    constexpr int kParts = 16;
    double sum = 0;
    for (size_t cut = 1; cut < cuts.size(); ++cut) {
      const double part = (cuts[cut] - cuts[cut - 1]) / kParts;
      for (int i = 0; i < kParts; ++i) {
        const double middle = cuts[cut - 1] + (i + 0.5) * part;
        for (int point = 0; point < 3; ++point) {
          for (const double sign : {-1.0, 1.0}) {
            if (point == 0 && sign > 0) continue;
            const double t = middle + sign * 0.5 * part * kPoints[point];
            sum += 0.5 * part * kWeights[point] * force_at(a + t * along).dot(along);
          }
        }
      }
    }
    return sum;
  }

  const SmallPack& small_ = small_pack();
  OpenPack pack_;
  OwnedSession session_;
  std::mt19937_64 random_{11};
};

// Inside, near the edge on both sides, outside.
constexpr double kReaches[] = {0.05, 0.5, 0.97, 0.9999, 1.0001, 1.03, 1.7, 3.9};

TEST_F(RuntimePolynomialDd, ForceIsTheGradientOfThePackedEnergy) {
  for (uint32_t site = 0; site < 12; ++site) {
    for (const double reach : kReaches) {
      const Eigen::Vector3d d = reach * radius(site) * any_direction();
      const Eigen::Vector3d f = force(site, d);
      const long double step = 1e-6L * static_cast<long double>(radius(site));
      for (int axis = 0; axis < 3; ++axis) {
        Vector3l up = d.cast<long double>();
        Vector3l down = up;
        up[axis] += step;
        down[axis] -= step;
        const SitePolynomial& polynomial = small_.polynomials[site].polynomial;
        const auto slope = static_cast<double>((packed_energy(polynomial, SmallPack::kDegree, up) -
                                                packed_energy(polynomial, SmallPack::kDegree, down)) /
                                               (2 * step));
        EXPECT_NEAR(f[axis], slope, kDifferenceTolerance * f.norm()) << "site " << site << " reach " << reach;
      }
    }
  }
}

TEST_F(RuntimePolynomialDd, StiffnessIsTheDerivativeOfTheForce) {
  for (uint32_t site = 0; site < 12; ++site) {
    for (const double reach : kReaches) {
      const Eigen::Vector3d d = reach * radius(site) * any_direction();
      const Eigen::Matrix3d S = stiffness_of(touch(site, d));
      EXPECT_EQ(S, S.transpose());
      const double step = 1e-5 * radius(site);
      for (int axis = 0; axis < 3; ++axis) {
        const Eigen::Vector3d e = step * Eigen::Vector3d::Unit(axis);
        const Eigen::Vector3d slope = (force(site, d + e) - force(site, d - e)) / (2 * step);
        EXPECT_LE((S.col(axis) - slope).norm(), kDoubleDifferenceTolerance * S.norm())
            << "site " << site << " reach " << reach;
      }
    }
  }
}

// Across |x| = 1 force and stiffness are continuous: their jump over a gap is as small as the gap.
TEST_F(RuntimePolynomialDd, ContinuousAcrossTheEdgeOfTheSamples) {
  constexpr double kGap = 2e-9;
  for (uint32_t site = 0; site < 12; ++site) {
    const Eigen::Vector3d edge = radius(site) * any_direction();
    const auto inside = touch(site, (1 - kGap) * edge);
    const std::vector<pal_real> field_inside = session_.field();
    const auto outside = touch(site, (1 + kGap) * edge);
    const std::vector<pal_real> field_outside = session_.field();
    EXPECT_EQ(inside.flags, 0U);
    EXPECT_EQ(outside.flags, static_cast<uint32_t>(PAL_FLAG_EXTRAPOLATED));
    const Eigen::Matrix3d S = stiffness_of(inside);
    // The expected change over the gap is its first order; ten times that bounds the next stiffness term.
    EXPECT_LE((Eigen::Vector3d(outside.force) - Eigen::Vector3d(inside.force)).norm(),
              10 * kGap * radius(site) * S.norm());
    EXPECT_LE((stiffness_of(outside) - S).norm(), 100 * kGap * S.norm());
    for (size_t i = 0; i < field_inside.size(); ++i)
      EXPECT_NEAR(field_inside[i], field_outside[i], (10 * kGap + kFieldTolerance) * radius(site));
  }
}

// The scene's largest displacement itself was sampled, whatever units made of its last digit.
TEST_F(RuntimePolynomialDd, TheEdgeItselfIsInside) {
  const AlignedBytes bytes = small_.write_with_units();
  const OpenPack in_units(bytes);
  OwnedSession session(in_units.get(), PAL_MODEL_POLYNOMIAL, 1, 0);
  for (uint32_t site = 0; site < 12; ++site) {
    for (int i = 0; i < 20; ++i) {
      const Eigen::Vector3d d = radius(site) * any_direction();
      EXPECT_EQ(touch(site, d).flags, 0U);
      const auto result = session.touch({{site, {1e-3 * d[0], 1e-3 * d[1], 1e-3 * d[2]}, 0, {}}}).front();
      EXPECT_EQ(result.flags, 0U);
    }
  }
}

TEST_F(RuntimePolynomialDd, LinearPartIsTheExactLinearStiffness) {
  OwnedSession linear(pack_.get(), PAL_MODEL_LINEAR, 1, 0);
  for (uint32_t site = 0; site < 12; ++site) {
    const Eigen::Matrix3d S = stiffness_of(touch(site, Eigen::Vector3d::Zero()));
    const Eigen::Matrix3d expected = stiffness_of(linear.touch({{site, {0, 0, 0}, 0, {}}}).front());
    EXPECT_LE((S - expected).norm(), 1e-9 * expected.norm());  // two float64 factorisations
    EXPECT_EQ(force(site, Eigen::Vector3d::Zero()).norm(), 0);
  }
}

// Work around a closed polygon over the work done on its sides.
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

// No path back to its start makes energy: inside, through the edge, and wholly outside.
TEST_F(RuntimePolynomialDd, ClosedPathsDoNoWork) {
  for (uint32_t site = 0; site < 12; site += 3) {
    for (const double reach : {0.6, 1.3, 3.0}) {
      std::vector<Eigen::Vector3d> corners(6);
      for (Eigen::Vector3d& corner : corners) corner = reach * radius(site) * any_direction();
      const ClosedWork closed =
          around(corners, [&](const auto& a, const auto& b) { return work(site, a, b); });
      EXPECT_GT(closed.moved, 0);
      EXPECT_LE(std::abs(closed.total), kClosedWork * closed.moved) << "site " << site << " reach " << reach;
    }
  }
}

// The criterion sees a force that is no gradient: a millionth of a swirl about the z axis.
TEST_F(RuntimePolynomialDd, WorkOfASwirlIsSeen) {
  const double r = 0.5 * radius(0);
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

TEST_F(RuntimePolynomialDd, WorkIsTheChangeOfStoredEnergy) {
  for (uint32_t site = 0; site < 12; site += 4) {
    for (const double reach : {0.8, 2.5}) {
      const Eigen::Vector3d d = reach * radius(site) * any_direction();
      const auto energy = static_cast<double>(
          packed_energy(small_.polynomials[site].polynomial, SmallPack::kDegree, d.cast<long double>()));
      EXPECT_NEAR(work(site, Eigen::Vector3d::Zero(), d), energy, 1e-11 * std::abs(energy));
    }
  }
}

TEST_F(RuntimePolynomialDd, ClampedBeyondFourRadii) {
  for (uint32_t site = 0; site < 12; site += 5) {
    const Eigen::Vector3d limit = 4 * radius(site) * any_direction();
    const auto at_limit = touch(site, (1 - 1e-12) * limit);
    const std::vector<pal_real> field = session_.field();
    EXPECT_EQ(at_limit.flags, static_cast<uint32_t>(PAL_FLAG_EXTRAPOLATED));
    for (const double beyond : {1 + 1e-9, 2.0, 1e3, 1e12, 1e300}) {
      const auto result = touch(site, beyond * limit);
      EXPECT_EQ(result.flags, static_cast<uint32_t>(PAL_FLAG_EXTRAPOLATED | PAL_FLAG_CLAMPED));
      EXPECT_LE((Eigen::Vector3d(result.force) - Eigen::Vector3d(at_limit.force)).norm(),
                1e-10 * Eigen::Vector3d(at_limit.force).norm());
      EXPECT_EQ(result.displacement_error, 1);
      const std::vector<pal_real> clamped = session_.field();
      for (size_t i = 0; i < field.size(); ++i)
        EXPECT_NEAR(clamped[i], field[i], kFieldTolerance * limit.norm());
    }
  }
}

TEST_F(RuntimePolynomialDd, FieldIsThePackedPolynomial) {
  for (uint32_t site = 0; site < 12; ++site) {
    const SitePolynomial& polynomial = small_.polynomials[site].polynomial;
    for (const double reach : kReaches) {
      const Eigen::Vector3d x = reach * any_direction();
      touch(site, radius(site) * x);
      const std::vector<pal_real> field = session_.field();
      const double s = x.norm();
      Eigen::VectorXd weights(polynomial.field.cols());
      pack::for_each_monomial(SmallPack::kDegree, [&](uint32_t index, uint32_t a, uint32_t b, uint32_t c) {
        const uint32_t n = a + b + c;
        if (n == 0) return;
        const double continued = s > 1 ? (1 + n * (s - 1)) / std::pow(s, n) : 1.0;
        weights[index - 1] = continued * std::pow(x[0], a) * std::pow(x[1], b) * std::pow(x[2], c);
      });
      const Eigen::VectorXd expected = polynomial.field.cast<double>() * weights;
      const double scale = (polynomial.field.cast<double>().cwiseAbs() * weights.cwiseAbs()).maxCoeff();
      for (size_t i = 0; i < field.size(); ++i)
        ASSERT_NEAR(static_cast<double>(field[i]), expected[static_cast<Eigen::Index>(i)],
                    kFieldTolerance * scale);
    }
  }
}

TEST_F(RuntimePolynomialDd, AgreesWithHeldOutSolves) {
  // A cubic at 0.4 h: DESIGN section 7 has 0.2 to 0.9 % for such pushes of a patch.
  constexpr double kFitTolerance = 0.02;
  for (uint32_t site = 0; site < 12; ++site) {
    for (const SurveySample& sample : small_.polynomials[site].survey) {
      const Eigen::Vector3d f = force(site, sample.truth.displacement);
      EXPECT_LE((f - sample.truth.force).norm(), kFitTolerance * sample.truth.force.norm());
    }
  }
}

TEST_F(RuntimePolynomialDd, WithoutLinearDdSeveralContactsAreRefused) {
  const AlignedBytes bytes = small_.write_polynomial_only();
  const OpenPack pack(bytes);
  OwnedSession session(pack.get(), PAL_MODEL_AUTO, 2, 2);
  const pal_contact contacts[2] = {{0, {0, 0, -0.01}, 0, {}}, {5, {0, 0, -0.01}, 0, {}}};
  const uint32_t node = 0;
  EXPECT_EQ(pal_contact_frame(session.get(), contacts, 2, nullptr), PAL_STATUS_MODEL_CANNOT_ANSWER);
  EXPECT_EQ(pal_session_set_fixed(session.get(), &node, 1), PAL_STATUS_MODEL_CANNOT_ANSWER);
  EXPECT_EQ(session.touch({contacts[0]})[0].model, PAL_MODEL_POLYNOMIAL);
}

// ---- Sites where only inward displacements were sampled

class InwardPolynomialDd : public RuntimePolynomialDd {
 protected:
  static AlignedBytes write_inward() {
    const PackContent content = small_pack().content();
    Scene inward = small_pack().scene;
    inward.directions = Directions::inward;
    return write_pack({content.model, inward, content.sites, content.linear, content.polynomials,
                       content.degree, content.inputs, content.surveys});
  }
  InwardPolynomialDd() : RuntimePolynomialDd(bytes()) {}

  static const AlignedBytes& bytes() {
    static const AlignedBytes written = write_inward();
    return written;
  }
  // c = x . n set to the given value, |x| = reach.
  Eigen::Vector3d tilted(uint32_t site, double c, double reach) {
    const Eigen::Vector3d& n = small_.sites.sites[site].inward;
    const Eigen::Vector3d any = any_direction();
    const Eigen::Vector3d across = (any - any.dot(n) * n).normalized();
    return radius(site) * (c * n + std::sqrt(reach * reach - c * c) * across);
  }
};

TEST_F(InwardPolynomialDd, InsideItIsThePlainPolynomial) {
  const OpenPack plain(small_pack_bytes());
  OwnedSession session(plain.get(), PAL_MODEL_POLYNOMIAL, 1, 0);
  for (uint32_t site = 0; site < 12; ++site) {
    const Eigen::Vector3d d = tilted(site, 0.3, 0.8);
    const auto result = touch(site, d);
    EXPECT_EQ(result.flags, 0U);
    EXPECT_EQ(result.displacement_error, small_.surveys[1].table.bins.back().displacement.bound);
    const auto expected = session.touch({{site, {d[0], d[1], d[2]}, 0, {}}}).front();
    EXPECT_EQ(Eigen::Vector3d(result.force), Eigen::Vector3d(expected.force));
    EXPECT_EQ(session_.field(), session.field());
  }
}

TEST_F(InwardPolynomialDd, BehindTheSurfaceItSaysSo) {
  OwnedSession linear(pack_.get(), PAL_MODEL_LINEAR, 1, 0);
  for (uint32_t site = 0; site < 12; ++site) {
    for (const double c : {-1e-3, -0.2, -0.7}) {
      const Eigen::Vector3d d = tilted(site, c, 0.8);
      const auto result = touch(site, d);
      EXPECT_EQ(result.flags, static_cast<uint32_t>(PAL_FLAG_EXTRAPOLATED));
      EXPECT_EQ(result.displacement_error, 1);
      EXPECT_EQ(result.force_error, 1);
      const auto other = linear.touch({{site, {d[0], d[1], d[2]}, 0, {}}}).front();
      EXPECT_EQ(other.flags, static_cast<uint32_t>(PAL_FLAG_EXTRAPOLATED));
      EXPECT_EQ(other.displacement_error, 1);
    }
  }
}

TEST_F(InwardPolynomialDd, DeepBehindTheSurfaceItIsTheExactLinearAnswer) {
  OwnedSession linear(pack_.get(), PAL_MODEL_LINEAR, 1, 0);
  for (uint32_t site = 0; site < 12; ++site) {
    const Eigen::Vector3d d = tilted(site, -0.6, 0.9);
    const Eigen::Vector3d f = force(site, d);
    const auto expected = linear.touch({{site, {d[0], d[1], d[2]}, 0, {}}}).front();
    EXPECT_LE((f - Eigen::Vector3d(expected.force)).norm(), 1e-9 * f.norm());  // two float64 factorisations
    const std::vector<pal_real> field = session_.field();
    const std::vector<pal_real> linear_field = linear.field();
    for (size_t i = 0; i < field.size(); ++i)
      EXPECT_NEAR(field[i], linear_field[i], kFieldTolerance * radius(site));
  }
}

TEST_F(InwardPolynomialDd, StiffnessIsTheDerivativeOfTheForceWhereItFades) {
  for (uint32_t site = 0; site < 12; ++site) {
    for (const double c : {-0.05, -0.25, -0.45}) {
      for (const double reach : {0.8, 1.5}) {
        const Eigen::Vector3d d = tilted(site, c, reach);
        const Eigen::Matrix3d S = stiffness_of(touch(site, d));
        const double step = 1e-5 * radius(site);
        for (int axis = 0; axis < 3; ++axis) {
          const Eigen::Vector3d e = step * Eigen::Vector3d::Unit(axis);
          const Eigen::Vector3d slope = (force(site, d + e) - force(site, d - e)) / (2 * step);
          EXPECT_LE((S.col(axis) - slope).norm(), kDoubleDifferenceTolerance * S.norm()) << "site " << site;
        }
      }
    }
  }
}

TEST_F(InwardPolynomialDd, StiffnessHasNoStepWhereItBeginsOrEndsToFade) {
  constexpr double kGap = 1e-6;
  for (uint32_t site = 0; site < 12; ++site) {
    for (const double c : {0.0, -0.5}) {
      const Eigen::Vector3d at = tilted(site, c, 0.8);
      const Eigen::Vector3d gap = kGap * radius(site) * small_.sites.sites[site].inward;
      const Eigen::Matrix3d S = stiffness_of(touch(site, at + gap));
      EXPECT_LE((stiffness_of(touch(site, at - gap)) - S).norm(), 1e3 * kGap * S.norm());
    }
  }
}

// ---- The inner loop of every field

// Of the instruction sets that this processor has.
TEST(FieldKernel, AllAgreeWithScalarWithinTheStatedBound) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<pal_real> value(-1, 1);
  std::uniform_int_distribution<int> exponent(-20, 20);
  const auto any = [&] { return std::ldexp(value(random), exponent(random)); };
  constexpr size_t kStride = 2 * pack::kPanelRows;
  constexpr uint32_t kMostColumns = 128;
  AlignedBytes memory(kMostColumns * kStride * sizeof(pal_real));
  auto* columns = reinterpret_cast<pal_real*>(memory.bytes().data());
  FieldKernel kernels[kMostFieldKernels];
  const uint32_t num_kernels = list_field_kernels(kernels);
  ASSERT_STREQ(kernels[0].name, "scalar");
  EXPECT_EQ(choose_add_columns(), kernels[num_kernels - 1].add_columns);
  for (const uint32_t count : {0u, 1u, 2u, 3u, 19u, 55u, 128u}) {
    for (size_t i = 0; i < kMostColumns * kStride; ++i) columns[i] = any();
    std::vector<pal_real> weights(count + 1);  // never empty
    for (pal_real& weight : weights) weight = any();
    std::vector<pal_real> scalar(pack::kPanelRows);
    for (pal_real& start : scalar) start = any();
    const std::vector<pal_real> start = scalar;
    kernels[0].add_columns(columns, kStride, weights.data(), count, true, scalar.data());
    std::vector<pal_real> fused;  // of the first that fuses products and sums
    for (uint32_t k = 0; k < num_kernels; ++k) {
      SCOPED_TRACE(kernels[k].name);
      std::vector<pal_real> result = start;
      kernels[k].add_columns(columns, kStride, weights.data(), count, true, result.data());
      std::vector<pal_real> from_zero(pack::kPanelRows, 7);
      kernels[k].add_columns(columns, kStride, weights.data(), count, false, from_zero.data());
      std::vector<pal_real> added(pack::kPanelRows);
      kernels[k].add_columns(columns, kStride, weights.data(), count, true, added.data());
      EXPECT_EQ(from_zero, added);
      for (size_t i = 0; i < pack::kPanelRows; ++i) {
        double magnitude =
            std::abs(static_cast<double>(start[i]));  // what was there takes part in the rounding
        double exact = static_cast<double>(start[i]);
        for (uint32_t j = 0; j < count; ++j) {
          const double product =
              static_cast<double>(weights[j]) * static_cast<double>(columns[j * kStride + i]);
          magnitude += std::abs(product);
          exact += product;
        }
        const double bound =
            count * static_cast<double>(std::numeric_limits<pal_real>::epsilon()) * magnitude;
        EXPECT_LE(std::abs(static_cast<double>(scalar[i]) - static_cast<double>(result[i])), bound);
        EXPECT_LE(std::abs(static_cast<double>(result[i]) - exact), bound);
      }
      if (k == 1) fused = result;
      if (k > 1) {
        EXPECT_EQ(result, fused);
      }
    }
  }
}

}  // namespace
}  // namespace palpate::test
