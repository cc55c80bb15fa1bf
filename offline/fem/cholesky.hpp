// Sparse Cholesky factor K = L L^T by CHOLMOD's supernodal code: one symbolic analysis, many numeric factors.
#pragma once

#include <cholmod.h>

#include <Eigen/Core>
#include <Eigen/SparseCore>

namespace palpate {

using SparseLower =
    Eigen::SparseMatrix<double, Eigen::ColMajor, int>;  // lower triangle of a symmetric matrix

// The ordering and the pattern of L, which all matrices of one pattern share. Constant; any number of threads
// may make factors from it.
class CholeskyAnalysis {
 public:
  // Nested dissection (METIS), which costs 1.4 times less to factor than AMD on organ meshes. Throws
  // std::bad_alloc when memory runs out, std::runtime_error when CHOLMOD fails otherwise.
  explicit CholeskyAnalysis(const SparseLower& pattern);
  ~CholeskyAnalysis();
  CholeskyAnalysis(const CholeskyAnalysis&) = delete;
  CholeskyAnalysis& operator=(const CholeskyAnalysis&) = delete;

  // Nonzeros of L, and floating-point operations of one numeric factor.
  double factor_nonzeros() const { return common_.lnz; }
  double factor_operations() const { return common_.fl; }

 private:
  friend class Cholesky;
  cholmod_common common_;
  cholmod_factor* symbolic_ = nullptr;
};

// Not thread-safe: one object a thread. Not copyable.
class Cholesky {
 public:
  explicit Cholesky(const CholeskyAnalysis& analysis);
  ~Cholesky();
  Cholesky(const Cholesky&) = delete;
  Cholesky& operator=(const Cholesky&) = delete;

  // Numeric factor of a matrix with the analysed pattern. False where it is not positive definite to
  // rounding; solve() then must not be called. Throws std::bad_alloc when memory runs out, std::runtime_error
  // when CHOLMOD fails otherwise.
  [[nodiscard]] bool factorize(const SparseLower& matrix);

  // Replaces each column of `right_hand_sides` (n rows) by K^-1 times it. Columns in blocks share each read
  // of L.
  void solve(Eigen::MatrixXd& right_hand_sides);
  void solve(Eigen::VectorXd& right_hand_side);

 private:
  void solve_dense(double* values, int columns);

  cholmod_common common_;
  cholmod_factor* factor_ = nullptr;
  cholmod_dense* solution_ = nullptr;  // workspaces that cholmod_solve2 keeps between calls
  cholmod_dense* forward_ = nullptr;
  cholmod_dense* permuted_ = nullptr;
};

}  // namespace palpate
