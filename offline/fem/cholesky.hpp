// Sparse Cholesky factor K = L L^T: one symbolic analysis by CHOLMOD, many numeric factors by the
// multifrontal method, in double or in single precision. K = L S L^T, with signs S, where K is indefinite.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>

#include "offline/fem/front_tree.hpp"
#include "offline/fem/multifrontal.hpp"

namespace palpate {

// The ordering and the pattern of L, which all matrices of one pattern share. Constant; any number of threads
// may make factors from it.
class CholeskyAnalysis {
 public:
  // Nested dissection (METIS), which costs 1.4 times less to factor than AMD on organ meshes. Throws
  // std::bad_alloc when memory runs out, std::runtime_error when CHOLMOD fails otherwise.
  explicit CholeskyAnalysis(const SparseLower& pattern);
  CholeskyAnalysis(const CholeskyAnalysis&) = delete;
  CholeskyAnalysis& operator=(const CholeskyAnalysis&) = delete;

  const std::shared_ptr<const FrontTree>& fronts() const { return fronts_; }
  // Nonzeros of L, and floating-point operations of one numeric factor.
  double factor_nonzeros() const { return factor_nonzeros_; }
  double factor_operations() const { return factor_operations_; }

 private:
  std::shared_ptr<const FrontTree> fronts_;
  double factor_nonzeros_ = 0;
  double factor_operations_ = 0;
};

// Of a factor. Single takes half the time and memory, and leaves a solution about six digits less the
// condition of the matrix.
enum class Precision { single_precision, double_precision };

// Not thread-safe: one object a thread. Not copyable.
class Cholesky {
 public:
  explicit Cholesky(const CholeskyAnalysis& analysis, int threads = 1);
  Cholesky(const Cholesky&) = delete;
  Cholesky& operator=(const Cholesky&) = delete;

  // Numeric factor of a matrix with the analysed pattern. False where it is not positive definite to the
  // rounding of that precision; solve() then must not be called. Throws std::bad_alloc when memory runs out.
  [[nodiscard]] bool factorize(const SparseLower& matrix, Precision precision = Precision::double_precision);

  // L S L^T in double precision of a matrix that need not be positive definite (multifrontal.hpp). False where
  // a pivot is only rounding: the matrix is singular, or as good as that.
  [[nodiscard]] bool factorize_indefinite(const SparseLower& matrix);
  // Of the last factor: as many eigenvalues of the matrix are negative.
  int num_negative_pivots() const;

  // Replaces each column of `right_hand_sides` (n rows) by K^-1 times it. Columns in blocks share each read
  // of L.
  void solve(Eigen::MatrixXd& right_hand_sides);
  void solve(Eigen::VectorXd& right_hand_side);

 private:
  bool factorize_in_double(const SparseLower& matrix, Pivots pivots);
  void solve_dense(double* values, int columns);

  std::shared_ptr<const FrontTree> fronts_;
  int threads_;
  std::optional<Multifrontal<double>> double_;  // the last factor is in one of the two
  std::optional<Multifrontal<float>> single_;
};

}  // namespace palpate
