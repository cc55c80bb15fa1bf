#include "offline/fem/cholesky.hpp"

#include <algorithm>
#include <mutex>
#include <new>
#include <stdexcept>
#include <string>

// Of the OpenMP runtime that CHOLMOD brings; <omp.h> belongs to a compiler, and we compile nothing with
// OpenMP.
extern "C" void omp_set_max_active_levels(int levels);

namespace palpate {
namespace {

cholmod_sparse view(const Eigen::SparseMatrix<double, Eigen::ColMajor, int>& matrix) {
  cholmod_sparse sparse = {};
  sparse.nrow = static_cast<size_t>(matrix.rows());
  sparse.ncol = static_cast<size_t>(matrix.cols());
  sparse.nzmax = static_cast<size_t>(matrix.nonZeros());
  sparse.p = const_cast<int*>(matrix.outerIndexPtr());
  sparse.i = const_cast<int*>(matrix.innerIndexPtr());
  sparse.x = const_cast<double*>(matrix.valuePtr());
  sparse.stype = -1;  // lower triangle of a symmetric matrix
  sparse.itype = CHOLMOD_INT;
  sparse.xtype = CHOLMOD_REAL;
  sparse.dtype = CHOLMOD_DOUBLE;
  sparse.sorted = 1;
  sparse.packed = 1;
  return sparse;
}

// For the negative values of CHOLMOD's status; a matrix that is not positive definite is a warning,
// CHOLMOD_NOT_POSDEF.
[[noreturn]] void throw_failure(int status) {
  if (status == CHOLMOD_OUT_OF_MEMORY) throw std::bad_alloc();
  if (status == CHOLMOD_TOO_LARGE)
    throw std::runtime_error("the factor of this model has more than 2^31 entries");
  throw std::runtime_error("CHOLMOD failed with status " + std::to_string(status));
}

void start(cholmod_common& common) {
  // CHOLMOD's own OpenMP loops only copy; their threads would spin beside those of BLAS, and beside ours in a
  // build.
  omp_set_max_active_levels(0);
  cholmod_start(&common);
  common.print = 0;
  common.supernodal = CHOLMOD_SUPERNODAL;
}

// Ends `common` and throws when CHOLMOD gave no factor.
void require(const cholmod_factor* factor, cholmod_common& common) {
  if (factor != nullptr) return;
  const int status = common.status;
  cholmod_finish(&common);
  throw_failure(status);
}

}  // namespace

CholeskyAnalysis::CholeskyAnalysis(const SparseLower& pattern) {
  start(common_);
  if (pattern.rows() == 0) return;  // CHOLMOD takes no matrix without rows
  common_.nmethods = 1;
  common_.method[0].ordering = CHOLMOD_METIS;
  cholmod_sparse sparse = view(pattern);
  {
    // METIS draws from the C library's one random sequence, which it seeds anew each time: two analyses at
    // once would order by each other's numbers, and the last digits of every solve would follow the schedule.
    static std::mutex one_analysis;
    const std::lock_guard lock(one_analysis);
    symbolic_ = cholmod_analyze(&sparse, &common_);
  }
  require(symbolic_, common_);
}

CholeskyAnalysis::~CholeskyAnalysis() {
  cholmod_free_factor(&symbolic_, &common_);
  cholmod_finish(&common_);
}

Cholesky::Cholesky(const CholeskyAnalysis& analysis) {
  start(common_);
  if (analysis.symbolic_ == nullptr) return;
  factor_ = cholmod_copy_factor(analysis.symbolic_, &common_);
  require(factor_, common_);
}

Cholesky::~Cholesky() {
  cholmod_free_dense(&solution_, &common_);
  cholmod_free_dense(&forward_, &common_);
  cholmod_free_dense(&permuted_, &common_);
  cholmod_free_factor(&factor_, &common_);
  cholmod_finish(&common_);
}

bool Cholesky::factorize(const SparseLower& matrix) {
  if (factor_ == nullptr) return true;
  cholmod_sparse sparse = view(matrix);
  common_.status = CHOLMOD_OK;
  cholmod_factorize(&sparse, factor_, &common_);
  if (common_.status < CHOLMOD_OK) throw_failure(common_.status);
  return common_.status == CHOLMOD_OK && factor_->minor == factor_->n;
}

void Cholesky::solve(Eigen::MatrixXd& right_hand_sides) {
  solve_dense(right_hand_sides.data(), static_cast<int>(right_hand_sides.cols()));
}

void Cholesky::solve(Eigen::VectorXd& right_hand_side) {
  solve_dense(right_hand_side.data(), 1);
}

void Cholesky::solve_dense(double* values, int columns) {
  if (columns == 0 || factor_ == nullptr) return;
  cholmod_dense dense = {};
  dense.nrow = factor_->n;
  dense.ncol = static_cast<size_t>(columns);
  dense.nzmax = dense.nrow * dense.ncol;
  dense.d = dense.nrow;
  dense.x = values;
  dense.xtype = CHOLMOD_REAL;
  dense.dtype = CHOLMOD_DOUBLE;
  const int done = cholmod_solve2(CHOLMOD_A, factor_, &dense, nullptr, &solution_, nullptr, &forward_,
                                  &permuted_, &common_);
  if (done == 0) throw_failure(common_.status);
  std::copy_n(static_cast<const double*>(solution_->x), dense.nzmax, values);
}

}  // namespace palpate
