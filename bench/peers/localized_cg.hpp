// LCG: conjugate gradients in every frame, warm started, only on nodes with a residual. A moved contact
// changes the residual near itself, and each iteration reaches one more ring of nodes. Only K is prepared, so
// contacts and K may change at any time.
//
// Source: Nienhuys and van der Stappen 2001, A surgery simulation supporting cuts and finite element
// deformation. Optional preconditioner: inverse 3 x 3 diagonal blocks of K, which keep the iteration local.
#pragma once

#include <Eigen/LU>
#include <cmath>
#include <vector>

#include "bench/peers/node_blocks.hpp"

namespace palpate::peers {

class LocalizedCg {
 public:
  // Stops at |residual| <= `tolerance` |K_fc d|. The free dofs of a node must be complete and consecutive.
  LocalizedCg(const HeldContacts& held, bool precondition, double tolerance)
      : held_(&held), stiffness_(held.free_free), precondition_(precondition), tolerance_(tolerance) {
    const Eigen::Index n = held.free_free.rows();
    displacement_ = residual_ = preconditioned_ = direction_ = product_ = Eigen::VectorXd::Zero(n);
    contacts_ = Eigen::VectorXd::Zero(held.free_contact.cols());
    is_active_.assign(static_cast<size_t>(n / 3), 0);
    for (int node = 0; precondition && node < stiffness_.num_nodes(); ++node)
      inverse_blocks_.push_back(stiffness_.diagonal(node).inverse());
  }

  // Returns u_f for the displacement d of the contacts. Starts from the last frame.
  const Eigen::VectorXd& frame(const Eigen::VectorXd& d) {
    const Eigen::VectorXd push = -(held_->free_contact * (d - contacts_));
    contacts_ = d;
    residual_ += push;
    const double tolerance = tolerance_ * (held_->free_contact * d).norm();
    // A node is active where its residual exceeds the node's share of the tolerance.
    const double node_tolerance = tolerance / std::sqrt(static_cast<double>(is_active_.size()));
    active_.clear();
    for (size_t node = 0; node < is_active_.size(); ++node) {
      is_active_[node] = residual_.segment<3>(at(node)).norm() > node_tolerance;
      if (is_active_[node]) active_.push_back(static_cast<int>(node));
    }
    iterations_ = 0;
    const size_t num_active = active_.size();
    for (size_t i = 0; i < num_active; ++i) direction_.segment<3>(at(active_[i])).setZero();
    double before = 0;
    for (; iterations_ < kMostIterations && sum(residual_, residual_) > tolerance * tolerance;
         ++iterations_) {
      for (const int node : active_) precondition_at(node);
      const double now = sum(residual_, preconditioned_);
      const double beta = before > 0 ? now / before : 0.0;
      before = now;
      for (const int node : active_)
        direction_.segment<3>(at(node)) =
            preconditioned_.segment<3>(at(node)) + beta * direction_.segment<3>(at(node));
      reach_neighbours();
      for (const int node : active_) multiply_at(node);
      const double alpha = now / sum(direction_, product_);
      for (const int node : active_) {
        displacement_.segment<3>(at(node)) += alpha * direction_.segment<3>(at(node));
        residual_.segment<3>(at(node)) -= alpha * product_.segment<3>(at(node));
      }
    }
    for (const int node : active_) direction_.segment<3>(at(node)).setZero();
    return displacement_;
  }

  // u_f of the last frame.
  const Eigen::VectorXd& displacement() const { return displacement_; }
  int iterations() const { return iterations_; }

 private:
  static constexpr int kMostIterations = 10000;

  template <typename Node>
  static Eigen::Index at(Node node) {
    return 3 * static_cast<Eigen::Index>(node);
  }
  double sum(const Eigen::VectorXd& a, const Eigen::VectorXd& b) const {
    double total = 0;
    for (const int node : active_) total += a.segment<3>(at(node)).dot(b.segment<3>(at(node)));
    return total;
  }
  void precondition_at(int node) {
    const Eigen::Vector3d r = residual_.segment<3>(at(node));
    preconditioned_.segment<3>(at(node)) =
        precondition_ ? Eigen::Vector3d(inverse_blocks_[static_cast<size_t>(node)] * r) : r;
  }
  // Activates the neighbours of all active nodes. The direction is zero on newly active nodes.
  void reach_neighbours() {
    const size_t count = active_.size();
    if (count == is_active_.size()) return;
    for (size_t i = 0; i < count; ++i) {
      for (const int neighbour : stiffness_.neighbours(active_[i])) {
        const auto node = static_cast<size_t>(neighbour);
        if (is_active_[node]) continue;
        is_active_[node] = 1;
        active_.push_back(neighbour);
      }
    }
  }
  void multiply_at(int node) { product_.segment<3>(at(node)) = stiffness_.times(node, direction_); }

  const HeldContacts* held_;
  NodeBlocks stiffness_;
  bool precondition_;
  double tolerance_;
  std::vector<Eigen::Matrix3d> inverse_blocks_;
  Eigen::VectorXd displacement_, residual_, preconditioned_, direction_, product_, contacts_;
  std::vector<char> is_active_;
  std::vector<int> active_;
  int iterations_ = 0;
};

}  // namespace palpate::peers
