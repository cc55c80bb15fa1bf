// Preconditioned conjugate gradients for K x = b: the linear solver of Zhong et al. 2005 section 2.3, the
// alternative to a Cholesky factor. Slower on organ meshes, and lighter: its memory is a few times that of K.
//
// Source: Hestenes and Stiefel 1952; preconditioned by an incomplete Cholesky factor of the pattern of K (Lin
// and More 1999, as Eigen has it).
#pragma once

#include <Eigen/Core>
#include <Eigen/IterativeLinearSolvers>
#include <Eigen/SparseCore>

#include "offline/fem/cholesky.hpp"

namespace palpate {

class ConjugateGradient {
 public:
  // Keeps a copy of the matrix and makes its preconditioner. Throws std::bad_alloc.
  void prepare(const SparseLower& matrix);

  // Replaces b by K^-1 b to |b - K x| <= 1e-9 |b|: Newton then loses none of its speed. False, with b as it
  // was, where a direction of negative or no curvature shows that K is not positive definite, or where 10,000
  // iterations were not enough.
  [[nodiscard]] bool solve(Eigen::Ref<Eigen::VectorXd> right_hand_side);

  long iterations() const { return iterations_; }  // of all solves so far

 private:
  SparseLower matrix_;
  Eigen::IncompleteCholesky<double, Eigen::Lower, Eigen::AMDOrdering<int>> preconditioner_;
  long iterations_ = 0;
};

}  // namespace palpate
