#include "offline/precompute/error_survey.hpp"

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

constexpr double kCovered = 0.95;
constexpr double kConfidence = 0.95;

// Returns P(Binomial(n, kCovered) = k).
double chance_of(int k, int n) {
  return std::exp(std::lgamma(n + 1.0) - std::lgamma(k + 1.0) - std::lgamma(n - k + 1.0) +
                  k * std::log(kCovered) + (n - k) * std::log1p(-kCovered));
}

// Returns ErrorFigures::growth of a bin. Assumes that errors follow a power of |d| through the medians of
// this bin and of the bin below, each at the middle of its bin.
double growth_between(const SurveyBin& below, double median_below, const SurveyBin& bin, double median) {
  constexpr double kMost = 0.9;  // at this limit an error at the lower end counts ten times
  if (!(median_below > 0) || !(median > median_below)) return 0;
  const double power =
      std::log(median / median_below) / std::log((bin.from + bin.to) / (below.from + below.to));
  return std::min(kMost, 1 - std::pow(bin.from / bin.to, power));
}

// Extrapolates errors of pushes of these sizes to the upper end of their bin.
std::vector<double> at_upper_end(std::vector<double> errors, const std::vector<double>& sizes,
                                 const SurveyBin& bin, double growth) {
  for (size_t i = 0; i < errors.size(); ++i)
    errors[i] /= 1 - growth * std::max(0.0, bin.to - sizes[i]) / (bin.to - bin.from);
  return errors;
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
  // P(k or more), summed from the small terms.
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
  SurveyTable table;
  for (int i = 0; i < kSurveyBins; ++i) {
    table.bins[static_cast<size_t>(i)].from = static_cast<double>(i) / kSurveyBins;
    table.bins[static_cast<size_t>(i)].to = static_cast<double>(i + 1) / kSurveyBins;
  }
  struct Errors {
    std::vector<double> sizes;  // |d| / max_displacement
    std::vector<double> displacement;
    std::vector<double> force;
    // |f - f_FE| scaled to the largest |d|, as forces are proportional to |d|
    std::vector<double> absolute;
  };
  std::array<Errors, kSurveyBins> errors_by_bin;
  Errors all;
  const double floor = force_floor(samples);
  for (size_t i = 0; i < samples.size(); ++i) {
    const double size = samples[i].truth.displacement.norm() / max_displacement;
    const int bin = std::clamp(static_cast<int>(std::ceil(kSurveyBins * size)) - 1, 0, kSurveyBins - 1);
    for (Errors* group : {&errors_by_bin[static_cast<size_t>(bin)], &all}) {
      group->sizes.push_back(size);
      group->displacement.push_back(errors[i].displacement);
      group->force.push_back(errors[i].force);
      group->absolute.push_back(errors[i].force * std::max(samples[i].truth.force.norm(), floor) / size);
    }
  }

  table.overall.samples = static_cast<int>(samples.size());
  table.overall.displacement = figures_of(all.displacement);
  table.overall.force = figures_of(all.force);
  table.force_scale = floor;
  const SurveyBin* below = nullptr;
  for (int i = 0; i < kSurveyBins; ++i) {
    SurveyBin& bin = table.bins[static_cast<size_t>(i)];
    const Errors& in_bin = errors_by_bin[static_cast<size_t>(i)];
    bin.samples = static_cast<int>(in_bin.sizes.size());
    const auto bound = [&](const std::vector<double>& values, double growth) {
      return covering_bound(at_upper_end(values, in_bin.sizes, bin, growth));
    };
    for (auto [figures, values] :
         {std::pair(&bin.displacement, &in_bin.displacement), std::pair(&bin.force, &in_bin.force)}) {
      *figures = figures_of(*values);
      if (below == nullptr || in_bin.sizes.empty()) continue;
      const ErrorFigures& before = values == &in_bin.force ? below->force : below->displacement;
      figures->growth = growth_between(*below, before.median, bin, figures->median);
      figures->bound = bound(*values, figures->growth);
    }
    if (bin.force.bound > 0 && !in_bin.sizes.empty())
      table.force_scale =
          std::max(table.force_scale, bound(in_bin.absolute, bin.force.growth) / bin.force.bound);
    below = in_bin.sizes.empty() ? nullptr : &bin;
  }
  return table;
}

SurveyTable survey_errors(const std::vector<SurveySample>& samples, double max_displacement,
                          const Responder& model) {
  return tabulate_errors(samples, sample_errors(samples, model), max_displacement);
}

}  // namespace palpate
