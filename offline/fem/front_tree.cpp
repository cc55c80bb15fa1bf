#include "offline/fem/front_tree.hpp"

#include <cholmod.h>

#include <algorithm>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <string>

namespace palpate {
namespace {

// Turns counts at 1 .. n, with 0 at place 0, into start offsets.
void counts_to_starts(std::vector<int>& counts) {
  std::partial_sum(counts.begin(), counts.end(), counts.begin());
}

// Sets `row_in_front` [rows of L] at each row of a front to the row's number in the front.
void number_rows(const Front& front, const int* row_indices, std::vector<int>& row_in_front) {
  for (int row = 0; row < front.num_rows; ++row)
    row_in_front[static_cast<size_t>(row_indices[front.rows_start + static_cast<size_t>(row)])] = row;
}

}  // namespace

FrontTree::FrontTree(const SparseLower& pattern, const cholmod_factor_struct& symbolic) {
  const int* first_columns = static_cast<const int*>(symbolic.super);
  const int* first_rows = static_cast<const int*>(symbolic.pi);
  const int* row_indices = static_cast<const int*>(symbolic.s);
  const int* permutation = static_cast<const int*>(symbolic.Perm);
  permutation_.assign(permutation, permutation + symbolic.n);
  std::vector<int> front_of(symbolic.n);  // column -> front
  fronts_.resize(symbolic.nsuper);
  for (size_t f = 0; f < symbolic.nsuper; ++f) {
    Front& front = fronts_[f];
    front.first_column = first_columns[f];
    front.num_columns = first_columns[f + 1] - first_columns[f];
    front.num_rows = first_rows[f + 1] - first_rows[f];
    front.rows_start = static_cast<size_t>(first_rows[f]);
    front.panel_start = panel_entries_;
    front.first_within = static_cast<int>(f);
    const size_t entries = static_cast<size_t>(front.num_rows) * static_cast<size_t>(front.num_columns);
    if (entries > static_cast<size_t>(std::numeric_limits<int>::max()))
      throw std::runtime_error("the factor of this model has a front of " + std::to_string(front.num_rows) +
                               " rows x " + std::to_string(front.num_columns) +
                               " columns, more than 2^31 - 1 entries; use a coarser mesh");
    panel_entries_ += entries;
    std::fill_n(front_of.begin() + front.first_column, front.num_columns, static_cast<int>(f));
    for (int column = 0; column < front.num_columns; ++column) {
      const double rows = front.num_rows - column;
      front.operations += rows * rows;
    }
  }

  first_child_.assign(fronts_.size() + 1, 0);
  for (size_t f = 0; f < fronts_.size(); ++f) {
    Front& front = fronts_[f];
    if (front.num_below() == 0) continue;
    // The parent is the supernode of the first row below the columns.
    front.parent =
        front_of[static_cast<size_t>(row_indices[front.rows_start + static_cast<size_t>(front.num_columns)])];
    Front& parent = fronts_[static_cast<size_t>(front.parent)];
    parent.first_within = std::min(parent.first_within, front.first_within);
    ++first_child_[static_cast<size_t>(front.parent) + 1];
  }
  counts_to_starts(first_child_);
  children_.resize(static_cast<size_t>(first_child_.back()));
  std::vector<int> next = first_child_;
  for (size_t f = 0; f < fronts_.size(); ++f) {
    const int parent = fronts_[f].parent;
    if (parent >= 0)
      children_[static_cast<size_t>(next[static_cast<size_t>(parent)]++)] = static_cast<int>(f);
  }
  // Parents follow children, so the reverse loop visits each parent first.
  for (size_t f = fronts_.size(); f-- > 0;) {
    const int parent = fronts_[f].parent;
    if (parent >= 0) fronts_[f].depth = fronts_[static_cast<size_t>(parent)].depth + 1;
  }
  set_entries(pattern, row_indices, front_of);
  set_runs(row_indices);
}

void FrontTree::set_entries(const SparseLower& pattern, const int* row_indices,
                            const std::vector<int>& front_of) {
  const size_t num_equations = permutation_.size();
  std::vector<int> column_of(num_equations);  // equation -> column of L
  for (size_t column = 0; column < num_equations; ++column)
    column_of[static_cast<size_t>(permutation_[column])] = static_cast<int>(column);

  struct PermutedEntry {
    int source, row, column;  // row and column of L, row >= column
  };
  const auto for_each_entry = [&](auto&& visit) {
    int source = 0;
    for (int equation = 0; equation < pattern.outerSize(); ++equation) {
      const int at = column_of[static_cast<size_t>(equation)];
      for (SparseLower::InnerIterator it(pattern, equation); it; ++it, ++source) {
        const auto [low, high] = std::minmax(at, column_of[static_cast<size_t>(it.row())]);
        visit(PermutedEntry{source, high, low}, static_cast<size_t>(front_of[static_cast<size_t>(low)]));
      }
    }
  };
  first_entry_.assign(fronts_.size() + 1, 0);
  for_each_entry([&](const PermutedEntry&, size_t front) { ++first_entry_[front + 1]; });
  counts_to_starts(first_entry_);
  std::vector<PermutedEntry> by_front(static_cast<size_t>(first_entry_.back()));
  std::vector<int> next = first_entry_;
  for_each_entry([&](const PermutedEntry& entry, size_t front) {
    by_front[static_cast<size_t>(next[front]++)] = entry;
  });

  entries_.resize(by_front.size());
  std::vector<int> row_in_front(num_equations);
  for (size_t f = 0; f < fronts_.size(); ++f) {
    const Front& front = fronts_[f];
    number_rows(front, row_indices, row_in_front);
    for (int e = first_entry_[f]; e < first_entry_[f + 1]; ++e) {
      const PermutedEntry& entry = by_front[static_cast<size_t>(e)];
      entries_[static_cast<size_t>(e)] = {entry.source,
                                          row_in_front[static_cast<size_t>(entry.row)] +
                                              (entry.column - front.first_column) * front.num_rows};
    }
  }
}

void FrontTree::set_runs(const int* row_indices) {
  std::vector<int> row_in_parent(permutation_.size());
  for (size_t f = 0; f < fronts_.size(); ++f) {
    const Front& parent = fronts_[f];
    number_rows(parent, row_indices, row_in_parent);
    for (const int c : children(static_cast<int>(f))) {
      Front& child = fronts_[static_cast<size_t>(c)];
      child.first_run = runs_.size();
      for (int row = 0; row < child.num_below(); ++row) {
        const size_t at = child.rows_start + static_cast<size_t>(child.num_columns + row);
        const int place = row_in_parent[static_cast<size_t>(row_indices[at])];
        const bool follows = row > 0 && place == runs_.back().place + runs_.back().length;
        // A run ends at the parent's last column, because the panel and the update are separate arrays.
        if (follows && place != parent.num_columns) {
          ++runs_.back().length;
        } else {
          runs_.push_back({row, 1, place});
        }
      }
      child.num_runs = static_cast<int>(runs_.size() - child.first_run);
    }
  }
}

std::span<const int> FrontTree::children(int front) const {
  const int* begin = children_.data() + first_child_[static_cast<size_t>(front)];
  return {begin, children_.data() + first_child_[static_cast<size_t>(front) + 1]};
}

std::span<const FrontTree::Entry> FrontTree::entries(int front) const {
  const Entry* begin = entries_.data() + first_entry_[static_cast<size_t>(front)];
  return {begin, entries_.data() + first_entry_[static_cast<size_t>(front) + 1]};
}

}  // namespace palpate
