#include "offline/precompute/sampling.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <utility>

#include "offline/precompute/hermite_design.hpp"

namespace palpate {
namespace {

// splitmix64: a small generator with the same numbers on every platform, which <random>'s distributions do
// not promise.
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

// Spread evenly over the sphere by the golden angle.
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

}  // namespace

std::vector<Eigen::Vector3d> choose_sample_points(int degree, int count, bool half) {
  constexpr int kDirections = 96;
  std::vector<Eigen::Vector3d> candidates;
  for (const double radius : {1.0, 0.75, 0.5}) {
    for (const Eigen::Vector3d& direction : sphere_points(kDirections)) {
      if (!half || direction.z() >= 0) candidates.push_back(radius * direction);
    }
  }
  const auto information_rows = [&](const Eigen::Vector3d& x) {
    Eigen::MatrixXd rows = hermite_rows(x, 2, degree);
    rows.bottomRows<3>() *= derivative_weight(degree);
    return rows;
  };
  const Eigen::Index terms = information_rows(Eigen::Vector3d::Zero()).cols();
  // A little prior information makes the first choices well defined.
  Eigen::MatrixXd information = 1e-6 * Eigen::MatrixXd::Identity(terms, terms);
  std::vector<Eigen::Vector3d> chosen;
  for (int i = 0; i < count; ++i) {
    const Eigen::LLT<Eigen::MatrixXd> factor(information);
    double best_gain = -1;
    size_t best = 0;
    for (size_t c = 0; c < candidates.size(); ++c) {
      // det(M + R^T R) = det M det(1 + R M^-1 R^T)
      const Eigen::MatrixXd rows = information_rows(candidates[c]);
      const Eigen::Matrix4d grown = Eigen::Matrix4d::Identity() + rows * factor.solve(rows.transpose());
      const double gain = grown.determinant();
      if (gain > best_gain * (1.0 + 1e-9)) {
        best_gain = gain;
        best = c;
      }
    }
    const Eigen::MatrixXd rows = information_rows(candidates[best]);
    information += rows.transpose() * rows;
    chosen.push_back(candidates[best]);
  }
  return chosen;
}

std::vector<Eigen::Vector3d> choose_survey_points(int count, bool half, std::uint64_t seed) {
  Random random(seed);
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < count; ++i) {
    const double z = half ? random.uniform() : 2.0 * random.uniform() - 1.0;
    const double angle = 2.0 * std::numbers::pi * random.uniform();
    const double ring = std::sqrt(1.0 - z * z);
    // Largest quarter first, so that a survey of few points measures the far end.
    const double radius = 0.25 * ((3 - i % 4) + (1.0 - random.uniform()));
    points.emplace_back(radius * Eigen::Vector3d(ring * std::cos(angle), ring * std::sin(angle), z));
  }
  return points;
}

Eigen::Matrix3d frame_about(const Eigen::Vector3d& axis) {
  return Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), axis).toRotationMatrix();
}

SiteSampler::SiteSampler(StaticSolver& solver, const ContactSites& sites, const ContactSite& site,
                         const RestState& rest_state)
    : solver_(&solver), site_(&site), rest_(&rest_state) {
  const int num_dofs = solver.assembly().num_dofs();
  patch_motion_ = Eigen::MatrixXd::Zero(num_dofs, 3);
  for (const int node : site.patch_nodes) patch_motion_.middleRows<3>(3 * node).setIdentity();
  for (const int node : sites.packed_nodes) {
    for (int axis = 0; axis < 3; ++axis) packed_dofs_.push_back(3 * node + axis);
  }
  solver.forget_factor();
  Anchor rest;
  rest.displacement.setZero();
  rest.u = rest_->displacement_of(solver.assembly().model());
  if (!solver.tangent_response(load_for(rest.displacement), rest.u, patch_motion_, rest.tangent)) {
    throw std::runtime_error(
        solver.assembly().model().file + ": the organ at rest has no stable answer to a push at node " +
        std::to_string(solver.assembly().model().labels[static_cast<size_t>(site.node)]));
  }
  anchors_.push_back(std::move(rest));
}

LoadCase SiteSampler::load_for(const Eigen::Vector3d& displacement) const {
  LoadCase load = rest_->load_case(solver_->assembly().model());
  for (const int node : site_->patch_nodes) {
    for (int axis = 0; axis < 3; ++axis) {
      const int dof = 3 * node + axis;
      load.held[static_cast<size_t>(dof)] = 1;
      load.displacement[dof] = displacement[axis] + (rest_->is_mesh() ? 0.0 : rest_->displacement[dof]);
    }
  }
  return load;
}

void SiteSampler::count(const SolveReport& report) {
  counts_.iterations += report.iterations;
  counts_.factorizations += report.factorizations;
}

bool SiteSampler::ramp_from_rest(const LoadCase& load, const SolverSettings& settings, Eigen::VectorXd& u) {
  u = anchors_.front().u;
  const SolveReport report = solver_->ramp(load_for(Eigen::Vector3d::Zero()), load, u, settings);
  count(report);
  return report.converged;
}

void SiteSampler::read_sample(const Eigen::VectorXd& u, Sample& sample) const {
  Eigen::VectorXd internal;
  sample.min_jacobian = solver_->assembly().internal_force(u, internal, &sample.energy).min_jacobian;
  sample.field = u(packed_dofs_);
  if (!rest_->is_mesh()) {
    internal -= rest_->force;
    sample.energy -= rest_->force.dot(u) + rest_->energy;
    sample.field -= rest_->displacement(packed_dofs_);
  }
  sample.force = patch_motion_.transpose() * internal;
}

bool SiteSampler::solve(const Eigen::Vector3d& displacement, Sample& sample) {
  const SolverSettings settings;
  const LoadCase load = load_for(displacement);
  const Anchor* nearest = &anchors_.front();
  for (const Anchor& anchor : anchors_) {
    if ((anchor.displacement - displacement).norm() < (nearest->displacement - displacement).norm())
      nearest = &anchor;
  }
  Anchor anchor;
  anchor.displacement = displacement;
  anchor.u = nearest->u + nearest->tangent * (displacement - nearest->displacement);
  const SolveReport report = solver_->correct(load, anchor.u, settings);
  count(report);
  if (!report.converged && !ramp_from_rest(load, settings, anchor.u)) return false;

  sample = {};
  sample.displacement = displacement;
  read_sample(anchor.u, sample);
  if (!solver_->tangent_response(load, anchor.u, patch_motion_, anchor.tangent)) return false;
  ++counts_.solves;
  sample.field_tangent = anchor.tangent(packed_dofs_, Eigen::all);
  sample.stiffness = patch_motion_.transpose() * solver_->assembly().tangent_times(anchor.u, anchor.tangent);
  sample.stiffness = 0.5 * (sample.stiffness + sample.stiffness.transpose()).eval();
  anchors_.push_back(std::move(anchor));
  return true;
}

bool SiteSampler::solve_from_rest(const Eigen::Vector3d& displacement, int increments, Sample& sample) {
  const SolverSettings settings;
  const Anchor& rest = anchors_.front();
  Eigen::VectorXd before = rest.u;
  Eigen::VectorXd u = rest.u + rest.tangent * (displacement / increments);
  bool converged = true;
  for (int i = 1; i <= increments && converged; ++i) {
    if (i > 1) {
      Eigen::VectorXd next = 2 * u - before;  // the path goes on as it came
      before = std::exchange(u, std::move(next));
    }
    const SolveReport report = solver_->correct(load_for(displacement * i / increments), u, settings);
    count(report);
    converged = report.converged;
  }
  if (!converged && !ramp_from_rest(load_for(displacement), settings, u)) return false;
  sample = {};
  sample.displacement = displacement;
  read_sample(u, sample);
  ++counts_.solves;
  return true;
}

}  // namespace palpate
