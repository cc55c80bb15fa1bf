#include "offline/fem/multifrontal.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <utility>

#include "offline/fem/dense_kernels.hpp"
#include "offline/fem/front_elimination.hpp"
#include "offline/fem/parallel_for.hpp"

namespace palpate {
namespace {

// Adds `from` to `to` over a run's rows, without its first `first` rows.
template <typename Real>
void add_run(const FrontTree::Run& run, int first, const Real* from, Real* to) {
  from += run.row;
  to += run.place;
  for (int i = first; i < run.length; ++i) to[i] += from[i];
}

// A pivot below this fraction of its original diagonal entry is rounding of a zero.
template <typename Real>
constexpr Real kSmallestPivot = 64 * std::numeric_limits<Real>::epsilon();

// Returns a power of two near 1 / magnitude: a scale that is a power of two adds no rounding.
double inverse_power_of_two(double magnitude) {
  if (!(magnitude > 0) || !std::isfinite(magnitude)) return 1;
  return std::ldexp(1.0, -std::clamp(std::ilogb(magnitude), -1000, 1000));
}

}  // namespace

template <typename Real>
Multifrontal<Real>::Multifrontal(const FrontTree& tree, int threads) : tree_(&tree), threads_(threads) {
  divide();
  // Walks the elimination without arithmetic to find the largest memory of pending updates.
  std::array<size_t, 2> branch_room = {0, 0};
  updates_.resize(static_cast<size_t>(tree.size()));
  for (Branch& branch : branches_) {
    std::array<size_t, 2> top = {0, 0};
    for (int front = tree[branch.root].first_within; front <= branch.root; ++front)
      track_stacks(front, top, branch_room);
    branch.update = std::make_unique_for_overwrite<Real[]>(tree[branch.root].update_entries());
    updates_[static_cast<size_t>(branch.root)] = branch.update.get();
  }
  std::array<size_t, 2> trunk_room = {0, 0};
  std::array<size_t, 2> top = {0, 0};
  for (const int front : trunk_) track_stacks(front, top, trunk_room);

  int most_columns = 0;
  for (int front = 0; front < tree.size(); ++front)
    most_columns = std::max(most_columns, tree[front].num_columns);
  const auto reserve = [&](Workspace& workspace, const std::array<size_t, 2>& room) {
    for (size_t parity = 0; parity < 2; ++parity)
      workspace.stack[parity] = std::make_unique_for_overwrite<Real[]>(room[parity]);
    workspace.diagonal.resize(static_cast<size_t>(most_columns));
  };
  workers_.resize(std::min(static_cast<size_t>(threads_), branches_.size()));
  for (Workspace& worker : workers_) reserve(worker, branch_room);
  reserve(trunk_workspace_, trunk_room);
  panels_ = std::make_unique_for_overwrite<Real[]>(tree.panel_entries());
}

// Repeatedly splits the costliest branch into its children, and keeps the division of least estimated time.
template <typename Real>
void Multifrontal<Real>::divide() {
  const FrontTree& tree = *tree_;
  std::vector<double> cost(static_cast<size_t>(tree.size()));  // operations of the subtree
  std::vector<std::pair<double, int>> roots;
  for (int front = 0; front < tree.size(); ++front) {
    double& subtree_cost = cost[static_cast<size_t>(front)];
    subtree_cost += tree[front].operations;
    if (tree[front].parent >= 0) {
      cost[static_cast<size_t>(tree[front].parent)] += subtree_cost;
    } else {
      roots.emplace_back(subtree_cost, front);
    }
  }
  const auto time_of = [&](const std::vector<std::pair<double, int>>& sorted, double trunk_cost) {
    std::vector<double> busy(static_cast<size_t>(threads_), 0.0);
    for (const auto& [branch_cost, root] : sorted) *std::min_element(busy.begin(), busy.end()) += branch_cost;
    return trunk_cost + *std::max_element(busy.begin(), busy.end());
  };
  const auto costliest_first = [](const auto& a, const auto& b) {
    return a.first != b.first ? a.first > b.first : a.second < b.second;
  };
  std::sort(roots.begin(), roots.end(), costliest_first);
  std::vector<std::pair<double, int>> best = roots;
  double trunk_cost = 0;
  double best_time = time_of(roots, trunk_cost);
  const int max_splits = threads_ == 1 ? 0 : 16 * threads_;
  for (int split = 0; split < max_splits && !roots.empty(); ++split) {
    const int root = roots.front().second;
    if (tree.children(root).empty()) break;
    trunk_cost += is_wide(tree[root]) ? tree[root].operations / threads_ : tree[root].operations;
    roots.erase(roots.begin());
    for (const int child : tree.children(root)) roots.emplace_back(cost[static_cast<size_t>(child)], child);
    std::sort(roots.begin(), roots.end(), costliest_first);
    const double time = time_of(roots, trunk_cost);
    if (time < best_time) {
      best_time = time;
      best = roots;
    }
  }
  is_branch_root_.assign(static_cast<size_t>(tree.size()), 0);
  std::vector<char> in_branch(static_cast<size_t>(tree.size()), 0);
  for (const auto& [branch_cost, root] : best) {
    branches_.push_back({root, nullptr});
    is_branch_root_[static_cast<size_t>(root)] = 1;
    std::fill(in_branch.begin() + tree[root].first_within, in_branch.begin() + root + 1, 1);
  }
  for (int front = 0; front < tree.size(); ++front) {
    if (!in_branch[static_cast<size_t>(front)]) trunk_.push_back(front);
  }
}

// Tracks the two stacks (even and odd depth) of pending updates: a front pushes its update, then pops the
// updates of its children. `top` is the use of each stack in entries, `peak` the largest use so far.
template <typename Real>
void Multifrontal<Real>::track_stacks(int front, std::array<size_t, 2>& top,
                                      std::array<size_t, 2>& peak) const {
  const size_t parity = static_cast<size_t>((*tree_)[front].depth & 1);
  if (!is_branch_root_[static_cast<size_t>(front)]) top[parity] += (*tree_)[front].update_entries();
  peak[parity] = std::max(peak[parity], top[parity]);
  for (const int child : tree_->children(front)) {
    if (!is_branch_root_[static_cast<size_t>(child)]) top[1 - parity] -= (*tree_)[child].update_entries();
  }
}

template <typename Real>
bool Multifrontal<Real>::factorize(const double* values, Pivots pivots) {
  double largest = 0;
  for (int entry = 0; entry < tree_->num_entries(); ++entry) {
    if (!std::isfinite(values[entry])) return false;  // LAPACK may accept a NaN
    largest = std::max(largest, std::abs(values[entry]));
  }
  scale_ = inverse_power_of_two(largest);
  values_ = values;
  pivots_ = pivots;
  negative_.assign(tree_->permutation().size(), 0);
  std::atomic<bool> succeeded = true;
  parallel_for(threads_, static_cast<int>(branches_.size()), [&](int index, int worker) {
    const int root = branches_[static_cast<size_t>(index)].root;
    Workspace& workspace = workers_[static_cast<size_t>(worker)];
    workspace.top = {0, 0};
    for (int front = (*tree_)[root].first_within; front <= root && succeeded; ++front) {
      if (!eliminate(front, workspace, 1)) succeeded = false;
    }
  });
  trunk_workspace_.top = {0, 0};
  for (const int front : trunk_) {
    if (succeeded && !eliminate(front, trunk_workspace_, threads_)) succeeded = false;
  }
  return succeeded;
}

template <typename Real>
bool Multifrontal<Real>::eliminate(int index, Workspace& workspace, int threads) {
  const Front& front = (*tree_)[index];
  const int rows = front.num_rows;
  const int columns = front.num_columns;
  const size_t parity = static_cast<size_t>(front.depth & 1);
  Real* panel = panels_.get() + front.panel_start;
  const auto diagonal = [&](int column) { return panel[static_cast<ptrdiff_t>(column) * (rows + 1)]; };
  std::fill_n(panel, static_cast<size_t>(rows) * static_cast<size_t>(columns), Real(0));
  for (const FrontTree::Entry& entry : tree_->entries(index))
    panel[entry.target] = static_cast<Real>(scale_ * values_[entry.source]);
  for (int column = 0; column < columns; ++column)
    workspace.diagonal[static_cast<size_t>(column)] = diagonal(column);
  add_children(index, panel, nullptr, false);

  Real*& update = updates_[static_cast<size_t>(index)];
  if (!is_branch_root_[static_cast<size_t>(index)])
    update = workspace.stack[parity].get() + workspace.top[parity];
  char* negative = pivots_ == Pivots::positive ? nullptr : negative_.data() + front.first_column;
  if (!eliminate_columns(front, panel, update, negative, threads)) return false;
  for (int column = 0; column < columns; ++column) {
    const Real root_of_pivot = diagonal(column);  // L_jj
    const Real original = std::abs(workspace.diagonal[static_cast<size_t>(column)]);
    if (!(root_of_pivot * root_of_pivot > kSmallestPivot<Real> * original)) return false;
  }
  add_children(index, nullptr, update, true);
  std::array<size_t, 2> unused = {0, 0};
  track_stacks(index, workspace.top, unused);
  return true;
}

// Adds the children's updates to a front: to U in `update` if `to_update`, else to its columns in `panel`.
template <typename Real>
void Multifrontal<Real>::add_children(int index, Real* panel, Real* update, bool to_update) const {
  const Front& front = (*tree_)[index];
  for (const int c : tree_->children(index)) {
    const ptrdiff_t n = (*tree_)[c].num_below();
    const std::span<const FrontTree::Run> runs = tree_->runs_in_parent(c);
    for (auto columns = runs.begin(); columns != runs.end(); ++columns) {
      if (to_update != (columns->place >= front.num_columns)) continue;
      for (int j = 0; j < columns->length; ++j) {
        const ptrdiff_t place = columns->place + j;
        // Start of the front's rows in this column.
        Real* to = to_update ? update + (place - front.num_columns) * front.num_below() - front.num_columns
                             : panel + place * front.num_rows;
        const Real* from = updates_[static_cast<size_t>(c)] + (columns->row + j) * n;
        add_run(*columns, j, from, to);
        for (auto rows = columns + 1; rows != runs.end(); ++rows) add_run(*rows, 0, from, to);
      }
    }
  }
}

// w1 has the values at a front's columns, w2 the values at the rows below. w_c is the children's sum of w2.
// Forward: w1 = L11^-1 (b + w_c), w2 = w_c - L21 w1, which the parent adds.
template <typename Real>
void Multifrontal<Real>::forward(int index, const double* b, const std::vector<double>& scales) {
  const FrontTree& tree = *tree_;
  const int columns = static_cast<int>(scales.size());
  const Front& front = tree[index];
  const int rows = front.num_rows;
  Real* w = carried(front, scales.size());
  for (int column = 0; column < columns; ++column) {
    const double* values = b + static_cast<size_t>(column) * tree.permutation().size();
    Real* to = w + static_cast<size_t>(column) * static_cast<size_t>(rows);
    for (int row = 0; row < front.num_columns; ++row)
      to[row] = static_cast<Real>(values[tree.permutation()[static_cast<size_t>(front.first_column + row)]] *
                                  scales[static_cast<size_t>(column)]);
    std::fill_n(to + front.num_columns, front.num_below(), Real(0));
    for (const int c : tree.children(index)) {
      const Front& child = tree[c];
      const Real* from = carried(child, scales.size()) +
                         static_cast<size_t>(column) * static_cast<size_t>(child.num_rows) +
                         child.num_columns;
      for (const FrontTree::Run& run : tree.runs_in_parent(c)) add_run(run, 0, from, to);
    }
  }
  const Real* panel = panels_.get() + front.panel_start;
  solve_left(CblasNoTrans, front.num_columns, columns, panel, rows, w, rows);
  if (front.num_below() > 0)
    subtract_product(CblasNoTrans, front.num_below(), front.num_columns, columns, panel + front.num_columns,
                     rows, w, w + front.num_columns, rows);
}

// Backward: w2 = x of the parent, w1 = L11^-T (S w1 - L21^T w2) = x.
template <typename Real>
void Multifrontal<Real>::backward(int index, const std::vector<double>& scales, double* solutions) {
  const FrontTree& tree = *tree_;
  const int columns = static_cast<int>(scales.size());
  const Front& front = tree[index];
  const int rows = front.num_rows;
  Real* w = carried(front, scales.size());
  const Real* panel = panels_.get() + front.panel_start;
  for (int row = 0; row < front.num_columns; ++row) {
    if (!negative_[static_cast<size_t>(front.first_column + row)]) continue;
    for (int column = 0; column < columns; ++column) w[row + static_cast<ptrdiff_t>(column) * rows] *= -1;
  }
  if (front.num_below() > 0) {
    const Front& parent = tree[front.parent];
    for (int column = 0; column < columns; ++column) {
      const Real* from =
          carried(parent, scales.size()) + static_cast<size_t>(column) * static_cast<size_t>(parent.num_rows);
      Real* to = w + static_cast<size_t>(column) * static_cast<size_t>(rows) + front.num_columns;
      for (const FrontTree::Run& run : tree.runs_in_parent(index))
        std::copy_n(from + run.place, run.length, to + run.row);
    }
    subtract_product(CblasTrans, front.num_below(), front.num_columns, columns, panel + front.num_columns,
                     rows, w + front.num_columns, w, rows);
  }
  solve_left(CblasTrans, front.num_columns, columns, panel, rows, w, rows);
  for (int column = 0; column < columns; ++column) {
    double* x = solutions + static_cast<size_t>(column) * tree.permutation().size();
    const double back = scale_ / scales[static_cast<size_t>(column)];
    for (int row = 0; row < front.num_columns; ++row)
      x[tree.permutation()[static_cast<size_t>(front.first_column + row)]] =
          back * static_cast<double>(
                     w[static_cast<size_t>(column) * static_cast<size_t>(rows) + static_cast<size_t>(row)]);
  }
}

template <typename Real>
void Multifrontal<Real>::solve_block(double* right_hand_sides, int columns) {
  const FrontTree& tree = *tree_;
  const size_t n = tree.permutation().size();
  std::vector<double> scales(static_cast<size_t>(columns));
  for (int column = 0; column < columns; ++column) {
    const double* b = right_hand_sides + static_cast<size_t>(column) * n;
    double largest = 0;
    for (size_t i = 0; i < n; ++i) largest = std::max(largest, std::abs(b[i]));
    scales[static_cast<size_t>(column)] = inverse_power_of_two(largest);
  }
  carried_.resize(tree.total_rows() * static_cast<size_t>(columns));
  parallel_for(threads_, static_cast<int>(branches_.size()), [&](int branch, int) {
    const int root = branches_[static_cast<size_t>(branch)].root;
    for (int front = tree[root].first_within; front <= root; ++front)
      forward(front, right_hand_sides, scales);
  });
  for (const int front : trunk_) forward(front, right_hand_sides, scales);
  for (auto front = trunk_.rbegin(); front != trunk_.rend(); ++front)
    backward(*front, scales, right_hand_sides);
  parallel_for(threads_, static_cast<int>(branches_.size()), [&](int branch, int) {
    const int root = branches_[static_cast<size_t>(branch)].root;
    for (int front = root; front >= tree[root].first_within; --front)
      backward(front, scales, right_hand_sides);
  });
}

template <typename Real>
int Multifrontal<Real>::num_negative_pivots() const {
  return static_cast<int>(std::count(negative_.begin(), negative_.end(), char{1}));
}

template <typename Real>
void Multifrontal<Real>::solve(double* right_hand_sides, int columns) {
  constexpr int kColumns = 16;  // columns that share each read of the panels; more columns need more memory
  const size_t rows = tree_->permutation().size();
  for (int first = 0; first < columns; first += kColumns)
    solve_block(right_hand_sides + static_cast<size_t>(first) * rows, std::min(kColumns, columns - first));
}

template class Multifrontal<double>;
template class Multifrontal<float>;

}  // namespace palpate
