// The shape of a multifrontal Cholesky factor: which columns are eliminated together, and where their update
// goes.
//
// Columns of L with the same pattern form a supernode. With the rows below it a supernode makes a *front*, a
// dense lower triangle
//   [ F11      ]   columns of the supernode
//   [ F21  F22 ]   rows below
// into which go the matrix' entries of those columns and the updates of the fronts below it in the tree.
// Eliminating the columns leaves L11, L21 and the update U = F22 - L21 L21^T, whose rows are all rows of the
// parent. The tree is in postorder: the descendants of a front are the fronts just before it.
//
// Source: Duff and Reid 1983; Liu 1992, The multifrontal method for sparse matrix solution.
#pragma once

#include <Eigen/SparseCore>
#include <cstddef>
#include <span>
#include <vector>

struct cholmod_factor_struct;  // CHOLMOD's cholmod_factor

namespace palpate {

using SparseLower =
    Eigen::SparseMatrix<double, Eigen::ColMajor, int>;  // lower triangle of a symmetric matrix

struct Front {
  int num_columns = 0;
  int num_rows = 0;  // columns included
  int first_column = 0;
  int parent = -1;       // -1: a root
  int first_within = 0;  // of the fronts of its subtree, which ends at the front itself
  int depth = 0;         // number of ancestors
  size_t panel = 0;      // of L11 and L21, column-major with num_rows rows, among the entries of L
  size_t rows = 0;       // where its num_rows begin, in anything that has one entry a row of every front
  size_t first_run = 0;  // of those in its parent, see FrontTree::runs_in_parent()
  int num_runs = 0;
  double operations = 0;  // of its elimination, floating point

  int num_updated() const { return num_rows - num_columns; }
  size_t update_entries() const {  // U is kept as a square
    return static_cast<size_t>(num_updated()) * static_cast<size_t>(num_updated());
  }
};

// Constant once made.
class FrontTree {
 public:
  FrontTree() = default;
  // From CHOLMOD's supernodal analysis of `pattern`. Throws std::runtime_error where a front has more than
  // 2^31 entries.
  FrontTree(const SparseLower& pattern, const cholmod_factor_struct& symbolic);

  int size() const { return static_cast<int>(fronts_.size()); }
  const Front& operator[](int front) const { return fronts_[static_cast<size_t>(front)]; }
  std::span<const int> children(int front) const;

  // Where the updated rows of a front stand among the rows of its parent, ascending, in runs of rows that
  // stand side by side in both: all among the parent's columns, or all below them.
  struct Run {
    int row;  // of the updated ones, the first
    int length;
    int place;  // in the parent
  };
  std::span<const Run> runs_in_parent(int front) const {
    const Front& at = (*this)[front];
    return {runs_.data() + at.first_run, static_cast<size_t>(at.num_runs)};
  }

  // One stored entry of the matrix and its place in the panel of its front.
  struct Entry {
    int source;  // position in the value array
    int target;
  };
  std::span<const Entry> entries(int front) const;

  int num_entries() const { return static_cast<int>(entries_.size()); }
  const std::vector<int>& permutation() const { return permutation_; }  // column of L -> equation
  size_t panel_entries() const { return panel_entries_; }
  size_t total_rows() const {  // sum of num_rows
    return fronts_.empty() ? 0 : fronts_.back().rows + static_cast<size_t>(fronts_.back().num_rows);
  }

 private:
  void set_entries(const SparseLower& pattern, const int* row_indices, const std::vector<int>& front_of);

  std::vector<Front> fronts_;
  std::vector<int> children_;  // of front after front
  std::vector<int> first_child_;
  std::vector<Run> runs_;
  std::vector<Entry> entries_;
  std::vector<int> first_entry_;
  std::vector<int> permutation_;
  size_t panel_entries_ = 0;
};

}  // namespace palpate
