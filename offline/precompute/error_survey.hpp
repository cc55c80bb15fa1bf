// Measures the runtime's errors against full nonlinear solves at displacements that no fit has used.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <functional>
#include <vector>

#include "offline/precompute/sampling.hpp"
#include "schemas/pack_layout.hpp"

namespace palpate {

// Bins of |d| / max_displacement: the quarters of the range, which show the growth of the error.
inline constexpr int kSurveyBins = pack::kSurveyBins;

// Median, 95th percentile and maximum of errors, and the bound of 95 % of further errors. The bound holds at
// the upper end of a bin and falls linearly to (1 - growth) times the bound at the lower end.
struct ErrorFigures {
  double median = 0;
  double p95 = 0;
  double max = 0;
  double bound = 0;
  double growth = 0;
};

// Returns the figures without growth; 1 each without errors.
ErrorFigures figures_of(const std::vector<double>& errors);

struct SurveyBin {
  double from = 0;  // range of |d| / max_displacement: (from, to]
  double to = 1;
  int samples = 0;
  ErrorFigures displacement;  // max over packed nodes |u - u_FE| / |d|
  ErrorFigures force;         // |f - f_FE| / |f_FE|, |f_FE| floored at 5 % of the survey's largest force
};

struct SurveyTable {
  std::array<SurveyBin, kSurveyBins> bins;
  SurveyBin overall;
  // Force unit: |f - f_FE| <= force bound of the bin times force_scale |d| / max_displacement for 95 % of
  // errors. This bound matters along soft axes, where forces are small and relative errors large.
  double force_scale = 0;
};

// One solved push and its site.
struct SurveySample {
  size_t site = 0;
  Sample truth;        // an unsolved push has only its displacement
  bool solved = true;  // false: no equilibrium found; every response then has an error of 1
};

// A model's response to a displacement at a site.
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

// Returns the largest |u| of any node. field: 3 nodes.
double largest_node(const Eigen::Ref<const Eigen::VectorXd>& field);

// Floor of |f_FE| as a fraction of the survey's largest force; prevents a division by nearly 0.
inline constexpr double kForceFloor = 0.05;

// Returns the errors at a solved push, as in SurveyBin; the denominator |f_FE| is at least `force_floor`.
SampleErrors errors_at(const Answer& answer, const Sample& truth, double force_floor);

// Returns the errors of each sample, as in SurveyBin; 1 without an equilibrium.
std::vector<SampleErrors> sample_errors(const std::vector<SurveySample>& samples, const Responder& model);

SurveyTable tabulate_errors(const std::vector<SurveySample>& samples, const std::vector<SampleErrors>& errors,
                            double max_displacement);

// Measures the errors and tabulates them.
SurveyTable survey_errors(const std::vector<SurveySample>& samples, double max_displacement,
                          const Responder& model);

// Returns the smallest of `values` that bounds 95 % of all such errors with a confidence of 95 %, for any
// distribution: the k-th of n, k least with P(Binomial(n, 0.95) < k) >= 0.95 (Wilks 1941, Determination of
// sample sizes for setting tolerance limits). Returns the largest value where n < 59, and 1 where n = 0.
double covering_bound(std::vector<double> values);

// Returns P(Binomial(n, 0.95) <= covered): the probability that a true 95 % bound covers so few of n errors.
double chance_of_covering(int covered, int n);

// Returns the interpolated quantile q; 1 without values, since an unmeasured error may be total.
double quantile(std::vector<double> values, double q);

}  // namespace palpate
