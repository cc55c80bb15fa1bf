// Four elements at once give the constitutive laws' forces and tangents, with the same bits for every
// instruction set.
#include "runtime/kernels/element_batch.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <random>

#include "offline/material/invariant_law.hpp"

namespace palpate {
namespace element_batch_test {

// A different element and stretch in each lane, and a law with all terms.
template <int kNodes>
struct Scene {
  typename ElementBatch<kNodes>::Point point;
  NodalLanes<kNodes> displacement;

  static InvariantLaw law() {
    InvariantLaw law;
    law.c10 = 3;
    law.c20 = 2;
    law.c30 = 1;
    law.volumetric.inverse_d = {20, 5, 1};
    return law;
  }

  Scene() {
    std::mt19937 random(kNodes);
    std::uniform_real_distribution<double> number(-1, 1);
    for (int lane = 0; lane < kLanes; ++lane) {
      point.volume.set(lane, 0.5 + 0.1 * lane);
      for (auto* lanes : {&point.gradients, &displacement}) {
        const double scale = lanes == &displacement ? 0.3 / kNodes : 1;
        for (auto& node : *lanes) {
          for (Lanes& axis : node) axis.set(lane, scale * number(random));
        }
      }
    }
  }
};

template <int kNodes>
Eigen::Matrix<double, 3, kNodes> lane_of(const NodalLanes<kNodes>& nodal, int lane) {
  Eigen::Matrix<double, 3, kNodes> result;
  for (int a = 0; a < kNodes; ++a) {
    for (int i = 0; i < 3; ++i) result(i, a) = nodal[static_cast<size_t>(a)][static_cast<size_t>(i)][lane];
  }
  return result;
}

template <int kNodes>
struct Answer {
  KinematicsLanes kinematics;
  NodalLanes<kNodes> force = {};
  StiffnessLanes<kNodes> stiffness = {};

  Answer(const BatchKernels<kNodes>& kernels, const Scene<kNodes>& scene) {
    kernels.deform(scene.point, scene.displacement, kinematics);
    DyadicLanes terms = {};
    for (int lane = 0; lane < kLanes; ++lane)
      terms.set(lane, dyadic_tangent(Scene<kNodes>::law(), kinematics.I1[lane], kinematics.J[lane]));
    kernels.add_force(scene.point, kinematics, terms, force);
    kernels.add_stiffness(scene.point, kinematics, terms, stiffness);
  }
};

template <int kNodes>
void expect_the_laws() {
  const Scene<kNodes> scene;
  const Answer<kNodes> answer(batch_kernels<kNodes>(), scene);
  for (int lane = 0; lane < kLanes; ++lane) {
    const auto gradients = lane_of<kNodes>(scene.point.gradients, lane);
    const Eigen::Matrix3d F =
        Eigen::Matrix3d::Identity() + lane_of<kNodes>(scene.displacement, lane) * gradients.transpose();
    ASSERT_GT(F.determinant(), 0.1);
    const StressAndTangent exact = stress_and_tangent(Scene<kNodes>::law(), F);
    const double volume = scene.point.volume[lane];
    const Eigen::Matrix<double, 3, kNodes> force = volume * exact.first_piola_kirchhoff * gradients;
    EXPECT_LT((lane_of<kNodes>(answer.force, lane) - force).norm(), 1e-13 * force.norm());
    double error = 0;
    double size = 0;
    size_t entry = 0;
    for (int b = 0; b < 3 * kNodes; ++b) {
      for (int a = b; a < 3 * kNodes; ++a, ++entry) {
        double expected = 0;  // V g_aJ A_iJkL g_bL
        for (int J = 0; J < 3; ++J) {
          for (int L = 0; L < 3; ++L)
            expected += volume * gradients(J, a / 3) * exact.tangent(a % 3 + 3 * J, b % 3 + 3 * L) *
                        gradients(L, b / 3);
        }
        error = std::hypot(error, answer.stiffness[entry][lane] - expected);
        size = std::hypot(size, expected);
      }
    }
    EXPECT_LT(error, 1e-13 * size);
  }
}

TEST(ElementBatch, DoesWhatTheLawSays) {
  expect_the_laws<4>();
  expect_the_laws<10>();
}

template <int kNodes>
void expect_the_same_bits() {
  const Scene<kNodes> scene;
  const Answer<kNodes> best(batch_kernels<kNodes>(), scene);
  const Answer<kNodes> portable(portable_batch_kernels<kNodes>(), scene);
  static_assert(sizeof best == sizeof best.kinematics + sizeof best.force + sizeof best.stiffness);
  using Bits = std::array<std::uint64_t, sizeof best / sizeof(std::uint64_t)>;
  EXPECT_EQ(std::bit_cast<Bits>(best), std::bit_cast<Bits>(portable));
}

TEST(ElementBatch, HasTheSameBitsWithEveryInstructionSet) {
  expect_the_same_bits<4>();
  expect_the_same_bits<10>();
}

}  // namespace element_batch_test
}  // namespace palpate
