// Statistics of survey errors, compared with published tables and with random draws.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include "offline/precompute/error_survey.hpp"

namespace palpate {
namespace error_survey_test {

// The bound for the errors 1, 2, ... n.
double bound_of_the_first(int n) {
  std::vector<double> values(static_cast<size_t>(n));
  std::iota(values.begin(), values.end(), 1.0);
  return covering_bound(values);
}

// Sample sizes from which the 1st, 2nd, ... largest is a 95 % / 95 % tolerance limit: Somerville 1958, Tables
// for obtaining non-parametric tolerance limits.
TEST(CoveringBound, IsThatOfTheTables) {
  const int sizes[] = {59, 93, 124, 153, 181, 208};
  for (int place = 0; place < 6; ++place) {
    EXPECT_EQ(bound_of_the_first(sizes[place]), sizes[place] - place);
    EXPECT_EQ(bound_of_the_first(sizes[place] - 1), sizes[place] - 1 - std::max(place - 1, 0));
  }
  EXPECT_EQ(bound_of_the_first(1), 1);
  EXPECT_EQ(covering_bound({}), 1) << "an error that was not measured may be all there is";
}

// In 95 % of surveys the bound covers 95 % of later samples.
TEST(CoveringBound, CoversAsOftenAsItSays) {
  constexpr int kSurveys = 4000;
  std::mt19937_64 random(3);
  std::lognormal_distribution<double> error(-3, 1);
  for (const int n : {59, 120, 480}) {
    int covering = 0;
    for (int survey = 0; survey < kSurveys; ++survey) {
      std::vector<double> values(static_cast<size_t>(n));
      for (double& value : values) value = error(random);
      const double below = 0.5 * std::erfc(-(std::log(covering_bound(values)) + 3) / std::sqrt(2.0));
      covering += below >= 0.95 ? 1 : 0;
    }
    EXPECT_GE(covering, 0.94 * kSurveys) << n;
    EXPECT_LE(covering, 0.985 * kSurveys) << n << ": as small as may be";
  }
}

// Errors that grow with a power of |d|: the estimate at a bin's upper end covers them. At the lower end the
// estimate falls by the same power, plus the difference between a line and the power.
TEST(SurveyBins, GrowAsErrorsDo) {
  constexpr double kMost = 2.0;
  for (const int power : {0, 1, 4}) {
    std::vector<SurveySample> samples;
    std::vector<SampleErrors> errors;
    for (int i = 1; i <= 400; ++i) {
      const double size = i / 400.0;
      SurveySample sample;
      sample.truth.displacement = {kMost * size, 0, 0};
      sample.truth.force = sample.truth.displacement;
      samples.push_back(sample);
      errors.push_back({0.01 * std::pow(size, power), 0.02 * std::pow(size, power)});
    }
    const SurveyTable table = tabulate_errors(samples, errors, kMost);
    for (size_t b = 1; b < table.bins.size(); ++b) {
      const SurveyBin& bin = table.bins[b];
      for (const auto& [figures, scale] : {std::pair(bin.displacement, 0.01), std::pair(bin.force, 0.02)}) {
        const double growth = std::min(0.9, 1 - std::pow(bin.from / bin.to, power));
        EXPECT_NEAR(figures.growth, growth, 0.02) << power << " " << b;
        EXPECT_NEAR(figures.bound, scale * std::pow(bin.to, power), 0.05 * figures.bound)
            << power << " " << b;
      }
    }
    EXPECT_EQ(table.bins.front().displacement.growth, 0) << "nothing is below it";
  }
}

// Errors that fall, or that follow a bin without errors, keep their measured values.
TEST(SurveyBins, DoNotGrowWhereErrorsDoNot) {
  std::vector<SurveySample> samples(120);
  std::vector<SampleErrors> errors;
  for (size_t i = 0; i < samples.size(); ++i) {
    const double size = i < 60 ? 0.7 : 0.9;
    samples[i].truth.displacement = {size, 0, 0};
    samples[i].truth.force = {size, 0, 0};
    errors.push_back({i < 60 ? 0.02 : 0.01, i < 60 ? 0.02 : 0.01});
  }
  const SurveyTable table = tabulate_errors(samples, errors, 1.0);
  EXPECT_EQ(table.bins[2].displacement.growth, 0);
  EXPECT_EQ(table.bins[2].displacement.bound, 0.02);
  EXPECT_EQ(table.bins[3].displacement.growth, 0);
  EXPECT_EQ(table.bins[3].displacement.bound, 0.01);
  EXPECT_EQ(table.bins[1].displacement.bound, 1) << "an error that was not measured may be all there is";
}

// An organ a hundred times stiffer along x than along y, and a model with equal errors along both that grow
// with |d|^2. The bounds are parts of the forces along x. With the force scale they cover the errors along y.
TEST(ForceScale, CoversErrorsOfForcesThatAreSmall) {
  constexpr double kMost = 2.0;
  constexpr double kWrong = 0.01;
  std::vector<SurveySample> samples;
  for (int i = 1; i <= 240; ++i) {
    const double size = kMost * i / 240;
    SurveySample sample;
    const bool stiff = i % 40 != 0;
    sample.truth.displacement = stiff ? Eigen::Vector3d(size, 0, 0) : Eigen::Vector3d(0, size, 0);
    sample.truth.force = (stiff ? 1.0 : 0.01) * sample.truth.displacement;
    sample.truth.field = Eigen::VectorXd::Zero(3);
    samples.push_back(sample);
  }
  const SurveyTable table = survey_errors(samples, kMost, [&](size_t, const Eigen::Vector3d& d) {
    const auto truth = std::find_if(samples.begin(), samples.end(),
                                    [&](const SurveySample& one) { return one.truth.displacement == d; });
    return Answer{Eigen::VectorXd::Zero(3),
                  truth->truth.force + Eigen::Vector3d(0, 0, kWrong * d.squaredNorm())};
  });
  for (const SurveySample& sample : samples) {
    const double part = sample.truth.displacement.norm() / kMost;
    const auto bin = static_cast<size_t>(std::min(3.0, std::floor(4 * part * (1 - 1e-12))));
    const double error = kWrong * kMost * part * kMost * part;
    // All samples but the few above each 95 % bound.
    const SurveyBin& of = table.bins[bin];
    if (part < 0.97 * of.to) {
      const double below = (of.to - part) / (of.to - of.from);
      EXPECT_GE(of.force.bound * (1 - of.force.growth * below) * table.force_scale * part, error) << part;
    }
  }
}

}  // namespace error_survey_test
}  // namespace palpate
