// Zhong et al. 2005 eq. (1): the stress is the derivative of the energy, the tangent that of the stress, and
// both know no direction in space.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "offline/material/compressible_neo_hookean.hpp"
#include "tests/support/tetrahedral_block.hpp"

namespace palpate {
namespace {

using test::rotation_about;
using test::TestRandom;

// Identities that hold term by term: rounding of a determinant and an inverse, which a nearly inverted F
// (smallest stretch 0.02) magnifies about 50 times each.
constexpr double kIdentity = 1e-11;

struct Case {
  std::string name;
  CompressibleNeoHookean law;
  Eigen::Matrix3d F;
  double smallest_stretch;  // what a finite difference step must stay well below
};

Eigen::Matrix3d random_rotation(TestRandom& random) {
  const Eigen::Vector3d axis = random.vector();
  return rotation_about(axis, 3.0 * random());
}

// Random rotations on both sides of given stretches.
std::vector<Case> cases() {
  TestRandom random(11);
  const std::vector<CompressibleNeoHookean> laws = {{0.48, 0.2}, {1.0, 4.0}, {2.0, 100.0}};
  const std::vector<Eigen::Vector3d> stretches = {{1.0, 1.0, 1.0}, {1.3, 0.9, 0.8}, {1.6, 0.6, 1.1},
                                                  {0.5, 0.6, 0.7}, {2.5, 1.5, 0.4}, {1.0, 1.2, 0.05},
                                                  {3.0, 1.0, 0.02}};
  std::vector<Case> result;
  for (const CompressibleNeoHookean& law : laws) {
    for (const Eigen::Vector3d& stretch : stretches) {
      const Eigen::Matrix3d left = random_rotation(random);
      const Eigen::Matrix3d F = left * stretch.asDiagonal() * random_rotation(random);
      result.push_back({"lambda/mu " + std::to_string(law.lambda / law.mu) + ", smallest stretch " +
                            std::to_string(stretch.minCoeff()),
                        law, F, stretch.minCoeff()});
    }
  }
  return result;
}

// d value / d F_kL by central differences, a column for each (k, L).
Eigen::MatrixXd central_difference(const std::function<Eigen::VectorXd(const Eigen::Matrix3d&)>& value,
                                   const Eigen::Matrix3d& F, double step) {
  Eigen::MatrixXd derivative(value(F).size(), 9);
  for (int column = 0; column < 9; ++column) {
    Eigen::Matrix3d forward = F;
    Eigen::Matrix3d backward = F;
    forward(column % 3, column / 3) += step;
    backward(column % 3, column / 3) -= step;
    derivative.col(column) = (value(forward) - value(backward)) / (2 * step);
  }
  return derivative;
}

// Halving the step must quarter the error while truncation rules, and some step must reach the floor between
// truncation and rounding.
void expect_second_order(const std::function<Eigen::VectorXd(const Eigen::Matrix3d&)>& value,
                         const Eigen::MatrixXd& exact, const Case& c) {
  // A central difference of double precision can reach eps^(2/3) = 4e-11 of the function over its scale; a
  // determinant that lost two digits to near inversion takes two more.
  constexpr double kFloor = 2e-8;
  double before = 0;
  for (int halving = 0; halving < 5; ++halving) {
    const double step = 0.02 * c.smallest_stretch * std::pow(0.5, halving);
    const double error = (central_difference(value, c.F, step) - exact).norm();
    if (halving > 0) {
      EXPECT_NEAR(before / error, 4.0, 0.1) << c.name << ", halving " << halving;
    }
    before = error;
  }
  double best = std::numeric_limits<double>::infinity();
  for (const double relative_step : {1e-4, 1e-5, 1e-6}) {
    const Eigen::MatrixXd difference = central_difference(value, c.F, relative_step * c.smallest_stretch);
    best = std::min(best, (difference - exact).norm());
  }
  const double scale = std::max(exact.norm(), c.law.mu);  // the stress vanishes at rest
  EXPECT_LE(best, kFloor * scale) << c.name;
}

TEST(MaterialCompressibleNeoHookean, StressIsTheDerivativeOfTheEnergy) {
  for (const Case& c : cases()) {
    const auto energy = [&](const Eigen::Matrix3d& F) {
      return Eigen::VectorXd::Constant(1, strain_energy_density(c.law, F)).eval();
    };
    const Eigen::Matrix3d stress = first_piola_kirchhoff(c.law, c.F);
    expect_second_order(energy, stress.reshaped().transpose(), c);
  }
}

TEST(MaterialCompressibleNeoHookean, TangentIsTheDerivativeOfTheStress) {
  for (const Case& c : cases()) {
    const auto stress = [&](const Eigen::Matrix3d& F) {
      return Eigen::VectorXd(first_piola_kirchhoff(c.law, F).reshaped());
    };
    expect_second_order(stress, stress_and_tangent(c.law, c.F).tangent, c);
  }
}

TEST(MaterialCompressibleNeoHookean, BothFunctionsGiveTheSameStress) {
  for (const Case& c : cases()) {
    const Eigen::Matrix3d alone = first_piola_kirchhoff(c.law, c.F);
    const Eigen::Matrix3d with_tangent = stress_and_tangent(c.law, c.F).first_piola_kirchhoff;
    EXPECT_LE((alone - with_tangent).norm(), kIdentity * (alone.norm() + c.law.mu)) << c.name;
  }
}

TEST(MaterialCompressibleNeoHookean, TurnsWithTheObserver) {
  TestRandom random(12);
  for (const Case& c : cases()) {
    const Eigen::Matrix3d Q = random_rotation(random);
    const Eigen::Matrix3d stress = first_piola_kirchhoff(c.law, c.F);
    EXPECT_LE((first_piola_kirchhoff(c.law, Q * c.F) - Q * stress).norm(),
              kIdentity * (stress.norm() + c.law.mu))
        << c.name;
    const double energy = strain_energy_density(c.law, c.F);
    EXPECT_NEAR(strain_energy_density(c.law, Q * c.F), energy, kIdentity * (energy + c.law.mu)) << c.name;
  }
}

TEST(MaterialCompressibleNeoHookean, IsIsotropic) {
  TestRandom random(13);
  for (const Case& c : cases()) {
    const Eigen::Matrix3d Q = random_rotation(random);
    const Eigen::Matrix3d stress = first_piola_kirchhoff(c.law, c.F);
    EXPECT_LE((first_piola_kirchhoff(c.law, c.F * Q) - stress * Q).norm(),
              kIdentity * (stress.norm() + c.law.mu))
        << c.name;
    const double energy = strain_energy_density(c.law, c.F);
    EXPECT_NEAR(strain_energy_density(c.law, c.F * Q), energy, kIdentity * (energy + c.law.mu)) << c.name;
  }
}

TEST(MaterialCompressibleNeoHookean, TangentIsSymmetric) {
  for (const Case& c : cases()) {
    const Matrix9d tangent = stress_and_tangent(c.law, c.F).tangent;
    // Its two sides are the same products in another order.
    EXPECT_LE((tangent - tangent.transpose()).norm(), 1e-14 * tangent.norm()) << c.name;
  }
}

TEST(MaterialCompressibleNeoHookean, CauchyStressIsThePapersSecondEquation) {
  for (const Case& c : cases()) {
    const double J = c.F.determinant();
    const Eigen::Matrix3d cauchy = first_piola_kirchhoff(c.law, c.F) * c.F.transpose() / J;
    const Eigen::Matrix3d unit = Eigen::Matrix3d::Identity();
    const Eigen::Matrix3d expected =
        c.law.mu / J * (c.F * c.F.transpose() - unit) + c.law.lambda * (J - 1) * unit;
    EXPECT_LE((cauchy - expected).norm(), kIdentity * (expected.norm() + c.law.mu / J)) << c.name;
  }
}

TEST(MaterialCompressibleNeoHookean, RestAndRotationsAreFreeOfStress) {
  TestRandom random(14);
  for (const CompressibleNeoHookean law : {CompressibleNeoHookean{0.48, 0.2}, {1.0, 4.0}, {2.0, 1e4}}) {
    const Eigen::Matrix3d unit = Eigen::Matrix3d::Identity();
    EXPECT_EQ(first_piola_kirchhoff(law, unit).norm(), 0.0) << "to the bit: rest must not creep";
    EXPECT_EQ(strain_energy_density(law, unit), 0.0);
    const Eigen::Matrix3d Q = random_rotation(random);
    EXPECT_LE(first_piola_kirchhoff(law, Q).norm(), 1e-14 * (law.mu + law.lambda));
  }
}

TEST(MaterialCompressibleNeoHookean, SmallStrainTangentIsHookesLaw) {
  for (const CompressibleNeoHookean law : {CompressibleNeoHookean{0.48, 0.2}, {1.0, 4.0}}) {
    const Matrix9d tangent = stress_and_tangent(law, Eigen::Matrix3d::Identity()).tangent;
    for (int i = 0; i < 3; ++i) {
      for (int J = 0; J < 3; ++J) {
        for (int k = 0; k < 3; ++k) {
          for (int L = 0; L < 3; ++L) {
            const double hooke =
                law.lambda * (i == J) * (k == L) + law.mu * ((i == k) * (J == L) + (i == L) * (J == k));
            EXPECT_NEAR(tangent(i + 3 * J, k + 3 * L), hooke, 1e-15 * (law.mu + law.lambda));
          }
        }
      }
    }
  }
}

TEST(MaterialCompressibleNeoHookean, EnergyGrowsWithoutBoundTowardInversion) {
  const CompressibleNeoHookean law = {0.48, 0.2};
  double before = 0;
  for (int digits = 1; digits <= 300; digits += 10) {
    const double energy =
        strain_energy_density(law, Eigen::Vector3d(1, 1, std::pow(10.0, -digits)).asDiagonal());
    EXPECT_GT(energy, before);
    before = energy;
  }
  EXPECT_GT(before, 300.0);  // mu ln 10 for each digit
}

}  // namespace
}  // namespace palpate
