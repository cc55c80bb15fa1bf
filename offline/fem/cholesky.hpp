// Sparse Cholesky factor K = L L^T, or K = L S L^T with signs S where K is indefinite. CHOLMOD analyses the
// pattern once; the multifrontal method computes many numeric factors, in double or single precision.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>

#include "offline/fem/front_tree.hpp"
#include "offline/fem/multifrontal.hpp"

namespace palpate {

// The ordering and the pattern of L, shared by all matrices of one pattern. Constant: any number of threads
// may share an object.
class CholeskyAnalysis {
 public:
  // Orders by nested dissection (METIS): on organ meshes the factor costs less than with AMD. Throws
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

// Precision of a factor. Single precision halves time and memory, and keeps about 7 - log10(cond K) digits.
enum class Precision { single_precision, double_precision };

// Not thread-safe: one object for each thread. Not copyable.
class Cholesky {
 public:
  explicit Cholesky(const CholeskyAnalysis& analysis, int threads = 1);
  Cholesky(const Cholesky&) = delete;
  Cholesky& operator=(const Cholesky&) = delete;

  // Factors a matrix with the analysed pattern. Returns false where the matrix is not positive definite to
  // rounding; solve() is then invalid. Throws std::bad_alloc when memory runs out.
  [[nodiscard]] bool factorize(const SparseLower& matrix, Precision precision = Precision::double_precision);

  // Factors an indefinite matrix as L S L^T in double precision (multifrontal.hpp). Returns false where a
  // pivot is rounding: the matrix is numerically singular.
  [[nodiscard]] bool factorize_indefinite(const SparseLower& matrix);
  // Returns the number of negative eigenvalues of the last factored matrix; 0 for a single-precision factor.
  int num_negative_pivots() const;

  // Replaces each column b of `right_hand_sides` (n rows) by K^-1 b. Blocks of columns share each read of L.
  void solve(Eigen::MatrixXd& right_hand_sides);
  void solve(Eigen::VectorXd& right_hand_side);

 private:
  bool factorize_in_double(const SparseLower& matrix, Pivots pivots);
  void solve_dense(double* values, int columns);

  std::shared_ptr<const FrontTree> fronts_;
  int threads_;
  std::optional<Multifrontal<double>> double_;  // double_ or single_ holds the last factor
  std::optional<Multifrontal<float>> single_;
};

}  // namespace palpate
