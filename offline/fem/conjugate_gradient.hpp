// Preconditioned conjugate gradients for K x = b: the linear solver of Zhong et al. 2005 section 2.3. On
// organ meshes the method is slower than a Cholesky factor and needs less memory.
//
// Source: Hestenes and Stiefel 1952. Preconditioner: Eigen's incomplete Cholesky factor (Lin and More 1999).
#pragma once

#include <Eigen/Core>
#include <Eigen/IterativeLinearSolvers>
#include <Eigen/SparseCore>

#include "offline/fem/cholesky.hpp"

namespace palpate {

class ConjugateGradient {
 public:
  // Copies the matrix and computes its preconditioner. Throws std::bad_alloc.
  void prepare(const SparseLower& matrix);

  // Replaces b by x with |b - K x| <= 1e-9 |b|, accurate enough for Newton's convergence. Returns false and
  // leaves b unchanged where:
  //   1. a direction has no positive curvature: K is not positive definite, or
  //   2. 10,000 iterations did not converge.
  [[nodiscard]] bool solve(Eigen::Ref<Eigen::VectorXd> right_hand_side);

  long iterations() const { return iterations_; }  // sum over all solves so far

 private:
  SparseLower matrix_;
  Eigen::IncompleteCholesky<double, Eigen::Lower, Eigen::AMDOrdering<int>> preconditioner_;
  long iterations_ = 0;
};

}  // namespace palpate
