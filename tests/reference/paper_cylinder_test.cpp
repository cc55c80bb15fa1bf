// Bounds from the study of Zhong et al. 2005 section 2.4 (bench/solver/paper_cylinder.cpp): the difference
// between eq. (1) and Abaqus' eq. (11) on the paper's cylinder, and its cause.
#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "offline/material/constitutive_response.hpp"
#include "tests/support/paper_cylinder.hpp"
#include "tests/support/tetrahedral_block.hpp"

namespace palpate {
namespace paper_cylinder_test {

using test::equation_11;
using test::kPaperHeight;
using test::kPaperLambda;
using test::kPaperMu;

// A force with a response that is linear to 1e-4.
constexpr double kTiny = 0.01;

// z of P1 under each force; forces grow from rest.
std::vector<double> tip(const Law& law, const std::vector<double>& forces, bool ten_nodes = false) {
  Model model = test::paper_cylinder(PALPATE_SOURCE_DIR, law);
  if (ten_nodes) {
    model.fixed.clear();
    model = test::with_fixed_base(test::with_middle_nodes(std::move(model)));
  }
  test::LoadedCylinder body(std::move(model));
  std::vector<double> z;
  for (const double force : forces) {
    const std::optional<Eigen::VectorXd> displacement = body.under(force);
    if (!displacement) throw std::runtime_error("no equilibrium at " + std::to_string(force));
    z.push_back((*displacement)[3 * test::marked_node(body.model(), "P1") + 2]);
  }
  return z;
}

// Relative excess of the tip's displacement by eq. (11) over eq. (1).
std::vector<double> excess(double lambda, double kappa, const std::vector<double>& forces,
                           bool ten_nodes = false) {
  const std::vector<double> ours = tip(CompressibleNeoHookean{kPaperMu, lambda}, forces, ten_nodes);
  std::vector<double> part = tip(equation_11(kPaperMu, kappa), forces, ten_nodes);
  for (size_t i = 0; i < part.size(); ++i) part[i] = part[i] / ours[i] - 1;
  return part;
}

double matching(double lambda) {
  return lambda + 2 * kPaperMu / 3;
}

// Eq. (1) = eq. (11) + mu/2 (3 J^(2/3) - 3 - 2 ln J) + mu/2 (J^(2/3) - 1)(J^(-2/3) I - 3).
TEST(PaperCylinder, LawsDifferByAVolumeTermAndACoupling) {
  test::TestRandom random(3);
  for (int sample = 0; sample < 20; ++sample) {
    Eigen::Matrix3d F = Eigen::Matrix3d::Identity();
    for (double& value : F.reshaped()) value += 0.3 * random();
    const double J = F.determinant();
    ASSERT_GT(J, 0);
    const double q = std::cbrt(J * J);
    const double difference = strain_energy_density(CompressibleNeoHookean{kPaperMu, kPaperLambda}, F) -
                              strain_energy_density(equation_11(kPaperMu, kPaperLambda), F);
    const double volume = kPaperMu / 2 * (3 * q - 3 - 2 * std::log(J));
    const double coupling = kPaperMu / 2 * (q - 1) * (F.squaredNorm() / q - 3);
    EXPECT_NEAR(difference, volume + coupling, 1e-14);
  }
}

// At small strain only the bulk moduli differ: lambda against lambda + 2 mu/3. On any mesh the volumetric
// part of the energy bounds the tip's difference by the moduli's difference.
TEST(PaperCylinder, AtRestTheBulkModulusIsTheDifference) {
  EXPECT_NEAR(excess(kPaperLambda, matching(kPaperLambda), {-kTiny})[0], 0, 1e-3);
  for (const bool ten_nodes : {false, true}) {
    double before = 0.25;  // upper bound for four and ten nodes
    for (const double ratio : {1.0, 100.0, 1000.0}) {
      const double lambda = ratio * kPaperLambda;
      const double found = excess(lambda, lambda, {-kTiny}, ten_nodes)[0];
      EXPECT_GT(found, ratio == 1.0 ? 0.18 : 0.0) << ratio;
      EXPECT_LT(found, before) << ratio;
      EXPECT_LT(found, 2 * kPaperMu / (3 * lambda)) << ratio;
      before = found / 4;  // least decrease from ratio to ratio
    }
  }
}

// The coupling is the shear modulus mu J^(2/3) of eq. (1): below mu in compression, above mu in tension.
// Under a push it reverses the sign of the difference.
TEST(PaperCylinder, UnderLoadTheCouplingTurnsTheSign) {
  const std::vector<double> push = excess(kPaperLambda, kPaperLambda, {-5, -10, -20, -40, -60, -80});
  for (size_t i = 1; i < push.size(); ++i) EXPECT_LT(push[i], push[i - 1]);
  EXPECT_NEAR(push[1], 0.128, 0.005);
  EXPECT_NEAR(push.back(), -0.096, 0.005);
  const std::vector<double> pull = excess(kPaperLambda, kPaperLambda, {5, 10, 20, 40, 60});
  for (size_t i = 1; i < pull.size(); ++i) EXPECT_GT(pull[i], pull[i - 1]);

  const double pushed = excess(kPaperLambda, matching(kPaperLambda), {-5})[0];
  const double pulled = excess(kPaperLambda, matching(kPaperLambda), {5})[0];
  EXPECT_LT(pushed, -0.015);
  EXPECT_NEAR(pulled, -pushed, 0.1 * std::abs(pushed));
}

// The paper's "linear up to 18 % of the thickness": under a push the deviation is bounded here.
TEST(PaperCylinder, LinearToSixPercentAtEighteenPercentOfTheHeight) {
  const std::vector<double> z = tip(CompressibleNeoHookean{kPaperMu, kPaperLambda}, {-kTiny, -20, -37.3});
  EXPECT_NEAR(z[2], -0.18 * kPaperHeight, 0.01);
  EXPECT_NEAR(z[2] / -37.3 * -kTiny / z[0] - 1, -0.061, 0.003);
}

}  // namespace paper_cylinder_test
}  // namespace palpate
