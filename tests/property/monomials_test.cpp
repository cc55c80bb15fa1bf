// The order of monomials that builder and runtime share, in three forms that must agree.
#include "schemas/monomials.hpp"
#include "schemas/pack_layout.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>
#include <vector>

namespace palpate {
namespace monomials_test {

constexpr std::uint32_t kDegree = pack::kMaxDegree + 1;  // degree of an energy

TEST(Monomials, AreListedAsTheFormatSays) {
  std::string listed;
  pack::for_each_monomial(3, [&](std::uint32_t, std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    listed += std::string(a, 'x') + std::string(b, 'y') + std::string(c, 'z') + " ";
  });
  EXPECT_EQ(listed, " x y z xx xy xz yy yz zz xxx xxy xxz xyy xyz xzz yyy yyz yzz zzz ");
}

TEST(Monomials, IndexFindsWhatTheListShows) {
  std::uint32_t expected = 0;
  std::uint32_t degree_before = 0;
  pack::for_each_monomial(kDegree,
                          [&](std::uint32_t index, std::uint32_t a, std::uint32_t b, std::uint32_t c) {
                            EXPECT_EQ(index, expected);
                            EXPECT_EQ(pack::monomial_index(a, b, c), index) << a << b << c;
                            const std::uint32_t degree = a + b + c;
                            if (degree != degree_before) {
                              EXPECT_EQ(pack::monomial_start(degree), index);
                            }
                            degree_before = degree;
                            ++expected;
                          });
  EXPECT_EQ(expected, pack::num_monomials(0, kDegree));
  EXPECT_EQ(expected, pack::monomial_start(kDegree + 1));
}

TEST(Monomials, CountsAddUp) {
  EXPECT_EQ(pack::num_monomials(0), 1U);
  EXPECT_EQ(pack::num_monomials(3), 10U);
  EXPECT_EQ(pack::num_monomials(2, 3), 16U);
  EXPECT_EQ(pack::num_monomials(1, kDegree), pack::num_monomials(0, kDegree) - 1);
}

template <typename Real>
void expect_values(Real tolerance) {
  for (const std::array<Real, 3> x : {std::array<Real, 3>{Real(0.7), Real(-1.3), Real(0.4)},
                                      {Real(-0.9), Real(0), Real(1)},
                                      {Real(0), Real(0), Real(0)}}) {
    std::vector<Real> values(pack::num_monomials(0, kDegree), Real(-99));
    pack::evaluate_monomials(x.data(), kDegree, values.data());
    pack::for_each_monomial(kDegree, [&](std::uint32_t index, std::uint32_t a, std::uint32_t b,
                                         std::uint32_t c) {
      const double expected = std::pow(static_cast<double>(x[0]), a) *
                              std::pow(static_cast<double>(x[1]), b) * std::pow(static_cast<double>(x[2]), c);
      EXPECT_NEAR(static_cast<double>(values[index]), expected,
                  static_cast<double>(tolerance) * std::abs(expected))
          << a << b << c;
    });
  }
}

// One rounding for each of the kDegree - 1 products.
TEST(Monomials, ValuesInDoublePrecision) {
  expect_values<double>(kDegree * 2.3e-16);
}
TEST(Monomials, ValuesInSinglePrecision) {
  expect_values<float>(static_cast<float>(kDegree) * 1.2e-7F);
}

TEST(Monomials, DividedAreThoseOverTheirFactorials) {
  constexpr pack::Inverses<kDegree> kInverses;
  const double x[3] = {0.7, -1.3, 0.4};
  std::vector<double> plain(pack::num_monomials(0, kDegree));
  std::vector<double> divided(plain.size() + 1, -99.0);
  pack::evaluate_monomials(x, kDegree, plain.data());
  pack::evaluate_divided_monomials(x, kDegree, kInverses, divided.data());
  pack::for_each_monomial(
      kDegree, [&](std::uint32_t index, std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        const double factorials = std::tgamma(a + 1.0) * std::tgamma(b + 1.0) * std::tgamma(c + 1.0);
        EXPECT_NEAR(divided[index] * factorials, plain[index], 1e-14 * std::abs(plain[index])) << a << b << c;
      });
  EXPECT_EQ(divided.back(), -99.0);
}

TEST(Monomials, WritesNoMoreThanItSays) {
  const double x[3] = {2, 3, 5};
  for (std::uint32_t degree = 0; degree <= kDegree; ++degree) {
    std::vector<double> values(pack::num_monomials(0, degree) + 1, -99.0);
    pack::evaluate_monomials(x, degree, values.data());
    EXPECT_EQ(values.back(), -99.0);
    EXPECT_NE(values[values.size() - 2], -99.0);
  }
}

}  // namespace monomials_test
}  // namespace palpate
