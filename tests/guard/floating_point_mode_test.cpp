// Frames flush subnormal numbers and restore the caller's floating-point mode.
#include <gtest/gtest.h>

#include <cfenv>
#include <cmath>
#include <cstring>
#include <limits>

#include "tests/support/runtime_session.hpp"
#include "tests/support/small_pack.hpp"

namespace palpate::test {
namespace floating_point_mode_test {

double halved(double value) {
  volatile double half = 0.5;  // volatile: the compiler must not compute the product
  return value * half;
}

class FloatingPointMode : public ::testing::TestWithParam<pal_model> {};
INSTANTIATE_TEST_SUITE_P(Runtime, FloatingPointMode,
                         ::testing::Values(PAL_MODEL_LINEAR, PAL_MODEL_POLYNOMIAL, PAL_MODEL_ZONE),
                         [](const auto& one) {
                           return one.param == PAL_MODEL_LINEAR       ? "Linear"
                                  : one.param == PAL_MODEL_POLYNOMIAL ? "Polynomial"
                                                                      : "Zone";
                         });

TEST_P(FloatingPointMode, NoSubnormalNumberComesOut) {
  const OpenPack pack(zone_pack_bytes());
  OwnedSession session(pack.get(), GetParam(), 3, 0);
  // Pushes so small that the field's floats, and then the force's doubles, would be subnormal.
  for (const double push : {1e-38, 1e-41, 1e-300, 1e-308, 5e-324}) {
    SCOPED_TRACE(push);
    const pal_contact_result result = session.touch({{0, {0, 0, -push}, 0, {}, {}, {}}}).front();
    for (const double force : result.force) EXPECT_TRUE(force == 0 || std::isnormal(force)) << force;
    for (const pal_real displacement : session.field())
      EXPECT_TRUE(displacement == 0 || std::isnormal(displacement)) << displacement;
  }
}

TEST_P(FloatingPointMode, TheCallersModeStays) {
  const OpenPack pack(zone_pack_bytes());
  OwnedSession session(pack.get(), GetParam(), 3, 0);
  ASSERT_GT(halved(std::numeric_limits<double>::min()), 0.0) << "else this test shows nothing";
  ASSERT_EQ(std::fesetround(FE_UPWARD), 0);
  std::feclearexcept(FE_ALL_EXCEPT);
  session.touch({{0, {0, 0, -1e-310}, 0, {}, {}, {}}});
  session.field();
  EXPECT_EQ(std::fetestexcept(FE_ALL_EXCEPT), 0);
  EXPECT_EQ(std::fegetround(), FE_UPWARD);
  std::fesetround(FE_TONEAREST);
  EXPECT_GT(halved(std::numeric_limits<double>::min()), 0.0);
}

// Debug builds of engines trap on NaN: a NaN input must not end the process. The rounding mode must not
// change the result.
TEST_P(FloatingPointMode, TheCallersModeChangesNothing) {
  const OpenPack pack(zone_pack_bytes());
  OwnedSession session(pack.get(), GetParam(), 3, 0);
  const pal_contact_result expected = session.touch({{0, {0.01, 0, -0.03}, 0, {}, {}, {}}}).front();
  ASSERT_EQ(std::fesetround(FE_DOWNWARD), 0);
  OwnedSession another(pack.get(), GetParam(), 3, 0);
  const pal_contact_result downward = another.touch({{0, {0.01, 0, -0.03}, 0, {}, {}, {}}}).front();
  std::fesetround(FE_TONEAREST);
  EXPECT_EQ(std::memcmp(&expected, &downward, sizeof expected), 0);
#ifdef __GLIBC__
  pal_hold hold = pal_default_hold(0);
  hold.weights[1] = std::numeric_limits<double>::quiet_NaN();
  const pal_contact contact = {0, {std::numeric_limits<double>::signaling_NaN(), 0, 0}, 0, {}, {}, {}};
  const pal_pose pose = {{std::numeric_limits<double>::quiet_NaN(), 0, 0}, {1, 0, 0, 0}};
  pal_haptic_input input = {};
  input.struct_size = sizeof input;
  input.num_tools = 1;
  input.poses = &pose;
  input.dt = std::numeric_limits<double>::quiet_NaN();
  feenableexcept(FE_INVALID | FE_DIVBYZERO | FE_OVERFLOW);
  const pal_status held = pal_tool_hold(session.get(), 0, &hold);
  const pal_status touched = pal_contact_frame(session.get(), &contact, 1, nullptr);
  const pal_status framed = pal_haptic_frame(session.get(), &input, nullptr);
  fedisableexcept(FE_ALL_EXCEPT);
  EXPECT_EQ(held, PAL_STATUS_NOT_FINITE);
  EXPECT_EQ(touched, PAL_STATUS_NOT_FINITE);
  EXPECT_EQ(framed, PAL_STATUS_OK);
#endif
}

}  // namespace floating_point_mode_test
}  // namespace palpate::test
