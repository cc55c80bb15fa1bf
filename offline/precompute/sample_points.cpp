#include "offline/precompute/sample_points.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <stdexcept>

#include "offline/precompute/hermite_design.hpp"
#include "offline/precompute/polynomial_dd.hpp"
#include "schemas/monomials.hpp"

namespace palpate {
namespace {

// splitmix64: equal numbers on every platform, unlike the distributions of <random>.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  double uniform() {
    state_ += 0x9e3779b97f4a7c15u;
    std::uint64_t z = state_;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1.0p-53;
  }

 private:
  std::uint64_t state_;
};

Eigen::MatrixXd weighted_rows(const Eigen::Vector3d& x, int degree) {
  return derivative_weights(degree, 2).asDiagonal() * hermite_rows(x, 2, degree, 2);
}

}  // namespace

// A spiral from pole to pole: neighbours differ by the golden angle.
std::vector<Eigen::Vector3d> sphere_points(int count) {
  const double golden = std::numbers::pi * (3.0 - std::sqrt(5.0));
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < count; ++i) {
    const double z = 1.0 - (2.0 * i + 1.0) / count;
    const double ring = std::sqrt(1.0 - z * z);
    points.emplace_back(ring * std::cos(golden * i), ring * std::sin(golden * i), z);
  }
  return points;
}

SamplePoints::SamplePoints(bool half) : highest_degree_(highest_fit_degree(half)) {
  constexpr int kDirections = 96;
  for (const Eigen::Vector3d& direction : sphere_points(kDirections)) {
    if (half && direction.z() < 0) continue;
    for (const double radius : {1.0, 0.75, 0.5}) candidates_.push_back(radius * direction);
    for (const double radius : {0.8, 0.6, 0.4, 0.2}) inner_candidates_.push_back(radius * direction);
  }
}

Eigen::Vector3d SamplePoints::operator[](size_t index) {
  const std::lock_guard lock(mutex_);
  while (chosen_.size() <= index) choose_next();
  return chosen_[index];
}

void SamplePoints::choose_next() {
  constexpr size_t kFirstInner = 12;
  constexpr size_t kEachInner = 3;
  std::optional<Eigen::Vector3d> informative;
  if (chosen_.size() < kFirstInner || chosen_.size() % kEachInner != 0) informative = most_informative();
  const Eigen::Vector3d next = informative ? *informative : farthest_inner();
  const Eigen::MatrixXd rows = weighted_rows(next, degree_);
  information_ += rows.transpose() * rows;
  chosen_.push_back(next);
}

Eigen::Vector3d SamplePoints::farthest_inner() const {
  const auto distance = [&](const Eigen::Vector3d& candidate) {
    double least = candidate.norm();  // distance to the rest state, a known point
    for (const Eigen::Vector3d& x : chosen_) least = std::min(least, (x - candidate).norm());
    return least;
  };
  double farthest = 0;
  Eigen::Vector3d best = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& candidate : inner_candidates_) {
    if (const double from_all = distance(candidate); from_all > farthest * (1.0 + 1e-9)) {
      farthest = from_all;
      best = candidate;
    }
  }
  if (farthest == 0) throw std::logic_error("no sample points are left");
  return best;
}

std::optional<Eigen::Vector3d> SamplePoints::most_informative() {
  constexpr int kLeastDegree = 3;
  constexpr double kLeastDistance = 0.2;  // a nearer point hardly tests a fit
  int degree = std::max(degree_, kLeastDegree);
  while (degree < highest_degree_ && 2 * pack::num_monomials(2, static_cast<uint32_t>(degree)) <=
                                         kEquationsPerSample * (chosen_.size() + 1)) {
    ++degree;
  }
  if (degree > degree_) {
    degree_ = degree;
    candidate_rows_.clear();
    for (const Eigen::Vector3d& x : candidates_) candidate_rows_.push_back(weighted_rows(x, degree));
    // A small prior makes M definite, and the first choices unique.
    const Eigen::Index terms = candidate_rows_.front().cols();
    information_ = 1e-6 * Eigen::MatrixXd::Identity(terms, terms);
    for (const Eigen::Vector3d& x : chosen_) {
      const Eigen::MatrixXd rows = weighted_rows(x, degree);
      information_ += rows.transpose() * rows;
    }
  }
  const Eigen::LLT<Eigen::MatrixXd> factor(information_);
  double best_gain = -1;
  size_t best = 0;
  for (size_t c = 0; c < candidates_.size(); ++c) {
    const bool is_near = std::any_of(chosen_.begin(), chosen_.end(), [&](const Eigen::Vector3d& x) {
      return (x - candidates_[c]).norm() < kLeastDistance;
    });
    if (is_near) continue;
    // det(M + R^T R) = det M det(1 + R M^-1 R^T)
    const Eigen::MatrixXd half_solved = factor.matrixL().solve(candidate_rows_[c].transpose());
    const Eigen::LLT<Eigen::MatrixXd> gains(
        Eigen::MatrixXd::Identity(kEquationsPerSample, kEquationsPerSample) +
        half_solved.transpose() * half_solved);
    const double gain = gains.matrixLLT().diagonal().array().square().prod();
    if (gain > best_gain * (1.0 + 1e-9)) {
      best_gain = gain;
      best = c;
    }
  }
  if (best_gain < 0) return std::nullopt;
  return candidates_[best];
}

std::vector<Eigen::Vector3d> choose_survey_points(int count, bool half, std::uint64_t seed, size_t skipped) {
  Random random(seed);
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < count; ++i) {
    const double z = half ? random.uniform() : 2.0 * random.uniform() - 1.0;
    const double angle = 2.0 * std::numbers::pi * random.uniform();
    const double ring = std::sqrt(1.0 - z * z);
    const size_t quarter = 3 - (skipped + static_cast<size_t>(i)) % 4;
    const double radius = 0.25 * (static_cast<double>(quarter) + (1.0 - random.uniform()));
    points.emplace_back(radius * Eigen::Vector3d(ring * std::cos(angle), ring * std::sin(angle), z));
  }
  return points;
}

Eigen::Matrix3d rotation_between(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  // Half-turns about `from`, then about the bisector, rotate by the angle between `from` and `to`.
  const auto half_turn = [](const Eigen::Vector3d& axis) -> Eigen::Matrix3d {
    return 2 * axis * axis.transpose() - Eigen::Matrix3d::Identity();
  };
  constexpr double kOpposite = 1e-8;
  Eigen::Vector3d halfway = from + to;
  if (halfway.norm() < kOpposite) halfway = from.unitOrthogonal();
  return half_turn(halfway.normalized()) * half_turn(from);
}

Eigen::Matrix3d frame_about(const Eigen::Vector3d& axis) {
  return rotation_between(Eigen::Vector3d::UnitZ(), axis);
}

}  // namespace palpate
