// How wrong the runtime's answers are, against full nonlinear solves at displacements that no fit has seen.
#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>
#include <vector>

#include "offline/precompute/sampling.hpp"
#include "schemas/pack_layout.hpp"

namespace palpate {

// Quartiles of |d| / max_displacement, so that a reader sees the error grow.
inline constexpr int kSurveyBins = pack::kSurveyBins;

// Median, 95th percentile and maximum of a set of errors.
struct ErrorFigures {
  double median = 0;
  double p95 = 0;
  double max = 0;
};

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
};

// Of each sample, as a SurveyBin has them; 1 where no equilibrium was found.
std::vector<SampleErrors> sample_errors(const std::vector<SurveySample>& samples, const Responder& model);

SurveyTable tabulate_errors(const std::vector<SurveySample>& samples, const std::vector<SampleErrors>& errors,
                            double max_displacement);

// Both.
SurveyTable survey_errors(const std::vector<SurveySample>& samples, double max_displacement,
                          const Responder& model);

// Value below which the fraction q of `values` lies, interpolated between neighbours; of none, 1: an error
// that was not measured may be all there is.
double quantile(std::vector<double> values, double q);

}  // namespace palpate
