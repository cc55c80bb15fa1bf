// Every law: stress = derivative of the energy, tangent = derivative of the stress, objectivity, isotropy,
// and the textbook formula of its name.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "offline/material/constitutive_response.hpp"
#include "tests/support/tetrahedral_block.hpp"

namespace palpate {
namespace material_test {

using test::rotation_about;
using test::TestRandom;

// Rounding of a determinant and an inverse. A nearly inverted F (smallest stretch 0.02) magnifies each about
// 50 times.
constexpr double kIdentity = 1e-11;

struct NamedLaw {
  std::string name;
  Law law;
};

InvariantLaw neo_hooke(double c10, double d1) {
  InvariantLaw law;
  law.c10 = c10;
  law.volumetric.inverse_d = {1 / d1, 0, 0};
  return law;
}

InvariantLaw mooney_rivlin(double c10, double c01, double d1) {
  InvariantLaw law = neo_hooke(c10, d1);
  law.c01 = c01;
  return law;
}

InvariantLaw yeoh() {
  InvariantLaw law;
  law.c10 = 0.5;
  law.c20 = -0.05;
  law.c30 = 0.02;
  law.volumetric.inverse_d = {1.0, 0.4, 0.1};
  return law;
}

Ogden ogden(const std::vector<Ogden::Term>& terms, double d1) {
  Ogden law;
  law.terms = terms;
  law.volumetric.inverse_d = {1 / d1, 0.2, 0};
  return law;
}

// All laws but small strain, which is not objective.
std::vector<NamedLaw> finite_strain_laws() {
  return {{"eq. (1), lambda/mu 0.42", CompressibleNeoHookean{0.48, 0.2}},
          {"eq. (1), lambda/mu 4", CompressibleNeoHookean{1.0, 4.0}},
          {"eq. (1), lambda/mu 50", CompressibleNeoHookean{2.0, 100.0}},
          {"NEO HOOKE", neo_hooke(0.24, 2.0)},
          {"NEO HOOKE, nu 0.49", neo_hooke(0.5, 0.04)},
          {"MOONEY-RIVLIN", mooney_rivlin(0.3, 0.2, 0.5)},
          {"MOONEY-RIVLIN, C10 < 0", mooney_rivlin(-0.1, 0.6, 0.5)},
          {"YEOH", yeoh()},
          {"OGDEN, N=1", ogden({{1.0, 3.0}}, 0.7)},
          {"OGDEN, N=2", ogden({{0.6, 1.3}, {0.4, -2.0}}, 0.5)},
          {"OGDEN, N=3", ogden({{0.5, 1.3}, {0.1, 5.0}, {0.3, -2.0}}, 1.0)},
          {"St. Venant-Kirchhoff", StVenantKirchhoff{1.0, 2.0}}};
}

struct Case {
  std::string name;
  Law law;
  Eigen::Matrix3d F;
  double smallest_stretch;  // bounds the step of finite differences
  double shear() const { return small_strain_moduli(law).shear; }
};

Eigen::Matrix3d random_rotation(TestRandom& random) {
  const Eigen::Vector3d axis = random.vector();
  return rotation_about(axis, 3.0 * random());
}

// Random rotations on both sides of given stretches: distinct ones, two and three equal, near inversion.
std::vector<Case> cases() {
  TestRandom random(11);
  const std::vector<Eigen::Vector3d> stretches = {{1.0, 1.0, 1.0}, {1.3, 0.9, 0.8},  {1.6, 0.6, 1.1},
                                                  {0.5, 0.6, 0.7}, {2.5, 1.5, 0.4},  {1.4, 1.4, 0.7},
                                                  {1.2, 1.2, 1.2}, {1.0, 1.2, 0.05}, {3.0, 1.0, 0.02}};
  std::vector<Case> result;
  for (const NamedLaw& law : finite_strain_laws()) {
    for (const Eigen::Vector3d& stretch : stretches) {
      const Eigen::Matrix3d left = random_rotation(random);
      const Eigen::Matrix3d F = left * stretch.asDiagonal() * random_rotation(random);
      result.push_back({law.name + ", smallest stretch " + std::to_string(stretch.minCoeff()), law.law, F,
                        stretch.minCoeff()});
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

// Halving the step must quarter the error while truncation dominates. Some step must reach the floor between
// truncation and rounding.
void expect_second_order(const std::function<Eigen::VectorXd(const Eigen::Matrix3d&)>& value,
                         const Eigen::MatrixXd& exact, const Case& c) {
  // A central difference in double reaches eps^(2/3) = 4e-11 of the function's scale. Near inversion the
  // determinant loses two digits, and so two more digits are lost.
  constexpr double kFloor = 2e-8;
  double before = 0;
  int compared = 0;
  for (int halving = 0; halving < 5; ++halving) {
    const double step = 0.02 * c.smallest_stretch * std::pow(0.5, halving);
    const double error = (central_difference(value, c.F, step) - exact).norm();
    const double rounding = std::numeric_limits<double>::epsilon() * (value(c.F).norm() + c.shear()) / step;
    if (halving > 0 && error > 300 * rounding) {
      EXPECT_NEAR(before / error, 4.0, 0.1) << c.name << ", halving " << halving;
      ++compared;
    }
    before = error;
  }
  EXPECT_GE(compared, 2) << c.name;
  double best = std::numeric_limits<double>::infinity();
  for (const double relative_step : {1e-4, 1e-5, 1e-6}) {
    const Eigen::MatrixXd difference = central_difference(value, c.F, relative_step * c.smallest_stretch);
    best = std::min(best, (difference - exact).norm());
  }
  const double scale = std::max(exact.norm(), c.shear());  // the stress vanishes at rest
  EXPECT_LE(best, kFloor * scale) << c.name;
}

TEST(MaterialLaw, StressIsTheDerivativeOfTheEnergy) {
  for (const Case& c : cases()) {
    const auto energy = [&](const Eigen::Matrix3d& F) {
      return Eigen::VectorXd::Constant(1, strain_energy_density(c.law, F)).eval();
    };
    const Eigen::Matrix3d stress = first_piola_kirchhoff(c.law, c.F);
    expect_second_order(energy, stress.reshaped().transpose(), c);
  }
}

TEST(MaterialLaw, TangentIsTheDerivativeOfTheStress) {
  for (const Case& c : cases()) {
    const auto stress = [&](const Eigen::Matrix3d& F) {
      return Eigen::VectorXd(first_piola_kirchhoff(c.law, F).reshaped());
    };
    expect_second_order(stress, stress_and_tangent(c.law, c.F).tangent, c);
  }
}

TEST(MaterialLaw, BothFunctionsGiveTheSameStress) {
  for (const Case& c : cases()) {
    const Eigen::Matrix3d alone = first_piola_kirchhoff(c.law, c.F);
    const Eigen::Matrix3d with_tangent = stress_and_tangent(c.law, c.F).first_piola_kirchhoff;
    EXPECT_LE((alone - with_tangent).norm(), kIdentity * (alone.norm() + c.shear())) << c.name;
  }
}

TEST(MaterialLaw, TurnsWithTheObserver) {
  TestRandom random(12);
  for (const Case& c : cases()) {
    const Eigen::Matrix3d Q = random_rotation(random);
    const Eigen::Matrix3d stress = first_piola_kirchhoff(c.law, c.F);
    EXPECT_LE((first_piola_kirchhoff(c.law, Q * c.F) - Q * stress).norm(),
              kIdentity * (stress.norm() + c.shear()))
        << c.name;
    const double energy = strain_energy_density(c.law, c.F);
    EXPECT_NEAR(strain_energy_density(c.law, Q * c.F), energy, kIdentity * (energy + c.shear())) << c.name;
  }
}

TEST(MaterialLaw, IsIsotropic) {
  TestRandom random(13);
  for (const Case& c : cases()) {
    const Eigen::Matrix3d Q = random_rotation(random);
    const Eigen::Matrix3d stress = first_piola_kirchhoff(c.law, c.F);
    EXPECT_LE((first_piola_kirchhoff(c.law, c.F * Q) - stress * Q).norm(),
              kIdentity * (stress.norm() + c.shear()))
        << c.name;
    const double energy = strain_energy_density(c.law, c.F);
    EXPECT_NEAR(strain_energy_density(c.law, c.F * Q), energy, kIdentity * (energy + c.shear())) << c.name;
  }
}

TEST(MaterialLaw, TangentIsSymmetric) {
  for (const Case& c : cases()) {
    const Matrix9d tangent = stress_and_tangent(c.law, c.F).tangent;
    // Both sides are the same products in another order.
    EXPECT_LE((tangent - tangent.transpose()).norm(), 1e-13 * tangent.norm()) << c.name;
  }
}

TEST(MaterialLaw, RestAndRotationsAreFreeOfStress) {
  TestRandom random(14);
  for (const NamedLaw& law : finite_strain_laws()) {
    const SmallStrainModuli moduli = small_strain_moduli(law.law);
    const Eigen::Matrix3d unit = Eigen::Matrix3d::Identity();
    EXPECT_LE(first_piola_kirchhoff(law.law, unit).norm(), 1e-15 * moduli.shear)
        << law.name << ": rest must not creep";
    EXPECT_LE(std::abs(strain_energy_density(law.law, unit)), 1e-15 * moduli.shear) << law.name;
    const Eigen::Matrix3d Q = random_rotation(random);
    EXPECT_LE(first_piola_kirchhoff(law.law, Q).norm(), 1e-14 * (moduli.shear + moduli.bulk)) << law.name;
  }
}

TEST(MaterialLaw, SmallStrainTangentIsHookesLaw) {
  std::vector<NamedLaw> laws = finite_strain_laws();
  laws.push_back({"small strain", LinearElastic{1.0, 2.0}});
  for (const NamedLaw& law : laws) {
    const auto [mu, bulk] = small_strain_moduli(law.law);
    const double lambda = bulk - 2.0 / 3.0 * mu;
    const Matrix9d tangent = stress_and_tangent(law.law, Eigen::Matrix3d::Identity()).tangent;
    for (int i = 0; i < 3; ++i) {
      for (int J = 0; J < 3; ++J) {
        for (int k = 0; k < 3; ++k) {
          for (int L = 0; L < 3; ++L) {
            const double hooke =
                lambda * (i == J) * (k == L) + mu * ((i == k) * (J == L) + (i == L) * (J == k));
            EXPECT_NEAR(tangent(i + 3 * J, k + 3 * L), hooke, 1e-14 * (mu + bulk)) << law.name;
          }
        }
      }
    }
  }
}

TEST(MaterialLaw, PoissonRatioIsThatOfTheModuli) {
  EXPECT_NEAR(small_strain_moduli(CompressibleNeoHookean{0.48, 0.2}).poisson_ratio(), 0.2 / (2 * 0.68),
              1e-15);
  EXPECT_NEAR(small_strain_moduli(LinearElastic{1.0, 4.0}).poisson_ratio(), 0.4, 1e-15);
  // C10 = mu / 2 and D1 = 2 / K.
  EXPECT_NEAR(small_strain_moduli(neo_hooke(0.5, 2.0 / 50)).poisson_ratio(), (150.0 - 2) / (2 * 151.0),
              1e-15);
}

TEST(CompressibleNeoHookeanLaw, CauchyStressIsThePapersSecondEquation) {
  for (const Case& c : cases()) {
    const auto* law = std::get_if<CompressibleNeoHookean>(&c.law);
    if (law == nullptr) continue;
    const double J = c.F.determinant();
    const Eigen::Matrix3d cauchy = first_piola_kirchhoff(*law, c.F) * c.F.transpose() / J;
    const Eigen::Matrix3d unit = Eigen::Matrix3d::Identity();
    const Eigen::Matrix3d expected =
        law->mu / J * (c.F * c.F.transpose() - unit) + law->lambda * (J - 1) * unit;
    EXPECT_LE((cauchy - expected).norm(), kIdentity * (expected.norm() + law->mu / J)) << c.name;
  }
}

TEST(CompressibleNeoHookeanLaw, EnergyGrowsWithoutBoundTowardInversion) {
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

// Cauchy stress from the left Cauchy-Green tensor b of the isochoric deformation (Holzapfel 2000, section
// 6.4): sigma = 2/J dev((W_A + A W_B) b - W_B b^2) + U' 1.
TEST(InvariantLaws, CauchyStressIsTheTextbooks) {
  for (const Case& c : cases()) {
    const auto* law = std::get_if<InvariantLaw>(&c.law);
    if (law == nullptr) continue;
    const double J = c.F.determinant();
    const Eigen::Matrix3d b = std::pow(J, -2.0 / 3.0) * c.F * c.F.transpose();
    const double A = b.trace();
    const double slope = law->c10 + 2 * law->c20 * (A - 3) + 3 * law->c30 * (A - 3) * (A - 3);
    const Eigen::Matrix3d s = (slope + A * law->c01) * b - law->c01 * b * b;
    const double t = J - 1;
    const double pressure = 2 * t * law->volumetric.inverse_d[0] +
                            4 * t * t * t * law->volumetric.inverse_d[1] +
                            6 * std::pow(t, 5) * law->volumetric.inverse_d[2];
    const Eigen::Matrix3d unit = Eigen::Matrix3d::Identity();
    const Eigen::Matrix3d expected = 2 / J * (s - s.trace() / 3 * unit) + pressure * unit;
    const Eigen::Matrix3d cauchy = first_piola_kirchhoff(*law, c.F) * c.F.transpose() / J;
    EXPECT_LE((cauchy - expected).norm(), kIdentity * (expected.norm() + c.shear() / J)) << c.name;
  }
}

// With exponents 2 and -2 the sums of powers are the invariants.
TEST(OgdenLaw, WithExponentsTwoAndMinusTwoIsMooneyRivlin) {
  const InvariantLaw expected = [] {
    InvariantLaw law = mooney_rivlin(0.3, 0.2, 0.5);
    law.volumetric.inverse_d[1] = 0.2;
    return law;
  }();
  const Ogden law = ogden({{0.6, 2.0}, {0.4, -2.0}}, 0.5);
  for (const Case& c : cases()) {
    const StressAndTangent one = stress_and_tangent(law, c.F);
    const StressAndTangent other = stress_and_tangent(expected, c.F);
    const double scale = other.first_piola_kirchhoff.norm() + 1.0;
    EXPECT_LE((one.first_piola_kirchhoff - other.first_piola_kirchhoff).norm(), kIdentity * scale) << c.name;
    EXPECT_LE((one.tangent - other.tangent).norm(), 1e-10 * other.tangent.norm()) << c.name;
    EXPECT_NEAR(strain_energy_density(law, c.F), strain_energy_density(expected, c.F),
                kIdentity * (1 + strain_energy_density(expected, c.F)))
        << c.name;
  }
}

// The tangent has no step where the difference quotient of two stretches gives way to its limit.
TEST(OgdenLaw, TangentOfNearlyEqualStretchesIsThatOfEqualOnes) {
  const Ogden law = ogden({{0.6, 1.3}, {0.4, -2.0}}, 0.5);
  const Eigen::Vector3d equal(1.3, 1.3, 0.8);
  const Matrix9d at = stress_and_tangent(law, equal.asDiagonal()).tangent;
  for (const double gap : {1e-3, 1e-4, 3e-5, 1e-5, 1e-6, 1e-9, 1e-13}) {
    const Eigen::Vector3d near = equal + Eigen::Vector3d(gap, 0, 0);
    EXPECT_LE((stress_and_tangent(law, near.asDiagonal()).tangent - at).norm(),
              (10 * gap + 1e-10) * at.norm())
        << gap;
  }
}

// The runtime's principal forms agree with the invariant and tensor forms.
TEST(IsotropicLaws, PrincipalFormsAreTheSame) {
  TestRandom random(16);
  const auto expect_same = [](const PrincipalTangent& principal, const Law& law, const Eigen::Matrix3d& F) {
    const StressAndTangent expected = stress_and_tangent(law, F);
    const double scale = expected.tangent.norm();
    EXPECT_NEAR(principal.energy, strain_energy_density(law, F), 1e-13 * scale);
    EXPECT_LE((first_piola_kirchhoff(principal) - expected.first_piola_kirchhoff).norm(), 1e-12 * scale);
    EXPECT_LE((full_tangent(principal) - expected.tangent).norm(), 1e-11 * scale);
  };
  const InvariantLaw mooney = mooney_rivlin(0.3, 0.2, 0.5);
  for (const double size : {0.0, 1e-8, 1e-3, 0.2, 0.5}) {
    for (int i = 0; i < 20; ++i) {
      const Eigen::Matrix3d F = Eigen::Matrix3d::Identity() + size * random.matrix(3, 3);
      if (F.determinant() < 0.1) continue;
      const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> rows = F;
      double entries[3][3];
      std::copy_n(rows.data(), 9, entries[0]);
      SCOPED_TRACE(size);
      expect_same(principal_tangent(as_ogden(mooney), F), mooney, F);
      expect_same(st_venant_kirchhoff_tangent(1.0, 2.0, entries), StVenantKirchhoff{1.0, 2.0}, F);
      expect_same(linear_elastic_tangent(1.0, 2.0, entries), LinearElastic{1.0, 2.0}, F);
    }
  }
}

TEST(LinearElasticLaw, IsLinear) {
  TestRandom random(15);
  const LinearElastic law = {1.0, 2.0};
  const Eigen::Matrix3d unit = Eigen::Matrix3d::Identity();
  for (int i = 0; i < 10; ++i) {
    const Eigen::Matrix3d gradient = random.matrix(3, 3);
    const StressAndTangent response = stress_and_tangent(law, unit + gradient);
    const Eigen::Matrix3d strain = 0.5 * (gradient + gradient.transpose());
    const Eigen::Matrix3d stress = 2 * law.mu * strain + law.lambda * strain.trace() * unit;
    EXPECT_LE((response.first_piola_kirchhoff - stress).norm(), 1e-14 * stress.norm());
    EXPECT_LE((response.tangent * gradient.reshaped() - stress.reshaped()).norm(), 1e-14 * stress.norm());
    EXPECT_NEAR(strain_energy_density(law, unit + gradient), 0.5 * stress.cwiseProduct(strain).sum(),
                1e-14 * stress.norm());
  }
}

}  // namespace material_test
}  // namespace palpate
