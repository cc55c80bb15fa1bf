#include "offline/precompute/error_survey.hpp"

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

constexpr double kCovered = 0.95;
constexpr double kConfidence = 0.95;

// P(Binomial(n, kCovered) = k).
double chance_of(int k, int n) {
  return std::exp(std::lgamma(n + 1.0) - std::lgamma(k + 1.0) - std::lgamma(n - k + 1.0) +
                  k * std::log(kCovered) + (n - k) * std::log1p(-kCovered));
}

double force_floor(const std::vector<SurveySample>& samples) {
  double largest = 0;
  for (const SurveySample& sample : samples) largest = std::max(largest, sample.truth.force.norm());
  return kForceFloor * largest;
}

}  // namespace

ErrorFigures figures_of(const std::vector<double>& errors) {
  return {quantile(errors, 0.5), quantile(errors, 0.95), quantile(errors, 1.0), covering_bound(errors)};
}

double covering_bound(std::vector<double> values) {
  if (values.empty()) return 1;
  std::sort(values.begin(), values.end());
  const auto n = static_cast<int>(values.size());
  // P(k or more), from the rare end.
  double at_least = 0;
  int k = n;
  for (; k > 0; --k) {
    at_least += chance_of(k, n);
    if (at_least > 1 - kConfidence) break;
  }
  return values[static_cast<size_t>(std::min(k, n - 1))];
}

double chance_of_covering(int covered, int n) {
  double more = 0;
  for (int k = n; k > covered; --k) more += chance_of(k, n);
  return 1 - more;
}

double quantile(std::vector<double> values, double q) {
  if (values.empty()) return 1;
  std::sort(values.begin(), values.end());
  const double place = q * static_cast<double>(values.size() - 1);
  const auto below = static_cast<size_t>(place);
  const size_t above = std::min(below + 1, values.size() - 1);
  return values[below] + (place - static_cast<double>(below)) * (values[above] - values[below]);
}

double largest_node(const Eigen::Ref<const Eigen::VectorXd>& field) {
  return field.reshaped(3, field.size() / 3).colwise().norm().maxCoeff();
}

SampleErrors errors_at(const Answer& answer, const Sample& truth, double force_floor) {
  return {largest_node(answer.field - truth.field) / truth.displacement.norm(),
          (answer.force - truth.force).norm() / std::max(truth.force.norm(), force_floor)};
}

std::vector<SampleErrors> sample_errors(const std::vector<SurveySample>& samples, const Responder& model) {
  const double floor = force_floor(samples);
  std::vector<SampleErrors> errors(samples.size());
  for (size_t i = 0; i < samples.size(); ++i) {
    const auto& [site, truth, solved] = samples[i];
    if (solved) errors[i] = errors_at(model(site, truth.displacement), truth, floor);
  }
  return errors;
}

SurveyTable tabulate_errors(const std::vector<SurveySample>& samples, const std::vector<SampleErrors>& errors,
                            double max_displacement) {
  std::array<std::vector<double>, kSurveyBins + 1> displacement_errors;  // the last: all of them
  std::array<std::vector<double>, kSurveyBins + 1> force_errors;
  // |f - f_FE| as if it were proportional to |d|, as forces are, at the largest |d|
  std::array<std::vector<double>, kSurveyBins> absolute;
  const double floor = force_floor(samples);
  for (size_t i = 0; i < samples.size(); ++i) {
    const double size = samples[i].truth.displacement.norm();
    const int bin = std::clamp(static_cast<int>(std::ceil(kSurveyBins * size / max_displacement)) - 1, 0,
                               kSurveyBins - 1);
    absolute[static_cast<size_t>(bin)].push_back(
        errors[i].force * std::max(samples[i].truth.force.norm(), floor) * max_displacement / size);
    for (const int target : {bin, kSurveyBins}) {
      displacement_errors[static_cast<size_t>(target)].push_back(errors[i].displacement);
      force_errors[static_cast<size_t>(target)].push_back(errors[i].force);
    }
  }

  SurveyTable table;
  table.force_scale = floor;
  for (int i = 0; i <= kSurveyBins; ++i) {
    SurveyBin& bin = i < kSurveyBins ? table.bins[static_cast<size_t>(i)] : table.overall;
    if (i < kSurveyBins) {
      bin.from = static_cast<double>(i) / kSurveyBins;
      bin.to = static_cast<double>(i + 1) / kSurveyBins;
    }
    bin.samples = static_cast<int>(displacement_errors[static_cast<size_t>(i)].size());
    bin.displacement = figures_of(displacement_errors[static_cast<size_t>(i)]);
    bin.force = figures_of(force_errors[static_cast<size_t>(i)]);
  }
  for (size_t bin = 0; bin < absolute.size(); ++bin) {
    const double bound = table.bins[bin].force.bound;
    if (absolute[bin].empty() || !(bound > 0)) continue;
    table.force_scale = std::max(table.force_scale, covering_bound(absolute[bin]) / bound);
  }
  return table;
}

SurveyTable survey_errors(const std::vector<SurveySample>& samples, double max_displacement,
                          const Responder& model) {
  return tabulate_errors(samples, sample_errors(samples, model), max_displacement);
}

}  // namespace palpate
