// How wrong the runtime's answers are, against full nonlinear solves at displacements that no fit has seen.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <functional>
#include <vector>

#include "offline/precompute/sampling.hpp"
#include "schemas/pack_layout.hpp"

namespace palpate {

// Quartiles of |d| / max_displacement, so that a reader sees the error grow.
inline constexpr int kSurveyBins = pack::kSurveyBins;

// Of a set of errors: median, 95th percentile, maximum, and the bound that covers 95 % of further ones. Of a bin that
// is the bound of pushes at its upper end: of those at its lower end it is less by `growth` of it, in proportion
// between.
struct ErrorFigures {
  double median = 0;
  double p95 = 0;
  double max = 0;
  double bound = 0;
  double growth = 0;
};

// Of none: 1 each.
ErrorFigures figures_of(const std::vector<double>& errors);

struct SurveyBin {
  double from = 0;  // of |d| / max_displacement; samples in (from, to]
  double to = 1;
  int samples = 0;
  ErrorFigures displacement;  // max over packed nodes |u - u_FE| / |d|
  ErrorFigures force;         // |f - f_FE| / |f_FE|, |f_FE| floored at 5 % of the survey's largest
};

struct SurveyTable {
  std::array<SurveyBin, kSurveyBins> bins;
  SurveyBin overall;
  // A force, at the largest |d| and in proportion below, beside which the bounds of all bins cover |f - f_FE| itself;
  // force unit. Where a force is smaller, as along an axis that gives way easily, errors are larger parts of it.
  double force_scale = 0;
};

// One truth and where it was measured.
struct SurveySample {
  size_t site = 0;
  Sample truth;        // of a push that was not solved: its displacement only
  bool solved = true;  // false: no equilibrium was found; whatever a model says then counts as an error of 1
};

// What a model says for a displacement at a site.
struct Answer {
  Eigen::VectorXd field;  // 3 packed nodes
  Eigen::Vector3d force;
};
using Responder = std::function<Answer(size_t site, const Eigen::Vector3d& displacement)>;

struct SampleErrors {
  double displacement = 1;
  double force = 1;

  double larger() const { return std::max(displacement, force); }
};

// Largest |u| of a node. field: 3 nodes.
double largest_node(const Eigen::Ref<const Eigen::VectorXd>& field);

// A force counts as no smaller than this part of the largest of its survey: a light touch is not divided by nearly
// nothing.
inline constexpr double kForceFloor = 0.05;

// Of a solved push; forces below `force_floor` count as that.
SampleErrors errors_at(const Answer& answer, const Sample& truth, double force_floor);

// Of each sample, as a SurveyBin has them; 1 where no equilibrium was found.
std::vector<SampleErrors> sample_errors(const std::vector<SurveySample>& samples, const Responder& model);

SurveyTable tabulate_errors(const std::vector<SurveySample>& samples, const std::vector<SampleErrors>& errors,
                            double max_displacement);

// Both.
SurveyTable survey_errors(const std::vector<SurveySample>& samples, double max_displacement,
                          const Responder& model);

// The smallest of `values` that at least 95 % of all errors of their kind are below, with a confidence of 95 %
// whatever their distribution: the k-th of n, k the least with P(Binomial(n, 0.95) < k) >= 0.95 (Wilks 1941,
// Determination of sample sizes for setting tolerance limits). The largest where n < 59 are too few for that; of
// none, 1.
double covering_bound(std::vector<double> values);

// P(Binomial(n, 0.95) <= covered): small where a bound that covers 95 % would cover so few of n by bad luck alone.
double chance_of_covering(int covered, int n);

// Value below which the fraction q of `values` lies, interpolated between neighbours; of none, 1: an error
// that was not measured may be all there is.
double quantile(std::vector<double> values, double q);

}  // namespace palpate
