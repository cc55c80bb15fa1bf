// Exact linear frames by a back-solve with a prepared factor (CHOLMOD). The factor fits one set of contacts.
#pragma once

#include <Eigen/CholmodSupport>
#include <stdexcept>

#include "bench/peers/held_contacts.hpp"

namespace palpate::peers {

class BackSolve {
 public:
  explicit BackSolve(const HeldContacts& held) : held_(&held) {
    factor_.compute(Eigen::SparseMatrix<double>(held.free_free));
    if (factor_.info() != Eigen::Success) throw std::runtime_error("the stiffness is not positive definite");
  }

  // Returns u_f for the displacement d of the contacts.
  const Eigen::VectorXd& frame(const Eigen::VectorXd& d) {
    displacement_ = factor_.solve(Eigen::VectorXd(-(held_->free_contact * d)));
    return displacement_;
  }
  // Returns u_f for each column of d. The columns share each read of the factor.
  Eigen::MatrixXd solve(const Eigen::MatrixXd& d) {
    return factor_.solve(Eigen::MatrixXd(-(held_->free_contact * d)));
  }
  const Eigen::VectorXd& displacement() const { return displacement_; }  // u_f of the last frame

 private:
  const HeldContacts* held_;
  Eigen::CholmodSupernodalLLT<Eigen::SparseMatrix<double>> factor_;
  Eigen::VectorXd displacement_;
};

}  // namespace palpate::peers
