#include "offline/precompute/linear_dd.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <stdexcept>

namespace palpate {

void factor_at_rest(StaticSolver& solver, const RestState& rest) {
  const Model& model = solver.assembly().model();
  if (!solver.factorize_at(rest.load_case(model), rest.displacement_of(model), false)) {
    throw std::runtime_error(
        model.file +
        ": the stiffness at rest is not positive definite; hold every part with *BOUNDARY, and join "
        "parts face to face");
  }
}

LinearDd compute_linear_dd(const Assembly& assembly, const ContactSites& sites,
                           const std::function<void(int, int)>& progress, const RestState& rest) {
  constexpr Eigen::Index kBlock = 48;  // right-hand sides that share one pass over the factor
  StaticSolver solver(assembly);
  factor_at_rest(solver, rest);
  const auto num_contact_dofs = static_cast<Eigen::Index>(3 * sites.contact_nodes.size());
  const auto num_packed = static_cast<Eigen::Index>(sites.packed_nodes.size());
  LinearDd linear;
  linear.contact_compliance.resize(num_contact_dofs, num_contact_dofs);
  linear.field_compliance.resize(3 * num_packed, num_contact_dofs);
  for (Eigen::Index first = 0; first < num_contact_dofs; first += kBlock) {
    const Eigen::Index width = std::min(kBlock, num_contact_dofs - first);
    Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(assembly.num_dofs(), width);
    for (Eigen::Index j = 0; j < width; ++j) {
      const auto dof = static_cast<int>(first + j);
      columns(3 * sites.model_node(dof / 3) + dof % 3, j) = 1.0;
    }
    if (!solver.back_solve(columns)) throw std::logic_error("a Cholesky factor always solves");
    linear.field_compliance.middleCols(first, width) = packed_rows(sites, columns);
    if (progress) progress(static_cast<int>(first + width), static_cast<int>(num_contact_dofs));
  }
  for (size_t c = 0; c < sites.contact_nodes.size(); ++c) {
    linear.contact_compliance.middleRows<3>(static_cast<Eigen::Index>(3 * c)) =
        linear.field_compliance.middleRows<3>(3 * sites.contact_nodes[c]);
  }
  // K is symmetric; an asymmetry is rounding.
  linear.contact_compliance =
      0.5 * (linear.contact_compliance + linear.contact_compliance.transpose()).eval();
  return linear;
}

Eigen::MatrixXd patch_forces(const Eigen::MatrixXd& compliance) {
  constexpr double kSingular = 1e-14;
  constexpr double kSpring = 1e-9;  // fraction of a node's own compliance, as in the runtime
  Eigen::LLT<Eigen::MatrixXd> factor(compliance);
  if (factor.info() != Eigen::Success || !(factor.rcond() > kSingular)) {
    Eigen::MatrixXd with_springs = compliance;
    with_springs.diagonal() *= 1 + kSpring;
    factor.compute(with_springs);
  }
  return factor.solve(Eigen::Matrix3d::Identity().replicate(compliance.rows() / 3, 1));
}

std::vector<Eigen::Index> patch_dofs(const ContactSite& site) {
  std::vector<Eigen::Index> dofs;
  for (const int member : site.patch) {
    for (int axis = 0; axis < 3; ++axis) dofs.push_back(3 * member + axis);
  }
  return dofs;
}

SiteLinearResponse linear_response(const LinearDd& linear, const ContactSite& site) {
  const std::vector<Eigen::Index> dofs = patch_dofs(site);
  const Eigen::MatrixXd forces = patch_forces(linear.contact_compliance(dofs, dofs));
  SiteLinearResponse response;
  for (Eigen::Index i = 0; i < forces.rows(); i += 3) response.stiffness += forces.middleRows<3>(i);
  response.stiffness = 0.5 * (response.stiffness + response.stiffness.transpose()).eval();
  response.field = linear.field_compliance(Eigen::all, dofs) * forces;
  return response;
}

SiteLinearResponse linear_response(StaticSolver& solver, const ContactSites& sites, const ContactSite& site,
                                   const RestState& rest) {
  const Assembly& assembly = solver.assembly();
  const Eigen::VectorXd at_rest = rest.displacement_of(assembly.model());
  LoadCase load = rest.load_case(assembly.model());
  Eigen::MatrixXd motion = Eigen::MatrixXd::Zero(assembly.num_dofs(), 3);
  for (const int node : site.patch_nodes) {
    motion.middleRows<3>(3 * node).setIdentity();
    for (int axis = 0; axis < 3; ++axis) load.held[static_cast<size_t>(3 * node + axis)] = 1;
  }
  Eigen::MatrixXd tangent;
  const bool solved = solver.tangent_response(load, at_rest, motion, tangent);
  solver.forget_factor();
  if (!solved)
    throw std::runtime_error(assembly.model().file + ": the stiffness at rest is not positive definite");
  SiteLinearResponse response;
  response.stiffness = motion.transpose() * assembly.tangent_times(at_rest, tangent);
  response.stiffness = 0.5 * (response.stiffness + response.stiffness.transpose()).eval();
  response.field = packed_rows(sites, tangent);
  return response;
}

}  // namespace palpate
