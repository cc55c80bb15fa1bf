// Figures of a set of errors, against tables and chance.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include "offline/precompute/error_survey.hpp"

namespace palpate {
namespace {

// Of 1, 2, ... n.
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

// In 95 % of surveys it covers 95 % of what comes after.
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

// An organ a hundred times as stiff along x as along y, and a model that is wrong by the same along both, as the
// square of the push: its bounds are parts of the forces along x, and beside the force scale cover what it is wrong
// by along y.
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
    // All but the few above each bound of 95 %.
    if (part < 0.97 * table.bins[bin].to) {
      EXPECT_GE(table.bins[bin].force.bound * table.force_scale * part, error) << part;
    }
  }
}

}  // namespace
}  // namespace palpate
