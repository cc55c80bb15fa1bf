// The live exterior: a zone and the organ outside of it come to the equilibrium of the whole organ.
#include "runtime/src/exterior/exterior.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/support/column.hpp"
#include "tests/support/live_organ.hpp"

namespace palpate {
namespace exterior_test {

using test::ContactAnswer;
using test::LiveOrgan;
using test::Memory;
using test::tissue_block;
using test::ZoneBlock;

const std::vector<pal_contact> kOne = {{4, {0.03, -0.02, -0.1}, 0, {}, {}, {}}};
const std::vector<pal_contact> kNeighbours = {{0, {0.03, 0, -0.1}, 0, {}, {}, {}},
                                              {8, {-0.03, 0.02, -0.1}, 0, {}, {}, {}}};

// Errors after each iteration where the contacts have come to rest, with an iteration for each step on the way.
std::vector<double> errors_of(const ZoneBlock& organ, const std::vector<pal_contact>& contacts, int rings,
                              int iterations) {
  const ContactAnswer truth = organ.solve(contacts);
  LiveOrgan live(organ, contacts, rings);
  for (int step = 1; step <= 8; ++step) {
    if (step > 1) {
      EXPECT_TRUE(live.iterate());
    }
    live.move(0.125 * step);
  }
  std::vector<double> errors;
  for (int iteration = 0; iteration < iterations; ++iteration) {
    EXPECT_TRUE(live.iterate());
    errors.push_back(live.error(truth));
  }
  return errors;
}

TEST(Exterior, ComesToTheEquilibriumOfTheWholeOrgan) {
  for (const auto* contacts : {&kOne, &kNeighbours}) {
    const std::vector<double> errors = errors_of(tissue_block(2), *contacts, 1, 14);
    SCOPED_TRACE(testing::PrintToString(errors));
    EXPECT_LT(errors[3], 0.1 * errors[0]);
    EXPECT_LT(errors.back(), 1e-7);
  }
}

TEST(Exterior, ComesThereUnderGravityWithTenNodes) {
  const std::vector<pal_contact> contacts = {{0, {0.03, -0.02, -0.1}, 0, {}, {}, {}}};
  const std::vector<double> errors =
      errors_of(tissue_block(1, true, Eigen::Vector3d(0, 0.1, -0.3), 2, 0.6), contacts, 1, 14);
  SCOPED_TRACE(testing::PrintToString(errors));
  EXPECT_LT(errors.back(), 1e-7);
}

TEST(Exterior, ComesThereWithSharedVolumes) {
  const std::vector<pal_contact> contacts = {{0, {0.03, -0.02, -0.1}, 0, {}, {}, {}}};
  const std::vector<double> errors =
      errors_of(tissue_block(1, false, Eigen::Vector3d::Zero(), 3, 0.4, true), contacts, 1, 14);
  SCOPED_TRACE(testing::PrintToString(errors));
  EXPECT_LT(errors.back(), 1e-7);
}

// The organ bends outside of the zone, by a fifth of its length.
TEST(Exterior, ComesThereWhereTheOrganBends) {
  const std::vector<pal_contact> contacts = {{0, {1.6, 0, 0}, 0, {}, {}, {}}};
  const std::vector<double> errors = errors_of(test::column(test::kTissue, false), contacts, 1, 14);
  SCOPED_TRACE(testing::PrintToString(errors));
  EXPECT_GT(errors[0], 1e-2);
  EXPECT_LT(errors.back(), 1e-4);
}

TEST(Exterior, ComesThereWhereNearlyIncompressibleTissueBends) {
  const std::vector<pal_contact> contacts = {{0, {0.64, 0, 0}, 0, {}, {}, {}}};
  const std::vector<double> errors =
      errors_of(test::column(CompressibleNeoHookean{1.0, 49.0}, true), contacts, 1, 20);
  SCOPED_TRACE(testing::PrintToString(errors));
  EXPECT_GT(errors[0], 1e-2);
  EXPECT_LT(errors.back(), 2e-3);
}

TEST(Exterior, StoresNothingAtRestUnderGravity) {
  LiveOrgan live(tissue_block(1, true, Eigen::Vector3d(0, 0.1, -0.3), 2, 0.6), {{0, {}, 0, {}, {}, {}}}, 1);
  ASSERT_TRUE(live.iterate());
  EXPECT_GT(live.state().rest_energy, 1e-6);
  EXPECT_NEAR(live.state().energy, 0, 1e-9 * live.state().rest_energy);
}

TEST(Exterior, DependsOnNoSlices) {
  LiveOrgan whole(tissue_block(2), kNeighbours, 1);
  LiveOrgan sliced(tissue_block(2), kNeighbours, 1);
  for (LiveOrgan* live : {&whole, &sliced}) live->move(0.5);
  for (int iteration = 0; iteration < 3; ++iteration) {
    ASSERT_TRUE(whole.iterate());
    ASSERT_TRUE(sliced.iterate(1));
  }
  const ExteriorState& one = whole.state();
  const ExteriorState& other = sliced.state();
  EXPECT_EQ(one.energy, other.energy);
  for (size_t i = 0; i < whole.num_values(); ++i) {
    ASSERT_EQ(one.displacement[i], other.displacement[i]);
    ASSERT_EQ(one.forces[i], other.forces[i]);
  }
}

// A tool that tears the organ apart in one step.
TEST(Exterior, KeepsItsStateWhereTissueWouldBeInverted) {
  const std::vector<pal_contact> torn = {{4, {0, 0, -3.0}, 0, {}, {}, {}}};
  LiveOrgan live(tissue_block(2), torn, 1);
  live.move(0.03);
  ASSERT_TRUE(live.iterate());
  const std::vector<double> before(live.state().displacement, live.state().displacement + live.num_values());
  const std::vector<double> forces(live.state().forces, live.state().forces + live.num_values());
  live.move_without_solving(1.0);
  EXPECT_FALSE(live.iterate());
  for (size_t i = 0; i < before.size(); ++i) {
    ASSERT_EQ(live.state().displacement[i], before[i]);
    ASSERT_EQ(live.state().forces[i], forces[i]);
  }
}

// y <- A y + b with eigenvalues beyond 1: plain iteration diverges.
TEST(Acceleration, FindsTheFixedPointOfALinearMapThatDiverges) {
  constexpr size_t kSize = 40;
  Acceleration acceleration;
  const Memory memory([&](Arena& arena) { carve_acceleration(kSize, arena, acceleration); });
  restart_acceleration(acceleration);
  const double slopes[] = {-1.5, 0.9, 0.2, -0.3};
  std::vector<double> y(kSize, 0.0);
  for (int iteration = 0; iteration < 12; ++iteration) {
    std::vector<double> image(kSize);
    for (size_t i = 0; i < kSize; ++i) image[i] = slopes[i % 4] * y[i] + 1.0 + 0.1 * static_cast<double>(i);
    accelerate(y.data(), image.data(), acceleration);
    y = image;
  }
  for (size_t i = 0; i < kSize; ++i)
    EXPECT_NEAR(y[i], (1.0 + 0.1 * static_cast<double>(i)) / (1 - slopes[i % 4]), 1e-8);
}

}  // namespace exterior_test
}  // namespace palpate
