#include "offline/precompute/sampled_domain.hpp"

#include <fmt/core.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>
#include <vector>

#include "offline/precompute/error_survey.hpp"
#include "offline/precompute/sample_points.hpp"

namespace palpate {
namespace {

constexpr double kSmallestReach = 0.25;  // of the scene's largest displacement
// Of the domain along a displacement that is left out, what is kept of it: no less at a time, and no more.
constexpr double kLeastPart = 0.7;
constexpr double kMostPart = 0.97;

// Of a displacement that nearly inverts an element: to what part its smallest det F is above `least` by a tenth.
// Along a ray from rest it falls as exp(-c t^2), or nearly: at a site of the brain 0.51, 0.29 and 0.14 at 0.6, 0.8
// and 1 (c = 1.9 to 2.0).
double part_by_jacobian(double min_jacobian, double least) {
  if (!(min_jacobian > 0 && min_jacobian < least)) return kLeastPart;
  return std::clamp(std::sqrt(std::log(1.1 * least) / std::log(min_jacobian)), kLeastPart, kMostPart);
}

// Of one that a fit is so wrong at: beside |d| its remainder grows as t^degree.
double part_by_error(double error, double target, int degree) {
  return std::clamp(std::pow(target / error, 1.0 / degree), kLeastPart, kMostPart);
}

// An error that is to be mended by leaving out what polynomials do not follow.
bool is_far_off(double error, double target) {
  constexpr double kFarOff = 0.01;
  return error > std::max(kFarOff, 2 * target);
}

// Shortens the ellipsoid |A d| <= 1 to a part of what it is, or of what leaves x = A d outside. Of a half, the
// displacements inward of the surface stay those with x_3 >= 0: d . n = (A^-T n) . x.
void shorten(const Eigen::Vector3d& x, double part, const Eigen::Vector3d& inward, SiteSamples& samples) {
  const Eigen::Vector3d along = x.normalized();
  const double factor = 1 / (part * std::min(1.0, x.norm()));
  Eigen::Matrix3d& A = samples.to_unit;
  A += (factor - 1) * along * (along.transpose() * A);
  if (samples.half) A = frame_about((A.inverse().transpose() * inward).normalized()).transpose() * A;
}

// So many x near the edge, apart from one another, where fits of two degrees differ most as parts of |d|: where samples
// tell one from the other least. (Where no sample is near was tried in their place: it misses narrower directions, of
// 320 pushes at the brain's eight hardest sites to 2 h the largest error was 1.3 % so, and is 0.5.)
std::vector<Eigen::Vector3d> doubtful_points(const SiteSamples& samples, const SitePolynomial& fit,
                                             size_t count) {
  constexpr int kDirections = 400;
  constexpr double kNearEdge = 0.95;
  constexpr double kApart = 0.33;
  const SitePolynomial lower = fit_polynomial(samples, std::max(1, fit.degree - 1));
  const Eigen::Matrix3d from_unit = samples.to_unit.inverse();
  std::vector<std::pair<double, Eigen::Vector3d>> doubts;
  for (const Eigen::Vector3d& direction : sphere_points(kDirections)) {
    if (samples.half && direction.z() < 0) continue;
    const Eigen::Vector3d x = kNearEdge * direction;
    const Eigen::Vector3d d = from_unit * x;
    const Eigen::VectorXd difference = field_at(fit, d) - field_at(lower, d);
    doubts.emplace_back(difference.reshaped(3, difference.size() / 3).colwise().norm().maxCoeff() / d.norm(),
                        x);
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

void SampledDomain::sample(const Eigen::Vector3d& x) {
  while (!is_sampled(x)) {
  }
}

bool SampledDomain::is_sampled(const Eigen::Vector3d& x) {
  Sample sample;
  const Eigen::Vector3d displacement = samples_.to_unit.inverse() * x;
  const PushOutcome outcome = sampler_.solve(displacement, sample);
  if (outcome == PushOutcome::solved) {
    const double part = part_by_jacobian(sample.min_jacobian, kFollowedJacobian);
    if (sample.min_jacobian < least_jacobian_ && keep_part(displacement, part, PushOutcome::not_followed))
      return false;
    samples_.samples.push_back(std::move(sample));
    return true;
  }
  if (keep_part(displacement, part_by_jacobian(sample.min_jacobian, kLeastSampledJacobian), outcome))
    return false;
  throw std::runtime_error(fmt::format(
      "{}: {} for a push of {:.3g} at node {}, though max_displacement is {:.3g}; reduce "
      "max_displacement, or raise tip_radius",
      scene_.file.string(), words_for(outcome), displacement.norm(), label_, scene_.max_displacement));
}

// Shortens the domain to a part of this displacement; leaves it as it is, and returns false, where it would be too
// small.
bool SampledDomain::keep_part(const Eigen::Vector3d& displacement, double part, PushOutcome outcome) {
  const Eigen::Vector3d x = samples_.to_unit * displacement;
  const double kept = part * std::max(1.0, x.norm());
  if (kept >= 1) return true;  // it lies outside already
  const Eigen::Matrix3d before = samples_.to_unit;
  shorten(x, kept, site_.inward, samples_);
  if (least_reach(samples_.to_unit) < kSmallestReach * scene_.max_displacement) {
    samples_.to_unit = before;
    return false;
  }
  cut_by_ = outcome;
  return true;
}

size_t SampledDomain::leave_crushed() {
  least_jacobian_ = kFollowedJacobian;
  return std::erase_if(samples_.samples, [&](const Sample& sample) {
    return sample.min_jacobian < kFollowedJacobian &&
           keep_part(sample.displacement, part_by_jacobian(sample.min_jacobian, kFollowedJacobian),
                     PushOutcome::not_followed);
  });
}

void SampledDomain::try_fit(const SitePolynomial& fit, double target, size_t num_pushes) {
  double largest_force = 0;
  for (const Sample& sample : samples_.samples) largest_force = std::max(largest_force, sample.force.norm());
  const Eigen::Matrix3d from_unit = samples_.to_unit.inverse();
  for (const Eigen::Vector3d& x : doubtful_points(samples_, fit, num_pushes)) {
    const Eigen::Vector3d displacement = from_unit * x;
    Sample sample;
    const PushOutcome outcome = sampler_.solve(displacement, sample);
    if (outcome != PushOutcome::solved) {
      keep_part(displacement, part_by_jacobian(sample.min_jacobian, kLeastSampledJacobian), outcome);
      continue;
    }
    if (sample.min_jacobian < least_jacobian_ &&
        keep_part(displacement, part_by_jacobian(sample.min_jacobian, least_jacobian_),
                  PushOutcome::not_followed))
      continue;
    const SampleErrors errors = errors_at({field_at(fit, displacement), force_at(fit, displacement)}, sample,
                                          kForceFloor * largest_force);
    const double error = std::max(errors.displacement, errors.force);
    if (is_far_off(error, target))
      keep_part(displacement, part_by_error(error, target, fit.degree), PushOutcome::not_followed);
    samples_.samples.push_back(std::move(sample));
  }
}

size_t SampledDomain::num_samples() const {
  return static_cast<size_t>(
      std::count_if(samples_.samples.begin(), samples_.samples.end(),
                    [](const Sample& sample) { return !sample.displacement.isZero(0); }));
}

double SampledDomain::min_jacobian() const {
  double least = 1;
  for (const Sample& sample : samples_.samples) least = std::min(least, sample.min_jacobian);
  return least;
}

}  // namespace palpate
