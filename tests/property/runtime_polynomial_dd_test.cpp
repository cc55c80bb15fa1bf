// polynomial_dd as the runtime answers it: conservative, smooth across the edge of what was sampled, and the
// packed polynomial to rounding.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "runtime/src/session/session_state.hpp"
#include "schemas/monomials.hpp"
#include "schemas/pack_layout.hpp"
#include "tests/support/runtime_session.hpp"
#include "tests/support/small_pack.hpp"
#include "tests/support/tetrahedral_block.hpp"

namespace palpate::test {
namespace {

// Central differences in long double with a step of 1e-7 of the shortest reach: truncation 1e-14 times a third
// derivative of the order of a thousand, rounding 1e-19 / 1e-7.
constexpr double kDifferenceTolerance = 1e-9;
// Central differences of fourth order of the runtime's doubles with a step of 2e-5: rounding 1e-16 / 2e-5.
constexpr double kDoubleDifferenceTolerance = 1e-9;
constexpr double kDoubleStep = 2e-5;

using Vector3l = Eigen::Matrix<long double, 3, 1>;

// ---- Organs

// Polynomials of many degrees and ranks, on ellipsoids askew to all axes.
std::vector<SiteResult> any_polynomials(bool rounded) {
  const SmallPack& small = small_pack();
  TestRandom random(31);
  std::vector<SiteResult> results(small.sites.sites.size());
  const Eigen::Index rows = 3 * static_cast<Eigen::Index>(small.sites.packed_nodes.size());
  constexpr uint32_t kDegrees[] = {1, 2, 3, 4, 5, 7, pack::kMaxDegree};
  constexpr Eigen::Index kRanks[] = {0, 2, 8, 5, 16, pack::kMostRank, 33};
  for (size_t site = 0; site < results.size(); ++site) {
    const uint32_t degree = kDegrees[site % 7];
    const Eigen::Index rank = kRanks[site % 7];
    const Eigen::Matrix3d turn = Eigen::Quaterniond(random(), random(), random(), 2).normalized().matrix();
    const Eigen::Matrix3d other = Eigen::Quaterniond(random(), random(), random(), 0.5).normalized().matrix();
    SitePolynomial& polynomial = results[site].polynomial;
    polynomial.to_unit = turn * Eigen::Vector3d(1, 1.7, 2.9).asDiagonal() * other / kMaxDisplacement;
    polynomial.degree = static_cast<int>(degree);
    polynomial.linear = kMaxDisplacement * random.matrix(rows, 3);
    polynomial.basis = random.matrix(rows, rank);
    if (rounded) {
      const auto round = [](Eigen::MatrixXd& columns, double unit) {
        columns = (columns * (pack::kBasisUnit / unit)).array().round().matrix() * (unit / pack::kBasisUnit);
      };
      round(polynomial.linear, static_cast<double>(linear_unit(polynomial.linear)));
      round(polynomial.basis, 1);
    }
    polynomial.coefficients = 0.1 * kMaxDisplacement * random.matrix(pack::num_monomials(2, degree), rank);
    if (rank == Eigen::Index{pack::kMostRank}) {
      // Every direction weighs as much and is as large as it can be: the largest sums of integers.
      polynomial.basis.setOnes();
      polynomial.basis.topRows(rows / 2) *= -1;
      polynomial.coefficients.colwise() = polynomial.coefficients.col(0).eval();
    }
    polynomial.energy = 0.3 * random.vector(pack::num_monomials(2, degree + 1));
    for (const int square : {0, 3, 5}) polynomial.energy[square] += 2;
  }
  return results;
}

struct Organ {
  std::vector<SiteResult> polynomials;
  bool rounded;
  bool inward;
  AlignedBytes bytes;
};

enum class Kind { fitted, fitted_rounded, any, any_rounded };

std::string name_of(const ::testing::TestParamInfo<Kind>& kind) {
  constexpr const char* kNames[] = {"Fitted", "FittedRounded", "Any", "AnyRounded"};
  return kNames[static_cast<int>(kind.param)];
}
const auto kKinds = ::testing::Values(Kind::fitted, Kind::fitted_rounded, Kind::any, Kind::any_rounded);

const Organ& organ(Kind kind, bool inward) {
  static std::map<std::pair<Kind, bool>, Organ> made;
  if (const auto found = made.find({kind, inward}); found != made.end()) return found->second;
  const SmallPack& small = small_pack();
  const bool rounded = kind == Kind::fitted_rounded || kind == Kind::any_rounded;
  Organ organ{{}, rounded, inward, AlignedBytes(0)};
  if (kind == Kind::fitted) {
    organ.polynomials = small.polynomials;
  } else if (kind == Kind::fitted_rounded) {
    organ.polynomials = small.rounded_polynomials();
  } else {
    organ.polynomials = any_polynomials(rounded);
  }
  const PackContent content = small.content();
  Scene scene = small.scene;
  if (inward) scene.directions = Directions::inward;
  organ.bytes = write_pack({content.model, scene, content.sites, content.linear, &organ.polynomials, rounded,
                            content.inputs, content.surveys});
  return made.emplace(std::pair(kind, inward), std::move(organ)).first->second;
}

// ---- The definitions in runtime/src/polynomial_dd.hpp, term by term; n is zero where every direction was sampled.

template <typename Real>
Real fade_at(const SitePolynomial& polynomial, const Eigen::Vector3d& n, const Eigen::Matrix<Real, 3, 1>& d) {
  const Eigen::Matrix<Real, 3, 1> normal = n.cast<Real>();
  const Real c = d.dot(normal) * (polynomial.to_unit.cast<Real>() * normal).norm();
  const Real t = std::min<Real>(1, std::max<Real>(0, -2 * c));
  return 1 - t * t * t * (10 - 15 * t + 6 * t * t);
}

long double packed_energy(const SitePolynomial& polynomial, const Eigen::Vector3d& n, const Vector3l& d) {
  const Vector3l x = polynomial.to_unit.cast<long double>() * d;
  const long double s = x.norm();
  const long double fade = fade_at<long double>(polynomial, n, d);
  long double energy = 0;
  pack::for_each_monomial(
      static_cast<uint32_t>(polynomial.degree) + 1, [&](uint32_t index, uint32_t a, uint32_t b, uint32_t c) {
        const uint32_t order = a + b + c;
        if (order < 2) return;
        long double continued = order > 2 ? fade : 1;
        if (s > 1) {
          const long double t = s - 1;
          continued *= (1 + order * t + 0.5L * order * (order - 1.0L) * t * t) /
                       std::pow(s, static_cast<long double>(order));
        }
        const auto coefficient = static_cast<long double>(polynomial.energy[index - pack::monomial_start(2)]);
        energy += coefficient * continued * std::pow(x[0], static_cast<int>(a)) *
                  std::pow(x[1], static_cast<int>(b)) * std::pow(x[2], static_cast<int>(c));
      });
  return energy;
}

struct PackedField {
  Eigen::VectorXd field;
  double rounding;  // what a field may be off by
};

// Rounding of every sum, product and stored number, of `pal_real`: of so many terms, each at most as large. And of x
// and z: of each part half a unit, 1/32767 of the largest or 1/65000 of the sum.
PackedField packed_field(const SitePolynomial& polynomial, const Eigen::Vector3d& n, bool rounded,
                         const Eigen::Vector3d& d) {
  const Eigen::Vector3d x = polynomial.to_unit * d;
  const double s = x.norm();
  const double fade = fade_at<double>(polynomial, n, d);
  const auto degree = static_cast<uint32_t>(polynomial.degree);
  Eigen::VectorXd weights(pack::num_monomials(2, degree));
  pack::for_each_monomial(degree, [&](uint32_t index, uint32_t a, uint32_t b, uint32_t c) {
    const uint32_t order = a + b + c;
    if (order < 2) return;
    const double continued = s > 1 ? (1 + order * (s - 1)) / std::pow(s, order) : 1.0;
    weights[index - pack::monomial_start(2)] =
        fade * continued * std::pow(x[0], a) * std::pow(x[1], b) * std::pow(x[2], c);
  });
  const auto terms = static_cast<double>(weights.size() + polynomial.basis.cols() + 20);
  const Eigen::MatrixXd& B = polynomial.basis;
  const Eigen::MatrixXd& C = polynomial.coefficients;
  PackedField packed;
  packed.field = polynomial.linear * x;
  Eigen::VectorXd sizes = polynomial.linear.cwiseAbs() * x.cwiseAbs();
  packed.rounding = 0;
  const auto rounding_of = [&](const Eigen::VectorXd& w) {
    const Eigen::VectorXd size = w.cwiseAbs();
    return rounded ? 0.5 * static_cast<double>(w.size()) *
                         std::max(size.maxCoeff() / pack::kBasisUnit, size.sum() / 65000)
                   : 0.0;
  };
  packed.rounding += rounding_of(static_cast<double>(linear_unit(polynomial.linear)) * x);
  if (B.cols() > 0) {
    const Eigen::VectorXd z = C.transpose() * weights;
    packed.field += B * z;
    sizes += B.cwiseAbs() * (C.cwiseAbs().transpose() * weights.cwiseAbs());
    packed.rounding += rounding_of(z);
  }
  packed.rounding += terms * static_cast<double>(std::numeric_limits<pal_real>::epsilon()) * sizes.maxCoeff();
  return packed;
}

class PolynomialDdTest : public ::testing::Test {
 protected:
  explicit PolynomialDdTest(const Organ& organ)
      : organ_(organ), pack_(organ.bytes), session_(pack_.get(), PAL_MODEL_POLYNOMIAL, 1, 0) {}

  const SitePolynomial& polynomial(uint32_t site) const { return organ_.polynomials[site].polynomial; }
  // Of the sites where only inward displacements were sampled; else zero.
  Eigen::Vector3d normal(uint32_t site) const {
    return organ_.inward ? small_.sites.sites[site].inward : Eigen::Vector3d::Zero();
  }
  double reach(uint32_t site) const { return least_reach(polynomial(site).to_unit); }
  // The displacement that is x in the unit ball.
  Eigen::Vector3d at(uint32_t site, const Eigen::Vector3d& x) const {
    return polynomial(site).to_unit.inverse() * x;
  }
  PackedField packed_field_at(uint32_t site, const Eigen::Vector3d& d) const {
    return packed_field(polynomial(site), normal(site), organ_.rounded, d);
  }

  Eigen::Vector3d any_direction() {
    std::normal_distribution<double> component;
    return Eigen::Vector3d(component(random_), component(random_), component(random_)).normalized();
  }

  pal_contact_result touch(uint32_t site, const Eigen::Vector3d& d) {
    return session_.touch({{site, {d[0], d[1], d[2]}, 0, {}, {}, {}}}).front();
  }
  Eigen::Vector3d force(uint32_t site, const Eigen::Vector3d& d) {
    return Eigen::Vector3d(touch(site, d).force);
  }
  static Eigen::Matrix3d stiffness_of(const pal_contact_result& result) {
    return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(&result.stiffness[0][0]);
  }

  void expect_gradient_of_packed_energy(uint32_t site, const Eigen::Vector3d& d) {
    const Eigen::Vector3d f = force(site, d);
    const long double step = 1e-7L * static_cast<long double>(reach(site));
    for (int axis = 0; axis < 3; ++axis) {
      Vector3l up = d.cast<long double>();
      Vector3l down = up;
      up[axis] += step;
      down[axis] -= step;
      const auto slope = static_cast<double>((packed_energy(polynomial(site), normal(site), up) -
                                              packed_energy(polynomial(site), normal(site), down)) /
                                             (2 * step));
      EXPECT_NEAR(f[axis], slope, kDifferenceTolerance * f.norm())
          << "site " << site << " d " << d.transpose();
    }
  }

  void expect_stiffness_is_slope(uint32_t site, const Eigen::Vector3d& d) {
    const Eigen::Matrix3d S = stiffness_of(touch(site, d));
    EXPECT_EQ(S, S.transpose());
    const double step = kDoubleStep * reach(site);
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d e = step * Eigen::Vector3d::Unit(axis);
      const Eigen::Vector3d slope = (8 * (force(site, d + e) - force(site, d - e)) -
                                     (force(site, d + 2 * e) - force(site, d - 2 * e))) /
                                    (12 * step);
      EXPECT_LE((S.col(axis) - slope).norm(), kDoubleDifferenceTolerance * S.norm())
          << "site " << site << " d " << d.transpose();
    }
  }

  void expect_packed_field(uint32_t site, const Eigen::Vector3d& d) {
    touch(site, d);
    const PackedField packed = packed_field_at(site, d);
    EXPECT_LE((as_vector(session_.field()) - packed.field).lpNorm<Eigen::Infinity>(), packed.rounding)
        << "site " << site << " d " << d.transpose();
  }

  // Work of the tool along the straight piece from a to b; Gauss points, split where the piece crosses |A d| = 1.
  double work(uint32_t site, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    return work(site, a, b, [&](const Eigen::Vector3d& d) { return force(site, d); });
  }
  template <typename Force>
  double work(uint32_t site, const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Force& force_at) {
    std::vector<double> cuts = {0, 1};
    const Eigen::Vector3d along = b - a;
    const Eigen::Vector3d start = polynomial(site).to_unit * a;
    const Eigen::Vector3d change = polynomial(site).to_unit * along;
    const double A = change.squaredNorm();
    const double B = start.dot(change);
    const double C = start.squaredNorm() - 1;
    if (const double root = B * B - A * C; A > 0 && root > 0) {
      for (const double sign : {-1.0, 1.0}) {
        const double t = (-B + sign * std::sqrt(root)) / A;
        if (t > 0 && t < 1) cuts.insert(cuts.end() - 1, t);
      }
    }
    // Five Gauss points on each of sixteen parts: exact where the force is of degree 9 at most; elsewhere, and
    // outside, it is analytic, and the rule's error is of order (1/16)^10.
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
  const Organ& organ_;
  OpenPack pack_;
  OwnedSession session_;
  std::mt19937_64 random_{11};
};

// Whatever was fitted, and however it is stored.
class RuntimePolynomialDd : public PolynomialDdTest, public ::testing::WithParamInterface<Kind> {
 protected:
  RuntimePolynomialDd() : PolynomialDdTest(organ(GetParam(), false)) {}
};
INSTANTIATE_TEST_SUITE_P(, RuntimePolynomialDd, kKinds, name_of);

// The small organ's own.
class FittedPolynomialDd : public PolynomialDdTest {
 protected:
  FittedPolynomialDd() : PolynomialDdTest(organ(Kind::fitted, false)) {}
};

// Inside, near the edge on both sides, outside.
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

// Across |x| = 1 force and stiffness are continuous: their jump over a gap is as small as the gap.
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
    // The expected change over the gap is its first order; ten times that bounds the next stiffness term.
    EXPECT_LE((Eigen::Vector3d(outside.force) - Eigen::Vector3d(inside.force)).norm(),
              10 * kGap * edge.norm() * S.norm());
    EXPECT_LE((stiffness_of(outside) - S).norm(), 100 * kGap * S.norm());
    const PackedField packed = packed_field_at(site, edge);
    EXPECT_LE((field_outside - field_inside).lpNorm<Eigen::Infinity>(),
              100 * kGap * packed.field.lpNorm<Eigen::Infinity>() + 2 * packed.rounding);
  }
}

// The scene's largest displacement itself was sampled, whatever units made of its last digit.
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

// The criterion sees a force that is no gradient: a millionth of a swirl about the z axis.
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

// There, too, the force is the gradient of what is stored: a closed path gives no energy.
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

// The bound of what rounding x and z makes of a field is one that tells fields apart, and is kept with little to spare.
TEST_F(FittedPolynomialDd, RoundedFieldsAreNearThoseThatAreNot) {
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
  // A cubic at 0.4 h: DESIGN section 7 has 0.2 to 0.9 % for such pushes of a patch.
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

// Outside of an ellipsoid, though no further than others reach: said so by both models.
TEST_F(FittedPolynomialDd, WhatWasNotSampledAlongAShortAxisIsSaid) {
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

// ---- Sites where only inward displacements were sampled

class InwardTest : public PolynomialDdTest {
 protected:
  using PolynomialDdTest::PolynomialDdTest;

  // c = d . n |A n| set to the given value, |A d| = reach.
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
              1e-14 * force.norm());  // summed in another order
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

// Where it fades, before and behind, inside the ellipsoid and beyond.
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

}  // namespace
}  // namespace palpate::test
