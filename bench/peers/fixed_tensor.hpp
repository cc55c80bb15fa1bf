// PFE: the displacement of every node as a tensor times that of the contacts, made beforehand for these
// contacts and no others. A frame is one dense product, 3 m x 3 k.
//
// Source: Cotin, Delingette, Ayache 1999, Real-time elastic deformations of soft tissues for surgery simulation.
#pragma once

#include "bench/peers/back_solve.hpp"

namespace palpate::peers {

class FixedTensor {
 public:
  // A back-solve for each of the 3 k columns.
  FixedTensor(const HeldContacts& held, BackSolve& back_solve)
      : tensor_(held.free_free.rows(), held.free_contact.cols()) {
    for (Eigen::Index column = 0; column < tensor_.cols(); ++column)
      tensor_.col(column) = back_solve.frame(Eigen::VectorXd::Unit(tensor_.cols(), column)).cast<float>();
  }

  // u_f.
  const Eigen::VectorXf& frame(const Eigen::VectorXd& d) {
    displacement_.noalias() = tensor_ * d.cast<float>();
    return displacement_;
  }

 private:
  Eigen::MatrixXf tensor_;
  Eigen::VectorXf displacement_;
};

}  // namespace palpate::peers
