#include "offline/precompute/rigid_patch.hpp"

#include <stdexcept>

#include "offline/precompute/linear_dd.hpp"

namespace palpate {

void solve_at_rest(StaticSolver& solver, Eigen::MatrixXd& columns) {
  if (!solver.back_solve(columns)) throw std::logic_error("a Cholesky factor always solves");
}

RigidPatch::RigidPatch(StaticSolver& solver, const ContactSite& site) {
  for (const int node : site.patch_nodes) {
    for (int axis = 0; axis < 3; ++axis) dofs_.push_back(3 * node + axis);
  }
  columns_ = Eigen::MatrixXd::Zero(solver.assembly().num_dofs(), static_cast<Eigen::Index>(dofs_.size()));
  for (size_t j = 0; j < dofs_.size(); ++j) columns_(dofs_[j], static_cast<Eigen::Index>(j)) = 1;
  solve_at_rest(solver, columns_);
  Eigen::MatrixXd compliance = columns_(dofs_, Eigen::all);
  compliance = 0.5 * (compliance + compliance.transpose()).eval();
  factor_ = factor_patch(compliance);
  forces_ = factor_.solve(Eigen::Matrix3d::Identity().replicate(compliance.rows() / 3, 1));
  stiffness_ = Eigen::Matrix3d::Zero();
  for (Eigen::Index i = 0; i < forces_.rows(); i += 3) stiffness_ += forces_.middleRows<3>(i);
  stiffness_ = 0.5 * (stiffness_ + stiffness_.transpose()).eval();
}

Eigen::MatrixXd RigidPatch::per_force() const {
  return columns_ * (forces_ * stiffness_.inverse());
}

Eigen::MatrixXd RigidPatch::tied(const Eigen::MatrixXd& loaded) const {
  const Eigen::MatrixXd let_go = loaded(dofs_, Eigen::all);
  const Eigen::MatrixXd together = stiffness_.inverse() * (forces_.transpose() * let_go);
  return loaded + columns_ * (forces_ * together - factor_.solve(let_go));
}

double difference_step(const RigidPatch& patch, double force_scale, double mean_surface_edge) {
  constexpr double kStep = 3e-4;  // motion of the patch, in mean edges
  return kStep * mean_surface_edge / (force_scale * patch.stiffness().inverse().norm());
}

}  // namespace palpate
