// Describes the structure of a multifrontal Cholesky factor: the columns of each elimination, and the entries
// that each update changes.
//
// A supernode is a range of consecutive columns of L that are stored with the same rows below the range. A
// supernode and these rows form a *front*, a dense lower triangle:
//   [ F11      ]   columns of the supernode
//   [ F21  F22 ]   rows below
// A front sums the matrix entries of its columns and the updates of its children in the tree. Elimination
// leaves L11, L21 and the update U = F22 - L21 L21^T. The parent contains all rows of U. The tree is in
// postorder: the descendants of a front are the fronts just before it.
//
// Source: Duff and Reid 1983; Liu 1992, The multifrontal method for sparse matrix solution.
#pragma once

#include <Eigen/SparseCore>
#include <cstddef>
#include <span>
#include <vector>

struct cholmod_factor_struct;  // CHOLMOD's cholmod_factor

namespace palpate {

// Holds the lower triangle of a symmetric matrix.
using SparseLower = Eigen::SparseMatrix<double, Eigen::ColMajor, int>;

struct Front {
  int num_columns = 0;
  int num_rows = 0;  // includes the columns
  int first_column = 0;
  int parent = -1;         // -1: a root
  int first_within = 0;    // first front of the subtree; the subtree ends at the front itself
  int depth = 0;           // number of ancestors
  size_t panel_start = 0;  // offset of L11 and L21 in the entries of L, column-major with num_rows rows
  size_t rows_start = 0;   // offset in lists that hold the rows of every front, one front after the other
  size_t first_run = 0;    // index of the front's first run in FrontTree::runs_
  int num_runs = 0;
  double operations = 0;  // floating-point operations of the elimination

  int num_below() const { return num_rows - num_columns; }  // rows below the columns, which U couples
  size_t update_entries() const {  // U is stored as a square; its lower triangle is used
    return static_cast<size_t>(num_below()) * static_cast<size_t>(num_below());
  }
};

// Stays constant after construction.
class FrontTree {
 public:
  FrontTree() = default;
  // Converts CHOLMOD's supernodal analysis of `pattern`, which is in Eigen's compressed mode and in the order
  // of the equations before CHOLMOD's permutation. Throws std::runtime_error where the panel of a front,
  // num_rows x num_columns, has more than 2^31 - 1 entries.
  FrontTree(const SparseLower& pattern, const cholmod_factor_struct& symbolic);

  int size() const { return static_cast<int>(fronts_.size()); }
  const Front& operator[](int front) const { return fronts_[static_cast<size_t>(front)]; }
  std::span<const int> children(int front) const;

  // Maps consecutive rows below a front's columns to consecutive rows of its parent, which lie either among
  // the parent's columns or below them.
  struct Run {
    int row;  // first row of the run, counted from the first row below the columns
    int length;
    int place;  // first position in the parent
  };
  std::span<const Run> runs_in_parent(int front) const {
    const Front& at = (*this)[front];
    return {runs_.data() + at.first_run, static_cast<size_t>(at.num_runs)};
  }

  // Maps a stored entry of the matrix to the panel of its front.
  struct Entry {
    int source;  // position in the value array of the compressed pattern
    int target;  // position in the panel
  };
  std::span<const Entry> entries(int front) const;

  int num_entries() const { return static_cast<int>(entries_.size()); }
  const std::vector<int>& permutation() const { return permutation_; }  // column of L -> equation
  size_t panel_entries() const { return panel_entries_; }
  size_t total_rows() const {  // sum of num_rows
    return fronts_.empty() ? 0 : fronts_.back().rows_start + static_cast<size_t>(fronts_.back().num_rows);
  }

 private:
  void set_entries(const SparseLower& pattern, const int* row_indices, const std::vector<int>& front_of);
  void set_runs(const int* row_indices);

  std::vector<Front> fronts_;
  std::vector<int> children_;  // front after front
  std::vector<int> first_child_;
  std::vector<Run> runs_;
  std::vector<Entry> entries_;
  std::vector<int> first_entry_;
  std::vector<int> permutation_;
  size_t panel_entries_ = 0;
};

}  // namespace palpate
