// PFE: two tensors, prepared for a fixed set of k contacts, map the displacement d of the contacts. The
// free nodes move by u_f = T d [3m x 3k]; the forces are f = S d [3k x 3k]. Source: Cotin, Delingette and
// Ayache 1999, Real-time elastic deformations of soft tissues for surgery simulation.
#pragma once

#include <algorithm>

#include "bench/peers/back_solve.hpp"

namespace palpate::peers {

class FixedTensor {
 public:
  // Computes T and S by a solve for each of the 3k columns, in blocks of columns.
  FixedTensor(const HeldContacts& held, BackSolve& back_solve)
      : tensor_(held.free_free.rows(), held.free_contact.cols()),
        force_tensor_(tensor_.cols(), tensor_.cols()) {
    constexpr Eigen::Index kBlock = 48;
    const Eigen::MatrixXd unit = Eigen::MatrixXd::Identity(tensor_.cols(), tensor_.cols());
    for (Eigen::Index first = 0; first < tensor_.cols(); first += kBlock) {
      const Eigen::Index width = std::min(kBlock, tensor_.cols() - first);
      const Eigen::MatrixXd d = unit.middleCols(first, width);
      const Eigen::MatrixXd free = back_solve.solve(d);
      tensor_.middleCols(first, width) = free.cast<pal_real>();
      force_tensor_.middleCols(first, width) =
          held.free_contact.transpose() * free + held.contact_contact * d;
    }
  }

  void frame(const Eigen::VectorXd& d) {
    displacement_.noalias() = tensor_ * d.cast<pal_real>();
    force_.noalias() = force_tensor_ * d;
  }
  const RealVector& displacement() const { return displacement_; }  // u_f of the last frame
  const Eigen::VectorXd& force() const { return force_; }

 private:
  RealMatrix tensor_;             // T
  Eigen::MatrixXd force_tensor_;  // S
  RealVector displacement_;
  Eigen::VectorXd force_;
};

}  // namespace palpate::peers
