// Packs of polynomials, with reference values of their energies and fields.
#pragma once

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

namespace palpate::test::runtime_polynomial_dd_fixture {

// Central differences in long double with a step of 1e-7 of the shortest reach. Truncation: 1e-14 times a
// third derivative near a thousand. Rounding: 1e-19 / 1e-7.
inline constexpr double kDifferenceTolerance = 1e-9;

// Fourth-order central differences in double with a step of 2e-5. Rounding: 1e-16 / 2e-5.
inline constexpr double kDoubleDifferenceTolerance = 1e-9;

inline constexpr double kDoubleStep = 2e-5;

using Vector3l = Eigen::Matrix<long double, 3, 1>;
// ---- Organs

// Polynomials of many degrees and ranks, on ellipsoids askew to all coordinate axes.
inline std::vector<SiteResult> any_polynomials(bool rounded) {
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
      // Every basis entry takes its largest value: the largest sums of integers.
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

inline std::string name_of(const ::testing::TestParamInfo<Kind>& kind) {
  constexpr const char* kNames[] = {"Fitted", "FittedRounded", "Any", "AnyRounded"};
  return kNames[static_cast<int>(kind.param)];
}

inline const auto kKinds =
    ::testing::Values(Kind::fitted, Kind::fitted_rounded, Kind::any, Kind::any_rounded);

inline const Organ& organ(Kind kind, bool inward) {
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

// ---- The definitions in polynomial_dd.hpp, term by term; n is zero where every direction was sampled.

template <typename Real>
Real fade_at(const SitePolynomial& polynomial, const Eigen::Vector3d& n, const Eigen::Matrix<Real, 3, 1>& d) {
  const Eigen::Matrix<Real, 3, 1> normal = n.cast<Real>();
  const Real c = d.dot(normal) * (polynomial.to_unit.cast<Real>() * normal).norm();
  const Real t = std::min<Real>(1, std::max<Real>(0, -2 * c));
  return 1 - t * t * t * (10 - 15 * t + 6 * t * t);
}

inline long double packed_energy(const SitePolynomial& polynomial, const Eigen::Vector3d& n,
                                 const Vector3l& d) {
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
  double rounding;  // bound on the field's rounding error
};

// Rounding bounds, the sum of two parts:
// - every sum, product and stored number in `pal_real`: number of terms times the largest term;
// - x and z: half a unit a component, 1/32767 of the largest or 1/65000 of the sum.
inline PackedField packed_field(const SitePolynomial& polynomial, const Eigen::Vector3d& n, bool rounded,
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
  // Normal of a site sampled only for inward displacements; else zero.
  Eigen::Vector3d normal(uint32_t site) const {
    return organ_.inward ? small_.sites.sites[site].inward : Eigen::Vector3d::Zero();
  }
  double reach(uint32_t site) const { return least_reach(polynomial(site).to_unit); }
  // The displacement d with A d = x, for x in the unit ball.
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

  // Work of the tool along the straight segment from a to b. Gauss points; split where |A d| = 1.
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
    // Five Gauss points on each of sixteen parts: exact for forces up to degree 9. Outside the domain the
    // force is analytic, and the error is of order (1/16)^10.
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

}  // namespace palpate::test::runtime_polynomial_dd_fixture
