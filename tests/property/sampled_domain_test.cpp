// The end of a site's sampled domain, and the samples that remain.
#include "offline/precompute/sampled_domain.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <vector>

#include "offline/precompute/error_survey.hpp"
#include "offline/precompute/sample_points.hpp"
#include "offline/precompute/site_survey.hpp"
#include "tests/support/sampling_site.hpp"

namespace palpate {
namespace sampled_domain_test {

// A domain with a given number of samples.
struct SampledDomainOf : test::SamplingSite {
  void sample_to(double reach, size_t count, bool half = false) {
    block.scene.max_displacement = reach;
    samples.half = half;
    samples.to_unit = site.frame.transpose() / reach;
    samples.linear = linear_response(linear, site);
    domain.sample_rest();
    SamplePoints points(half);
    for (size_t i = 0; i < count; i += domain.sample(points[i])) {
    }
  }
  double size_of(const Sample& sample) const { return (samples.to_unit * sample.displacement).norm(); }

  SiteSampler sampler{solver, block.sites, site, rest};
  SiteSamples samples;
  SampledDomain domain{sampler, block.scene, site, 1, samples};
};

// A known sample is neither solved again nor fitted twice.
TEST_F(SampledDomainOf, APlaceIsSampledOnce) {
  sample_to(0.5, 5);
  SamplePoints points(false);
  for (size_t i = 0; i < 5; ++i) EXPECT_TRUE(domain.sample(points[i]));
  EXPECT_EQ(domain.num_solves(), 5U);
  EXPECT_EQ(samples.samples.size(), 6U) << "and rest";
}

// The domain drops crushed samples and shrinks to exclude them.
TEST_F(SampledDomainOf, CrushedSamplesAreLeftOut) {
  constexpr double kReach = 0.8;
  sample_to(kReach, 12);
  const std::vector<Sample> before = samples.samples;
  const auto is_crushed = [](const Sample& sample) { return sample.min_jacobian < kFollowedJacobian; };
  ASSERT_TRUE(std::any_of(before.begin(), before.end(), is_crushed));
  EXPECT_LT(domain.min_jacobian(), kFollowedJacobian);
  EXPECT_GE(domain.min_jacobian(), kLeastSampledJacobian);

  domain.leave_crushed();
  EXPECT_EQ(domain.cut_by(), PushOutcome::not_followed);
  EXPECT_GE(domain.min_jacobian(), kFollowedJacobian);
  for (const Sample& sample : before) {
    if (is_crushed(sample)) {
      EXPECT_GT(size_of(sample), 1) << "it is ended before";
    }
  }
  EXPECT_TRUE(std::none_of(samples.samples.begin(), samples.samples.end(), is_crushed));
  EXPECT_EQ(
      static_cast<std::ptrdiff_t>(samples.samples.size()),
      std::count_if(before.begin(), before.end(), [&](const Sample& sample) { return !is_crushed(sample); }));

  const size_t num_solves = domain.num_solves();
  const size_t num_before = samples.samples.size();
  int num_refused = 0;
  SamplePoints points(false);
  for (size_t i = 12; i < 24; ++i) num_refused += !domain.sample(points[i]);
  EXPECT_EQ(domain.num_solves(), num_solves + 12);
  EXPECT_EQ(samples.samples.size(), num_before + 12 - static_cast<size_t>(num_refused));
  EXPECT_GT(num_refused, 0) << "else this test shows nothing";
  EXPECT_TRUE(std::none_of(samples.samples.begin(), samples.samples.end(), is_crushed));
  EXPECT_GE(least_reach(samples.to_unit), 0.25 * kReach);
}

// A trial compares the fit with a new sample. A large error ends the domain before the sample, at the part
// that the error implies. A small error leaves the domain.
TEST_F(SampledDomainOf, EndsBeforeWhatAFitIsFarOffFrom) {
  constexpr int kDegree = 3;
  sample_to(0.5, 5);
  const SitePolynomial fit = fit_polynomial(samples, kDegree);
  const Eigen::Matrix3d before = samples.to_unit;
  const double floor = force_floor(samples);
  const SiteSamples known = samples;
  domain.try_fit(fit, 10, 1);
  EXPECT_EQ(samples.to_unit, before) << "everything is within such a target";
  EXPECT_EQ(domain.cut_by(), PushOutcome::solved);
  ASSERT_EQ(samples.samples.size(), known.samples.size() + 1);
  const Sample tried = samples.samples.back();
  EXPECT_NEAR((before * tried.displacement).norm(), 0.95, 1e-12);
  const double error = errors_of(fit, tried, floor).larger();
  ASSERT_GT(error, 0.02);

  for (const double part : {0.49, 0.51}) {  // the domain shrinks above twice the target
    samples = known;
    domain.try_fit(fit, part * error, 1);
    ASSERT_EQ(samples.samples.size(), known.samples.size() + 1) << "it is fitted to all the same";
    EXPECT_EQ(samples.samples.back().displacement, tried.displacement);
    if (part > 0.5) {
      EXPECT_EQ(samples.to_unit, before);
    } else {
      EXPECT_NEAR(size_of(tried), 1 / std::pow(part, 1.0 / kDegree), 1e-12);
      EXPECT_EQ(domain.cut_by(), PushOutcome::not_followed);
    }
  }
}

// With several samples, the domain ends before each sample with a large error.
TEST_F(SampledDomainOf, EndsBeforeAllOfThem) {
  constexpr double kTarget = 0.03;
  for (const bool half : {false, true}) {
    SampledDomainOf::samples = {};
    sample_to(0.5, 5, half);
    const SitePolynomial fit = fit_polynomial(samples, 3);
    const double floor = force_floor(samples);
    const size_t num_seen = samples.samples.size();
    const size_t num_solves = domain.num_solves();
    domain.try_fit(fit, kTarget, 8);
    EXPECT_EQ(domain.num_solves(), num_solves + 8);
    ASSERT_EQ(samples.samples.size(), num_seen + 8);
    int num_far = 0;
    for (size_t i = num_seen; i < samples.samples.size(); ++i) {
      const Sample& sample = samples.samples[i];
      const bool is_far = errors_of(fit, sample, floor).larger() > 2 * kTarget;
      num_far += is_far;
      EXPECT_TRUE(!is_far || size_of(sample) > 1);
      EXPECT_TRUE(!half || sample.displacement.dot(site.inward) >= 0);
    }
    EXPECT_GT(num_far, 0);
    EXPECT_LT(num_far, 8);
  }
}

// A trial that crushes an element gives no sample, and ends the domain.
TEST_F(SampledDomainOf, TrialsThatCannotBeHadAreNoSamples) {
  sample_to(0.8, 12);
  domain.leave_crushed();
  samples.to_unit = site.frame.transpose() / 0.8;  // as far as before
  const Eigen::Matrix3d before = samples.to_unit;
  const size_t num_seen = samples.samples.size();
  const size_t num_solves = domain.num_solves();
  domain.try_fit(fit_polynomial(samples, 3), 10, 8);
  EXPECT_EQ(domain.num_solves(), num_solves + 8);
  EXPECT_LT(samples.samples.size(), num_seen + 8);
  EXPECT_NE(samples.to_unit, before);
  EXPECT_GE(domain.min_jacobian(), kFollowedJacobian);
}

// No fit meets this target: the domain shrinks to a quarter and no further.
TEST_F(SampledDomainOf, AQuarterIsLeft) {
  constexpr double kReach = 0.5;
  sample_to(kReach, 5);
  SitePolynomial wrong = fit_polynomial(samples, 3);
  wrong.linear *= 2;
  for (int trial = 0; trial < 12; ++trial) {
    domain.try_fit(wrong, 1e-6, 8);
    EXPECT_GE(least_reach(samples.to_unit), (1 - 1e-9) * 0.25 * kReach);
  }
  EXPECT_LT(least_reach(samples.to_unit), 0.26 * kReach);
}

// One axis is at a quarter already: a failed oblique trial shrinks the other axes only.
TEST_F(SampledDomainOf, TrialsBesideAnAxisAtAQuarterStopNothing) {
  constexpr double kReach = 0.8;
  sample_to(kReach, 12);
  domain.leave_crushed();
  const SitePolynomial fit = fit_polynomial(samples, 3);
  for (int axis = 0; axis < 3; ++axis) {
    Eigen::Vector3d shortened = Eigen::Vector3d::Ones();
    shortened[axis] = 4;
    samples.to_unit = shortened.asDiagonal() * site.frame.transpose() / kReach;
    EXPECT_NO_THROW(domain.try_fit(fit, 1e-3, 8));
    EXPECT_GE(least_reach(samples.to_unit), (1 - 1e-9) * 0.25 * kReach);
    EXPECT_LT(samples.to_unit.inverse().determinant(), kReach * kReach * kReach / 4) << "it has ended sooner";
  }
}

// Hard sites of a build use all their solves and no more. Their samples do not depend on the number of
// threads.
TEST_F(SampledDomainOf, HardSitesAreTheSameOnAnyNumberOfThreads) {
  SamplingPlan plan;
  plan.least_samples = 10;
  plan.most_samples = 30;
  plan.target = 1e-4;
  plan.survey_samples = 1;
  block.scene.max_displacement = 0.6;
  const std::vector<SiteResult> one = sample_sites(assembly, block.scene, block.sites, linear, plan);
  plan.jobs = 3;
  const std::vector<SiteResult> three = sample_sites(assembly, block.scene, block.sites, linear, plan);
  ASSERT_EQ(one.size(), three.size());
  int num_cut = 0;
  for (size_t i = 0; i < one.size(); ++i) {
    num_cut += one[i].cut_by == PushOutcome::not_followed;
    EXPECT_EQ(one[i].cut_by, three[i].cut_by);
    EXPECT_EQ(one[i].samples, three[i].samples);
    EXPECT_EQ(one[i].polynomial.to_unit, three[i].polynomial.to_unit);
    EXPECT_EQ(one[i].polynomial.coefficients, three[i].polynomial.coefficients);
    EXPECT_EQ(one[i].held_out_error, three[i].held_out_error);
    EXPECT_EQ(one[i].samples, plan.most_samples);
    EXPECT_EQ(one[i].counts.solves, 31) << "and the survey's";
    EXPECT_GE(one[i].min_jacobian, kFollowedJacobian);
    for (const SurveySample& push : one[i].survey)
      EXPECT_LE((one[i].polynomial.to_unit * push.truth.displacement).norm(), 1 + 1e-12)
          << "of the domain that is left";
  }
  EXPECT_GT(num_cut, 0);
  plan.target = 10;
  for (const SiteResult& easy : sample_sites(assembly, block.scene, block.sites, linear, plan)) {
    EXPECT_EQ(easy.samples, plan.least_samples) << "one that keeps its target takes no more";
    EXPECT_NE(easy.cut_by, PushOutcome::not_followed);
  }
}

// After the domain shrank, few samples lie inside: these do not measure the fit.
TEST_F(SampledDomainOf, AFitIsMeasuredByTheFewestSamplesInTheDomain) {
  SamplingPlan plan;
  plan.least_samples = 10;
  plan.target = 10;
  plan.survey_samples = 1;
  block.scene.max_displacement = 1;
  int num_shortened = 0;
  for (const SiteResult& result : sample_sites(assembly, block.scene, block.sites, linear, plan)) {
    const bool is_cut = result.cut_by != PushOutcome::solved;
    num_shortened += is_cut;
    EXPECT_EQ(result.samples > plan.least_samples, is_cut);
  }
  EXPECT_GT(num_shortened, 0);
  sample_to(1, 14);
  EXPECT_EQ(static_cast<std::ptrdiff_t>(domain.num_inside()),
            std::count_if(samples.samples.begin() + 1, samples.samples.end(),
                          [&](const Sample& sample) { return size_of(sample) <= 1 + 1e-9; }));
  EXPECT_LT(domain.num_inside() + 1, samples.samples.size());
}

// A plan with the smallest number of solves.
TEST_F(SampledDomainOf, PlansOfFewSolvesSucceed) {
  SamplingPlan plan;
  plan.target = 1e-9;
  plan.survey_samples = 1;
  block.scene.max_displacement = 0.8;
  block.scene.directions = Directions::inward;
  for (const size_t count : {1, 2, 3, 8}) {
    plan.least_samples = plan.most_samples = count;
    for (const SiteResult& result : sample_sites(assembly, block.scene, block.sites, linear, plan)) {
      EXPECT_EQ(result.samples, count);
      EXPECT_GE(result.polynomial.degree, 1);
      EXPECT_TRUE(result.polynomial.energy.allFinite());
    }
  }
}

}  // namespace sampled_domain_test
}  // namespace palpate
