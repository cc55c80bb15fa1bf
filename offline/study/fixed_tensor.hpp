// PFE: a prepared tensor for one fixed set of k contacts maps their displacement to all node displacements,
// another to their forces. A frame is one dense product 3m x 3k and one small product.
//
// Source: Cotin, Delingette, Ayache 1999, Real-time elastic deformations of soft tissues for surgery simulation.
#pragma once

#include <algorithm>

#include "offline/study/back_solve.hpp"

namespace palpate {

class FixedTensor {
 public:
  // Solves for each of the 3 k columns, in blocks. `rows`: rows of u_f in the tensor; null: all rows.
  FixedTensor(const HeldContacts& held, BackSolve& back_solve, const std::vector<int>* rows = nullptr)
      : tensor_(rows == nullptr ? held.free_free.rows() : static_cast<Eigen::Index>(rows->size()),
                held.free_contact.cols()),
        force_tensor_(tensor_.cols(), tensor_.cols()) {
    constexpr Eigen::Index kBlock = 48;
    const Eigen::MatrixXd unit = Eigen::MatrixXd::Identity(tensor_.cols(), tensor_.cols());
    for (Eigen::Index first = 0; first < tensor_.cols(); first += kBlock) {
      const Eigen::Index width = std::min(kBlock, tensor_.cols() - first);
      const Eigen::MatrixXd d = unit.middleCols(first, width);
      const Eigen::MatrixXd free = back_solve.solve(d);
      if (rows == nullptr) {
        tensor_.middleCols(first, width) = free.cast<pal_real>();
      } else {
        tensor_.middleCols(first, width) = free(*rows, Eigen::all).cast<pal_real>();
      }
      force_tensor_.middleCols(first, width) =
          held.free_contact.transpose() * free + held.contact_contact * d;
    }
  }

  void frame(const Eigen::VectorXd& d) {
    field_frame(d);
    force_frame(d);
  }
  void field_frame(const Eigen::VectorXd& d) { displacement_.noalias() = tensor_ * d.cast<pal_real>(); }
  void force_frame(const Eigen::VectorXd& d) { force_.noalias() = force_tensor_ * d; }
  // the tensor's rows of u_f in the last frame
  const RealVector& displacement() const { return displacement_; }
  const Eigen::VectorXd& force() const { return force_; }

 private:
  RealMatrix tensor_;
  Eigen::MatrixXd force_tensor_;
  RealVector displacement_;
  Eigen::VectorXd force_;
};

}  // namespace palpate
