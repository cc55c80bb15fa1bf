// One back-solve a frame with a factor made beforehand (CHOLMOD): exact, and bound to its contacts; other
// contacts need another factor.
#pragma once

#include <Eigen/CholmodSupport>
#include <stdexcept>

#include "offline/study/held_contacts.hpp"

namespace palpate {

class BackSolve {
 public:
  explicit BackSolve(const HeldContacts& held) : held_(&held) {
    factor_.compute(Eigen::SparseMatrix<double>(held.free_free));
    if (factor_.info() != Eigen::Success) throw std::runtime_error("the stiffness is not positive definite");
  }

  // u_f.
  const Eigen::VectorXd& frame(const Eigen::VectorXd& d) {
    displacement_ = factor_.solve(Eigen::VectorXd(-(held_->free_contact * d)));
    return displacement_;
  }
  // u_f for each of these columns; many share each pass over the factor.
  Eigen::MatrixXd solve(const Eigen::MatrixXd& d) {
    return factor_.solve(Eigen::MatrixXd(-(held_->free_contact * d)));
  }
  const Eigen::VectorXd& displacement() const { return displacement_; }  // of the last frame

 private:
  const HeldContacts* held_;
  Eigen::CholmodSupernodalLLT<Eigen::SparseMatrix<double>> factor_;
  Eigen::VectorXd displacement_;
};

}  // namespace palpate
