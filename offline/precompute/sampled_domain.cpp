#include "offline/precompute/sampled_domain.hpp"

#include <fmt/core.h>

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>
#include <vector>

#include "offline/precompute/error_survey.hpp"
#include "offline/precompute/sample_points.hpp"

namespace palpate {
namespace {

constexpr double kRounding = 1e-9;  // relative tolerance of reaches
// Range of the fraction that a cut keeps: bounds the loss by a wrong estimate, and the number of cuts.
constexpr double kLeastFraction = 0.7;
constexpr double kMostFraction = 0.97;

// Returns the fraction t of a displacement where the smallest det F is 1.1 `least`, if det F = exp(-c t^2)
// along the ray, and `min_jacobian` at t = 1.
double part_by_jacobian(double min_jacobian, double least) {
  if (!(min_jacobian > 0 && min_jacobian < least)) return kLeastFraction;
  return std::clamp(std::sqrt(std::log(1.1 * least) / std::log(min_jacobian)), kLeastFraction, kMostFraction);
}

// Returns the fraction t where the fit error is `target`: the relative error grows as t^degree.
double part_by_error(double error, double target, int degree) {
  return std::clamp(std::pow(target / error, 1.0 / degree), kLeastFraction, kMostFraction);
}

// Whether only a cut can remove the error. A new fit with the sample may remove a smaller error.
bool is_far_off(double error, double target) {
  constexpr double kFarOff = 0.01;
  return error > std::max(kFarOff, 2 * target);
}

// Cuts the ellipsoid |A d| <= 1 at `fraction` of `displacement`; no semi-axis falls below `least`. In a
// half-domain a rotation of x gives inward displacements x_3 >= 0: d . n = (A^-T n) . x.
void shorten(const Eigen::Vector3d& displacement, double fraction, double least,
             const Eigen::Vector3d& inward, SiteSamples& samples) {
  Eigen::Matrix3d& A = samples.to_unit;
  const Eigen::Vector3d x = A * displacement;
  const Eigen::Vector3d along = x.normalized();
  A += (1 / (fraction * x.norm()) - 1) * along * (along.transpose() * A);
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(A, Eigen::ComputeFullU | Eigen::ComputeFullV);
  if (svd.singularValues()[0] * least > 1)
    A = svd.matrixU() * svd.singularValues().cwiseMin(1 / least).asDiagonal() * svd.matrixV().transpose();
  if (samples.half) A = frame_about((A.inverse().transpose() * inward).normalized()).transpose() * A;
}

// Returns separated x near the boundary where fits of two degrees differ most, relative to |d|. The samples
// determine the fit least at these x (bench/polynomials/POLYNOMIALS.md).
std::vector<Eigen::Vector3d> doubtful_points(const SiteSamples& samples, const SitePolynomial& fit,
                                             size_t count) {
  constexpr int kDirections = 400;
  constexpr double kNearEdge = 0.95;
  constexpr double kApart = 0.33;
  const SitePolynomial lower = fit_polynomial(samples, fit.degree - 1);
  const Eigen::Matrix3d from_unit = samples.to_unit.inverse();
  std::vector<std::pair<double, Eigen::Vector3d>> doubts;
  for (const Eigen::Vector3d& direction : sphere_points(kDirections)) {
    if (samples.half && direction.z() < 0) continue;
    const Eigen::Vector3d x = kNearEdge * direction;
    const Eigen::Vector3d d = from_unit * x;
    const Eigen::VectorXd difference = field_at(fit, d) - field_at(lower, d);
    doubts.emplace_back(largest_node(difference) / d.norm(), x);
  }
  std::stable_sort(doubts.begin(), doubts.end(),
                   [](const auto& one, const auto& other) { return one.first > other.first; });
  std::vector<Eigen::Vector3d> chosen;
  for (const auto& [doubt, x] : doubts) {
    if (chosen.size() == count) break;
    const bool is_near = std::any_of(chosen.begin(), chosen.end(), [&x = x](const Eigen::Vector3d& other) {
      return (other - x).norm() < kApart;
    });
    if (!is_near) chosen.push_back(x);
  }
  return chosen;
}

}  // namespace

SampledDomain::SampledDomain(SiteSampler& sampler, const Scene& scene, const ContactSite& site, int label,
                             SiteSamples& samples)
    : sampler_(sampler), scene_(scene), site_(site), label_(label), samples_(samples) {}

void SampledDomain::sample_rest() {
  Sample rest;
  if (sampler_.solve(Eigen::Vector3d::Zero(), rest) != PushOutcome::solved)
    throw std::logic_error("there is no state of rest");
  samples_.samples.push_back(std::move(rest));
}

bool SampledDomain::sample(const Eigen::Vector3d& x) {
  const Eigen::Vector3d displacement = samples_.to_unit.inverse() * x;
  const bool is_known =
      std::any_of(samples_.samples.begin(), samples_.samples.end(), [&](const Sample& sample) {
        return (sample.displacement - displacement).norm() <= kRounding * displacement.norm();
      });
  if (is_known) return true;
  TakenSample taken = take(displacement);
  if (taken.failure != PushOutcome::solved) {
    throw DomainTooSmall(
        fmt::format("{}: {} for a push of {:.3g} at node {}, though max_displacement is {:.3g}; reduce "
                    "max_displacement",
                    scene_.file.string(), words_for(taken.failure), displacement.norm(), label_,
                    scene_.max_displacement),
        displacement.norm());
  }
  if (!taken.sample) return false;
  samples_.samples.push_back(*std::move(taken.sample));
  return true;
}

// Solves a push. Cuts the domain before a push that fails or crushes an element.
SampledDomain::TakenSample SampledDomain::take(const Eigen::Vector3d& displacement) {
  Sample sample;
  ++num_solves_;
  const PushOutcome outcome = sampler_.solve(displacement, sample);
  if (outcome != PushOutcome::solved) {
    const double fraction = part_by_jacobian(sample.min_jacobian, kLeastSampledJacobian);
    return {{}, cut_before(displacement, fraction, outcome) ? PushOutcome::solved : outcome};
  }
  if (sample.min_jacobian < least_jacobian_ &&
      cut_before(displacement, part_by_jacobian(sample.min_jacobian, least_jacobian_),
                 PushOutcome::not_followed))
    return {};
  return {std::move(sample)};
}

// Cuts the domain at `fraction` of the displacement, but keeps kLeastReachPart along all axes. Returns false
// and changes nothing where the displacement would stay inside.
bool SampledDomain::cut_before(const Eigen::Vector3d& displacement, double fraction, PushOutcome outcome) {
  constexpr double kOutside = 1.01;  // a smaller cut is not worth a solve
  if (fraction * (samples_.to_unit * displacement).norm() >= 1) return true;
  const Eigen::Matrix3d before = samples_.to_unit;
  shorten(displacement, fraction, kLeastReachPart * scene_.max_displacement, site_.inward, samples_);
  if ((samples_.to_unit * displacement).norm() < kOutside) {
    samples_.to_unit = before;
    return false;
  }
  cut_by_ = outcome;
  return true;
}

void SampledDomain::leave_crushed() {
  least_jacobian_ = kFollowedJacobian;
  std::vector<Sample> left;
  for (Sample& sample : samples_.samples) {
    const double fraction = part_by_jacobian(sample.min_jacobian, kFollowedJacobian);
    if (sample.min_jacobian < kFollowedJacobian &&
        cut_before(sample.displacement, fraction, PushOutcome::not_followed))
      continue;
    left.push_back(std::move(sample));
  }
  samples_.samples = std::move(left);
}

void SampledDomain::try_fit(const SitePolynomial& fit, double target, size_t num_pushes) {
  const double floor = force_floor(samples_);
  const Eigen::Matrix3d from_unit = samples_.to_unit.inverse();
  for (const Eigen::Vector3d& x : doubtful_points(samples_, fit, num_pushes)) {
    std::optional<Sample> sample = take(from_unit * x).sample;
    if (!sample) continue;
    const double error = errors_of(fit, *sample, floor).larger();
    if (is_far_off(error, target))
      cut_before(sample->displacement, part_by_error(error, target, fit.degree), PushOutcome::not_followed);
    samples_.samples.push_back(*std::move(sample));
  }
}

size_t SampledDomain::num_inside() const {
  return static_cast<size_t>(
      std::count_if(samples_.samples.begin(), samples_.samples.end(), [&](const Sample& sample) {
        return !sample.displacement.isZero(0) && is_in_domain(samples_, sample);
      }));
}

double SampledDomain::min_jacobian() const {
  double least = 1;
  for (const Sample& sample : samples_.samples) {
    if (is_in_domain(samples_, sample)) least = std::min(least, sample.min_jacobian);
  }
  return least;
}

}  // namespace palpate
