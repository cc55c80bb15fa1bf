#include "offline/fem/cholesky.hpp"

#include <cblas.h>
#include <cholmod.h>

#include <algorithm>
#include <cstdint>
#include <mutex>
#include <new>
#include <stdexcept>
#include <string>
#include <vector>

// Ends the worker threads of OpenBLAS. OpenBLAS does not publish this function, and some builds lack it.
extern "C" int blas_thread_shutdown_() __attribute__((weak));

namespace palpate {
namespace {

// Makes BLAS single-threaded. Palpate runs its own threads over branches of the elimination tree and over
// sites. Threads of BLAS would compete with them, and their number would change the last digits.
void make_blas_serial() {
  static std::once_flag once;
  std::call_once(once, [] {
    if (openblas_get_parallel() == OPENBLAS_SEQUENTIAL)
      throw std::runtime_error(
          "the serial OpenBLAS of this machine gives wrong results when several threads "
          "call BLAS; install libopenblas0-pthread, which replaces the serial variant");
    openblas_set_num_threads(1);
    if (blas_thread_shutdown_ != nullptr) blas_thread_shutdown_();
  });
}

cholmod_sparse view(const SparseLower& matrix) {  // copies no entries
  cholmod_sparse sparse = {};
  sparse.nrow = static_cast<size_t>(matrix.rows());
  sparse.ncol = static_cast<size_t>(matrix.cols());
  sparse.nzmax = static_cast<size_t>(matrix.nonZeros());
  sparse.p = const_cast<int*>(matrix.outerIndexPtr());
  sparse.i = const_cast<int*>(matrix.innerIndexPtr());
  sparse.stype = -1;  // lower triangle of a symmetric matrix
  sparse.itype = CHOLMOD_INT;
  sparse.xtype = CHOLMOD_PATTERN;
  sparse.dtype = CHOLMOD_DOUBLE;
  sparse.sorted = 1;
  sparse.packed = 1;
  return sparse;
}

// Owns CHOLMOD's workspace during one analysis.
class Workspace {
 public:
  Workspace() {
    cholmod_start(&common);
    common.print = 0;
    common.supernodal = CHOLMOD_SUPERNODAL;
    common.nmethods = 1;
    common.method[0].ordering = CHOLMOD_GIVEN;  // the order that the caller passes
  }
  ~Workspace() { cholmod_finish(&common); }
  Workspace(const Workspace&) = delete;
  Workspace& operator=(const Workspace&) = delete;

  cholmod_common common;
};

// Groups consecutive equations with equal couplings, such as the dofs of a node, into blocks: blocks are
// faster to order. Returns the first equation of each block, and the end. A sum of hashes stands for the
// neighbours of an equation: a collision degrades the ordering, not the result.
std::vector<int> group_equal_columns(const SparseLower& pattern) {
  const auto hash = [](int equation) {  // splitmix64
    std::uint64_t bits = (static_cast<std::uint64_t>(equation) + 1) * 0x9e3779b97f4a7c15U;
    bits = (bits ^ (bits >> 30)) * 0xbf58476d1ce4e5b9U;
    bits = (bits ^ (bits >> 27)) * 0x94d049bb133111ebU;
    return bits ^ (bits >> 31);
  };
  std::vector<std::uint64_t> neighbourhood(static_cast<size_t>(pattern.cols()),
                                           0);  // with the equation itself
  for (int column = 0; column < pattern.outerSize(); ++column) {
    for (SparseLower::InnerIterator it(pattern, column); it; ++it) {
      neighbourhood[static_cast<size_t>(column)] += hash(static_cast<int>(it.row()));
      if (it.row() != column) neighbourhood[static_cast<size_t>(it.row())] += hash(column);
    }
  }
  std::vector<int> first_of;
  for (int column = 0; column < pattern.outerSize(); ++column) {
    const size_t at = static_cast<size_t>(column);
    if (column == 0 || neighbourhood[at] != neighbourhood[at - 1]) first_of.push_back(column);
  }
  first_of.push_back(static_cast<int>(pattern.outerSize()));
  return first_of;
}

// Returns the graph of the blocks. All equations of a block have the same neighbours as its first equation.
SparseLower quotient(const SparseLower& pattern, const std::vector<int>& first_of) {
  const int num_blocks = static_cast<int>(first_of.size()) - 1;
  std::vector<int> block_of(static_cast<size_t>(pattern.cols()));
  for (int block = 0; block < num_blocks; ++block) {
    const auto begin = block_of.begin();
    std::fill(begin + first_of[static_cast<size_t>(block)], begin + first_of[static_cast<size_t>(block) + 1],
              block);
  }
  SparseLower blocks(num_blocks, num_blocks);
  for (int block = 0; block < num_blocks; ++block) {
    blocks.startVec(block);
    int last = -1;
    for (SparseLower::InnerIterator it(pattern, first_of[static_cast<size_t>(block)]); it; ++it) {
      const int row = block_of[static_cast<size_t>(it.row())];
      // Rows ascend, so the equations of a block follow one another.
      if (row != last) blocks.insertBack(row, block) = 1.0;
      last = row;
    }
  }
  blocks.finalize();
  return blocks;
}

}  // namespace

CholeskyAnalysis::CholeskyAnalysis(const SparseLower& pattern) : fronts_(std::make_shared<FrontTree>()) {
  if (pattern.rows() == 0) return;  // CHOLMOD refuses a matrix without rows
  make_blas_serial();
  Workspace workspace;
  const std::vector<int> first_of = group_equal_columns(pattern);
  const SparseLower merged = quotient(pattern, first_of);
  cholmod_sparse sparse = view(pattern);
  cholmod_sparse blocks = view(merged);
  std::vector<int> block_order(first_of.size() - 1);
  std::vector<int> order;
  cholmod_factor* symbolic = nullptr;
  {
    // METIS reseeds the C library's random sequence. Concurrent analyses would share the sequence, and the
    // ordering would depend on the schedule.
    static std::mutex one_analysis;
    const std::lock_guard lock(one_analysis);
    if (cholmod_metis(&blocks, nullptr, 0, 0, block_order.data(), &workspace.common) != 0) {
      for (const int block : block_order) {
        for (int equation = first_of[static_cast<size_t>(block)];
             equation < first_of[static_cast<size_t>(block) + 1]; ++equation)
          order.push_back(equation);
      }
      symbolic = cholmod_analyze_p(&sparse, order.data(), nullptr, 0, &workspace.common);
    }
  }
  if (symbolic == nullptr) {
    const int status = workspace.common.status;
    if (status == CHOLMOD_OUT_OF_MEMORY) throw std::bad_alloc();
    if (status == CHOLMOD_TOO_LARGE)
      throw std::runtime_error("the factor of this model has more than 2^31 entries; take a coarser mesh");
    throw std::runtime_error("CHOLMOD failed with status " + std::to_string(status));
  }
  try {
    fronts_ = std::make_shared<FrontTree>(pattern, *symbolic);
  } catch (...) {
    cholmod_free_factor(&symbolic, &workspace.common);
    throw;
  }
  cholmod_free_factor(&symbolic, &workspace.common);
  factor_nonzeros_ = workspace.common.lnz;
  factor_operations_ = workspace.common.fl;
}

Cholesky::Cholesky(const CholeskyAnalysis& analysis, int threads)
    : fronts_(analysis.fronts()), threads_(threads) {}

bool Cholesky::factorize(const SparseLower& matrix, Precision precision) {
  if (precision == Precision::single_precision) {
    double_.reset();
    if (!single_) single_.emplace(*fronts_, threads_);
    return single_->factorize(matrix.valuePtr());
  }
  return factorize_in_double(matrix, Pivots::positive);
}

bool Cholesky::factorize_indefinite(const SparseLower& matrix) {
  return factorize_in_double(matrix, Pivots::of_either_sign);
}

bool Cholesky::factorize_in_double(const SparseLower& matrix, Pivots pivots) {
  single_.reset();
  if (!double_) double_.emplace(*fronts_, threads_);
  return double_->factorize(matrix.valuePtr(), pivots);
}

int Cholesky::num_negative_pivots() const {
  return double_ ? double_->num_negative_pivots() : 0;
}

void Cholesky::solve(Eigen::MatrixXd& right_hand_sides) {
  solve_dense(right_hand_sides.data(), static_cast<int>(right_hand_sides.cols()));
}

void Cholesky::solve(Eigen::VectorXd& right_hand_side) {
  solve_dense(right_hand_side.data(), 1);
}

void Cholesky::solve_dense(double* values, int columns) {
  if (single_) {
    single_->solve(values, columns);
  } else if (double_) {
    double_->solve(values, columns);
  } else {
    throw std::logic_error("there is no factor to solve with");
  }
}

}  // namespace palpate
