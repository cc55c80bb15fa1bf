// Frames flush subnormal numbers, and leave the caller's floating-point mode as it was.
#include <gtest/gtest.h>

#include <cfenv>
#include <cmath>
#include <limits>

#include "tests/support/runtime_session.hpp"
#include "tests/support/small_pack.hpp"

namespace palpate::test {
namespace {

double halved(double value) {
  volatile double half = 0.5;  // computed when it runs
  return value * half;
}

class FloatingPointMode : public ::testing::TestWithParam<pal_model> {};
INSTANTIATE_TEST_SUITE_P(Runtime, FloatingPointMode,
                         ::testing::Values(PAL_MODEL_LINEAR, PAL_MODEL_POLYNOMIAL), [](const auto& one) {
                           return one.param == PAL_MODEL_LINEAR ? "Linear" : "Polynomial";
                         });

TEST_P(FloatingPointMode, NoSubnormalNumberComesOut) {
  const OpenPack pack(small_pack_bytes());
  OwnedSession session(pack.get(), GetParam());
  // So small that the field's floats, and then the force's doubles, would be subnormal.
  for (const double push : {1e-38, 1e-41, 1e-300, 1e-308, 5e-324}) {
    SCOPED_TRACE(push);
    const pal_contact_result result = session.touch({{0, {0, 0, -push}}}).front();
    for (const double force : result.force) EXPECT_TRUE(force == 0 || std::isnormal(force)) << force;
    for (const float displacement : session.field())
      EXPECT_TRUE(displacement == 0 || std::isnormal(displacement)) << displacement;
  }
}

TEST_P(FloatingPointMode, TheCallersModeStays) {
  const OpenPack pack(small_pack_bytes());
  OwnedSession session(pack.get(), GetParam());
  ASSERT_GT(halved(std::numeric_limits<double>::min()), 0.0) << "else this test shows nothing";
  ASSERT_EQ(std::fesetround(FE_UPWARD), 0);
  std::feclearexcept(FE_ALL_EXCEPT);
  session.touch({{0, {0, 0, -1e-310}}});
  session.field();
  EXPECT_EQ(std::fetestexcept(FE_ALL_EXCEPT), 0);
  EXPECT_EQ(std::fegetround(), FE_UPWARD);
  std::fesetround(FE_TONEAREST);
  EXPECT_GT(halved(std::numeric_limits<double>::min()), 0.0);
}

}  // namespace
}  // namespace palpate::test
