// The choice of a fit's degree, and its cross-validated error.
#include <gtest/gtest.h>

#include "tests/support/polynomial_fit_fixture.hpp"

namespace palpate::polynomial_fit_fixture {
namespace polynomial_degree_test {

// ---- Leave-one-out error

// Errors of refits without each sample with |A d| up to `within`.
double error_by_refits(const SiteSamples& samples, int degree, double within = 1.1) {
  double squares = 0;
  int pushes = 0;
  for (size_t i = 0; i < samples.samples.size(); ++i) {
    SiteSamples others = samples;
    others.samples.erase(others.samples.begin() + static_cast<std::ptrdiff_t>(i));
    const Sample& left_out = samples.samples[i];
    if ((samples.to_unit * left_out.displacement).norm() > within) continue;
    ++pushes;
    const Eigen::VectorXd error =
        value_of(fit_polynomial(others, degree), left_out.displacement) - left_out.field;
    const double part = largest_node(error) / left_out.displacement.norm();
    squares += part * part;
  }
  return std::sqrt(squares / pushes);
}

TEST(PolynomialFit, HeldOutErrorIsThatOfRefitsWithoutEachSample) {
  for (const bool half : {false, true}) {
    for (const int degree : {2, 3, 4}) {
      SCOPED_TRACE(testing::Message() << degree << (half ? " half" : ""));
      const SiteSamples samples = rough_samples(12, degree, half);
      const double expected = error_by_refits(samples, degree);
      const HeldOutError error = held_out_error(samples, degree);
      EXPECT_NEAR(error.all, expected, 1e-8 * expected);
      EXPECT_EQ(error.inside, error.all) << "none of so few lies inside";
      // The error differs from the error of the fit to all samples.
      const SitePolynomial fit = fit_polynomial(samples, degree);
      double squares = 0;
      for (const Sample& sample : samples.samples) {
        const double part =
            largest_node(value_of(fit, sample.displacement) - sample.field) / sample.displacement.norm();
        squares += part * part;
      }
      EXPECT_LT(std::sqrt(squares / 12), 0.9 * expected);
    }
  }
}

// A third of the samples lies inside.
TEST(PolynomialFit, HeldOutErrorInsideIsThatOfRefitsThere) {
  const SiteSamples samples = rough_samples(24, 4);
  const HeldOutError error = held_out_error(samples, 4);
  const double expected = error_by_refits(samples, 4, 0.9);
  EXPECT_NEAR(error.inside, expected, 1e-8 * expected);
  EXPECT_LT(error.inside, 0.9 * error.all);
}

// The fit uses samples outside the domain, but the error does not.
TEST(PolynomialFit, HeldOutErrorsAreOfTheDomain) {
  constexpr int kDegree = 3;
  SiteSamples samples = rough_samples(16, kDegree);
  add_beyond(kDegree, samples);
  const double expected = error_by_refits(samples, kDegree, 1.1);
  EXPECT_NEAR(held_out_error(samples, kDegree).all, expected, 1e-8 * expected);
  EXPECT_GT(error_by_refits(samples, kDegree, 2), 1.1 * expected) << "else this test shows nothing";
  double largest = 0;
  for (size_t i = 0; i < 16; ++i) largest = std::max(largest, samples.samples[i].force.norm());
  EXPECT_EQ(force_floor(samples), 0.05 * largest);
  SiteSamples none = samples;
  none.to_unit *= 1e3;
  EXPECT_EQ(held_out_error(none, kDegree).all, HUGE_VAL) << "no sample is in that domain";
}

// The force error, from the gradient of the fitted energy.
TEST(PolynomialFit, HeldOutForceErrorIsThatOfRefits) {
  for (const int degree : {2, 4}) {
    const SiteSamples samples = rough_samples(12, degree);
    double largest = 0;
    for (const Sample& sample : samples.samples) largest = std::max(largest, sample.force.norm());
    double squares = 0;
    for (size_t i = 0; i < samples.samples.size(); ++i) {
      SiteSamples others = samples;
      others.samples.erase(others.samples.begin() + static_cast<std::ptrdiff_t>(i));
      const Sample& left_out = samples.samples[i];
      const SitePolynomial fit = fit_polynomial(others, degree);
      const Eigen::Vector3d x = fit.to_unit * left_out.displacement;
      const Eigen::Vector3d force =
          fit.to_unit.transpose() * (hermite_rows(x, 2, degree + 1, 1).bottomRows<3>() * fit.energy);
      const double part = (force - left_out.force).norm() / std::max(left_out.force.norm(), 0.05 * largest);
      squares += part * part;
    }
    const double expected = std::sqrt(squares / 12);
    EXPECT_GT(expected, 1e-3);
    EXPECT_NEAR(held_out_force_error(samples, degree).all, expected, 1e-8 * expected) << degree;
  }
}

// A function of degree 9: no degree up to the usual 7 represents it. The choice rises to 9.
TEST(PolynomialFit, DegreesAreRaisedToWhatAFunctionIs) {
  const SiteSamples samples = Synthetic(9).samples(60);
  const DegreeChoice usual = choose_degree(samples);
  EXPECT_LE(usual.degree, 7);
  EXPECT_GT(usual.error, 1e-6);
  EXPECT_NEAR(usual.error, held_out_error(samples, usual.degree).all, 1e-12 * usual.error);
  EXPECT_EQ(usual.force_error, held_out_force_error(samples, usual.degree).all);
  for (int degree = usual.degree + 1; degree <= 7; ++degree)
    EXPECT_GE(held_out_error(samples, degree).all, usual.error);
  const DegreeChoice raised = raise_degree(samples, usual);
  EXPECT_GE(raised.degree, 9);
  EXPECT_LE(raised.error, 1e-3 * usual.error);
  EXPECT_TRUE(raised.keeps(1e-3 * usual.error + raised.force_error));
  EXPECT_FALSE(raised.keeps(0.5 * std::max(raised.error, raised.force_error)));
}

TEST(PolynomialFit, DegreesOfAHalfAreNotRaised) {
  const SiteSamples samples = Synthetic(9).samples(60, true);
  const DegreeChoice usual = choose_degree(samples);
  EXPECT_EQ(raise_degree(samples, usual).degree, usual.degree);
}

// Ten equations a sample, with some in reserve.
TEST(PolynomialFit, FewSamplesBearLowDegrees) {
  const int degree = choose_degree(Synthetic(9).samples(4)).degree;  // rest and three samples: 30 equations
  EXPECT_GT(degree, 1);
  EXPECT_LE(degree, 3) << "16 terms; the next degree has 31";
  const DegreeChoice none = choose_degree(Synthetic(9).samples(1));
  EXPECT_EQ(none.degree, 1);
  EXPECT_FALSE(none.keeps(1e9)) << "nothing is known of it";
}

TEST(PolynomialFit, HeldOutErrorOfWhatItHoldsIsRounding) {
  EXPECT_LE(held_out_error(Synthetic(4).samples(14), 4).all, kDouble);
  EXPECT_LE(held_out_force_error(Synthetic(4).samples(14), 4).all, 1e3 * kDouble);
}

}  // namespace polynomial_degree_test
}  // namespace palpate::polynomial_fit_fixture
