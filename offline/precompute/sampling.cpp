#include "offline/precompute/sampling.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <utility>

#include "schemas/monomials.hpp"

namespace palpate {

SolveCounts& SolveCounts::operator+=(const SolveCounts& other) {
  reused += other.reused;
  solves += other.solves;
  not_kept += other.not_kept;
  iterations += other.iterations;
  factorizations += other.factorizations;
  return *this;
}

SiteSampler::SiteSampler(StaticSolver& solver, const ContactSites& sites, const ContactSite& site,
                         const RestState& rest_state, SampleFile* kept)
    : solver_(&solver),
      site_(&site),
      rest_(&rest_state),
      step_(1e-4 * sites.mean_surface_edge),
      rest_displacement_(rest_state.displacement_of(solver.assembly().model())),
      kept_(kept),
      factorizations_before_(solver.num_factorizations()) {
  const int num_dofs = solver.assembly().num_dofs();
  patch_motion_ = Eigen::MatrixXd::Zero(num_dofs, 3);
  for (const int node : site.patch_nodes) patch_motion_.middleRows<3>(3 * node).setIdentity();
  for (const int node : sites.packed_nodes) {
    for (int axis = 0; axis < 3; ++axis) packed_dofs_.push_back(3 * node + axis);
  }
}

const SiteSampler::Anchor& SiteSampler::rest() {
  if (!rest_anchor_) {
    Anchor rest;
    rest.u = rest_displacement_;
    solver_->forget_factor();
    if (!read_derivatives(rest, rest_curvature_)) {
      throw std::runtime_error(
          solver_->assembly().model().file + ": the organ at rest has no stable answer to a push at node " +
          std::to_string(solver_->assembly().model().labels[static_cast<size_t>(site_->node)]) +
          "; check its supports and materials, and the gravity of the scene");
    }
    rest_anchor_ = std::move(rest);
  }
  return *rest_anchor_;
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
}

SolveCounts SiteSampler::counts() const {
  SolveCounts counts = counts_;
  counts.factorizations = solver_->num_factorizations() - factorizations_before_;
  return counts;
}

bool SiteSampler::ramp_from_rest(const LoadCase& load, Eigen::VectorXd& u) {
  u = rest().u;
  const SolveReport report = solver_->ramp(load_for(Eigen::Vector3d::Zero()), load, u, SolverSettings());
  count(report);
  return report.converged;
}

void SiteSampler::read_response(const Eigen::VectorXd& u, Sample& sample) const {
  Eigen::VectorXd internal;
  sample.min_jacobian = solver_->assembly().internal_force(u, internal, &sample.energy).min_jacobian;
  if (!rest_->is_mesh()) {
    internal -= rest_->force;
    sample.energy -= rest_->force.dot(u) + rest_->energy;
  }
  sample.force = patch_motion_.transpose() * internal;
}

// Loads the kept result of a request, or computes and keeps the result. Both ways round the fields to single
// precision. The two visitors list the numbers and fields of the result.
template <typename Compute, typename Numbers, typename Fields>
PushOutcome SiteSampler::load_or_compute(Compute&& compute, const PushRequest& request, Numbers&& each_number,
                                         Fields&& each_field) {
  size_t num_numbers = 0;
  size_t num_fields = 0;
  each_number([&](double&) { ++num_numbers; });
  each_field([&](double&) { ++num_fields; });
  std::optional<SolvedPush> push;
  if (kept_ != nullptr) push = kept_->find(request, num_numbers, num_fields);
  const bool is_solve = request.kind != PushRequest::Kind::series && !request.displacement.isZero(0);
  if (push) {
    counts_.reused += is_solve ? 1 : 0;
  } else {
    counts_.solves += is_solve ? 1 : 0;
    push.emplace();
    push->outcome = compute();
    if (push->outcome == PushOutcome::solved) {
      each_number([&](double& number) { push->numbers.push_back(number); });
      each_field([&](double& number) { push->fields.push_back(static_cast<float>(number)); });
    }
    if (kept_ != nullptr && !kept_->keep(request, *push)) counts_.not_kept += is_solve ? 1 : 0;
  }
  if (push->outcome != PushOutcome::solved) return push->outcome;
  auto number = push->numbers.begin();
  each_number([&](double& to) { to = *number++; });
  auto field = push->fields.begin();
  each_field([&](double& to) { to = static_cast<double>(*field++); });
  return push->outcome;
}

PushOutcome SiteSampler::solve(const Eigen::Vector3d& displacement, Sample& sample) {
  Anchor anchor;
  anchor.sample.displacement = displacement;
  anchor.u.resize(patch_motion_.rows());
  anchor.tangent.resize(patch_motion_.rows(), 3);
  Eigen::MatrixXd curvature(packed_dofs_.size(), 6);
  const PushOutcome outcome = load_or_compute(
      [&] {
        const PushOutcome found = compute(displacement, anchor, curvature);
        anchor.u -= rest_displacement_;  // keeps the digits of a small push on a sagging organ
        return found;
      },
      {PushRequest::Kind::sample, 0, displacement},
      [&](auto&& visit) {
        visit(anchor.sample.energy);
        visit(anchor.sample.min_jacobian);
        for (double& number : anchor.sample.force) visit(number);
        for (double& number : anchor.sample.stiffness.reshaped()) visit(number);
        for (double& number : anchor.sample.hardening) visit(number);
      },
      [&](auto&& visit) {
        for (double& number : anchor.u) visit(number);
        for (double& number : anchor.tangent.reshaped()) visit(number);
        for (double& number : curvature.reshaped()) visit(number);
      });
  if (outcome != PushOutcome::solved) return outcome;
  if (anchor.sample.min_jacobian < kLeastSampledJacobian) {
    sample.min_jacobian = anchor.sample.min_jacobian;
    return PushOutcome::nearly_inverted;
  }
  sample = anchor.sample;
  sample.field = anchor.u(packed_dofs_);
  sample.field_tangent = anchor.tangent(packed_dofs_, Eigen::all);
  sample.field_curvature = std::move(curvature);
  anchor.u += rest_displacement_;
  anchors_.push_back(std::move(anchor));
  return outcome;
}

PushOutcome SiteSampler::compute(const Eigen::Vector3d& displacement, Anchor& anchor,
                                 Eigen::MatrixXd& curvature) {
  const Anchor* nearest = &rest();
  if (displacement.isZero(0)) {
    anchor = *nearest;
    curvature = rest_curvature_;
    return PushOutcome::solved;
  }
  for (const Anchor& other : anchors_) {
    if ((other.sample.displacement - displacement).norm() <
        (nearest->sample.displacement - displacement).norm())
      nearest = &other;
  }
  // A kept factor would make the last digits depend on earlier solves.
  solver_->forget_factor();
  anchor.u = nearest->u + nearest->tangent * (displacement - nearest->sample.displacement);
  const LoadCase load = load_for(displacement);
  // Neighbours have single precision: set the held dofs exactly.
  for (size_t dof = 0; dof < load.held.size(); ++dof) {
    if (load.held[dof] != 0)
      anchor.u[static_cast<Eigen::Index>(dof)] = load.displacement[static_cast<Eigen::Index>(dof)];
  }
  const SolveReport report = solver_->correct(load, anchor.u, SolverSettings());
  count(report);
  if (!report.converged && !ramp_from_rest(load, anchor.u)) return PushOutcome::no_equilibrium;
  read_response(anchor.u, anchor.sample);
  if (!read_derivatives(anchor, curvature)) return PushOutcome::unstable;
  if (report.converged && !is_on_branch_from_rest(*nearest, anchor.sample)) return PushOutcome::other_branch;
  return PushOutcome::solved;
}

// Whether a solution lies on the path from rest. A body may have two equilibria for one push. Along one path
// the energies differ by the work of the force, the integral of g(t) = f(d(t)) . D over the step D:
//   (g0 + g1) / 2 + (g0' - g1') / 10 + (g0'' + g1'') / 120   (two-point Hermite, error g^(6) / 100,800)
// A large step may fail this test slightly; the straight path from rest then decides.
bool SiteSampler::is_on_branch_from_rest(const Anchor& from, const Sample& sample) {
  constexpr double kWorkTolerance =
      0.003;  // fraction of the energy; well below the difference between two equilibria
  constexpr double kEnergyTolerance = 1e-6;  // fraction of the energy: the same state, found twice
  constexpr int kIncrements = 4;
  const Eigen::Vector3d step = sample.displacement - from.sample.displacement;
  const auto work = [&](const Sample& at, double sign) {
    const auto& T = at.hardening;
    const Eigen::Vector3d& D = step;
    const double third = D[0] * D[0] * (T[0] * D[0] + 3 * T[1] * D[1] + 3 * T[2] * D[2]) +
                         D[1] * D[1] * (3 * T[3] * D[0] + T[6] * D[1] + 3 * T[7] * D[2]) +
                         D[2] * D[2] * (3 * T[5] * D[0] + 3 * T[8] * D[1] + T[9] * D[2]) +
                         6 * T[4] * D[0] * D[1] * D[2];
    return at.force.dot(D) / 2 + sign * D.dot(at.stiffness * D) / 10 + third / 120;
  };
  const double expected = from.sample.energy + work(from.sample, 1) + work(sample, -1);
  const double size = std::max(std::abs(sample.energy), std::abs(from.sample.energy));
  if (std::abs(sample.energy - expected) <= kWorkTolerance * size) return true;
  Eigen::VectorXd u;
  if (!compute_from_rest(sample.displacement, kIncrements, u)) return false;
  Sample from_rest;
  read_response(u, from_rest);
  return std::abs(from_rest.energy - sample.energy) <= kEnergyTolerance * size;
}

// Differentiates the equilibrium of the free dofs, P(u(d)) = f_ext, u_i = du/dd_i: K u_i = 0, and
//   K u_ij = -P''[u_i, u_j],   u_ij = 0 at held dofs,
// six more back-solves. As K u_i = 0 at free dofs, the third derivatives of the energy need only u_i: E_ijk =
// P''[u_i, u_j] . u_k. P'' comes from second differences Q(v) = (P(u + e v) - 2 P(u) + P(u - e v)) / e^2:
//   2 P''[v, w] = Q(v + w) - Q(v) - Q(w).
bool SiteSampler::read_derivatives(Anchor& anchor, Eigen::MatrixXd& packed_curvature) {
  constexpr int kPairs[6][2] = {{0, 0}, {0, 1}, {0, 2}, {1, 1}, {1, 2}, {2, 2}};
  const LoadCase load = load_for(anchor.sample.displacement);
  if (!solver_->tangent_response(load, anchor.u, patch_motion_, anchor.tangent)) return false;
  const Assembly& assembly = solver_->assembly();
  Eigen::VectorXd here;
  Eigen::VectorXd ahead;
  Eigen::VectorXd behind;
  assembly.internal_force(anchor.u, here);
  Eigen::MatrixXd second(here.size(), 6);
  for (Eigen::Index ij = 0; ij < 6; ++ij) {
    const auto [i, j] = kPairs[ij];
    Eigen::VectorXd along = step_ * anchor.tangent.col(i);
    if (i != j) along += step_ * anchor.tangent.col(j);
    assembly.internal_force(anchor.u + along, ahead);
    assembly.internal_force(anchor.u - along, behind);
    second.col(ij) = (ahead - 2 * here + behind) / (step_ * step_);
  }
  const Eigen::Vector3i squares(0, 3, 5);
  for (Eigen::Index ij = 0; ij < 6; ++ij) {
    const auto [i, j] = kPairs[ij];
    if (i != j) second.col(ij) = 0.5 * (second.col(ij) - second.col(squares[i]) - second.col(squares[j]));
  }
  Eigen::MatrixXd curvature;
  if (!solver_->tangent_response(load, anchor.u, Eigen::MatrixXd::Zero(here.size(), 6), curvature, -second))
    return false;
  packed_curvature = curvature(packed_dofs_, Eigen::all);
  Eigen::Matrix3d& stiffness = anchor.sample.stiffness;
  stiffness = patch_motion_.transpose() * assembly.tangent_times(anchor.u, anchor.tangent);
  stiffness = 0.5 * (stiffness + stiffness.transpose()).eval();
  const Eigen::MatrixXd E = anchor.tangent.transpose() * second;  // k, ij
  anchor.sample.hardening << E(0, 0), E(1, 0), E(2, 0), E(0, 3), E(0, 4), E(0, 5), E(1, 3), E(2, 3), E(1, 5),
      E(2, 5);
  return true;
}

std::optional<TaylorCoefficients> SiteSampler::coefficients_at_rest(const Eigen::Matrix3d& axes) {
  TaylorCoefficients series;
  series.axes = axes;
  series.field.resize(static_cast<Eigen::Index>(packed_dofs_.size()), pack::num_monomials(2, kSeriesDegree));
  series.energy.resize(pack::num_monomials(3, kSeriesDegree + 1));
  const PushOutcome outcome = load_or_compute(
      [&] {
        if (rest_anchor_) solver_->forget_factor();
        const Anchor& from = rest();
        return compute_taylor_coefficients(*solver_, load_for(Eigen::Vector3d::Zero()), from.u, from.tangent,
                                           packed_dofs_, axes, series)
                   ? PushOutcome::solved
                   : PushOutcome::nearly_inverted;
      },
      {PushRequest::Kind::series, 0, Eigen::Vector3d::Zero()},
      [&](auto&& visit) {
        for (double& number : series.energy) visit(number);
      },
      [&](auto&& visit) {
        for (double& number : series.field.reshaped()) visit(number);
      });
  if (outcome != PushOutcome::solved) return std::nullopt;
  return series;
}

bool SiteSampler::solve_from_rest(const Eigen::Vector3d& displacement, int increments, Sample& sample) {
  sample = {};
  Sample solved;
  solved.field.resize(static_cast<Eigen::Index>(packed_dofs_.size()));
  const PushOutcome outcome = load_or_compute(
      [&] {
        Eigen::VectorXd u;
        if (!compute_from_rest(displacement, increments, u)) return PushOutcome::no_equilibrium;
        read_response(u, solved);
        solved.field = (u - rest_displacement_)(packed_dofs_);
        return PushOutcome::solved;
      },
      {PushRequest::Kind::survey, increments, displacement},
      [&](auto&& visit) {
        visit(solved.energy);
        visit(solved.min_jacobian);
        for (double& number : solved.force) visit(number);
      },
      [&](auto&& visit) {
        for (double& number : solved.field) visit(number);
      });
  if (outcome == PushOutcome::solved) sample = std::move(solved);
  sample.displacement = displacement;
  return outcome == PushOutcome::solved;
}

bool SiteSampler::compute_from_rest(const Eigen::Vector3d& displacement, int increments, Eigen::VectorXd& u) {
  const Anchor& from = rest();
  solver_->forget_factor();
  Eigen::VectorXd before = from.u;
  u = from.u + from.tangent * (displacement / increments);
  for (int i = 1; i <= increments; ++i) {
    if (i > 1) {
      Eigen::VectorXd next = 2 * u - before;  // linear extrapolation of the path
      before = std::exchange(u, std::move(next));
    }
    const SolveReport report = solver_->correct(load_for(displacement * i / increments), u, SolverSettings());
    count(report);
    if (!report.converged) return ramp_from_rest(load_for(displacement), u);
  }
  return true;
}

}  // namespace palpate
