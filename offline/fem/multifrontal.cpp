#include "offline/fem/multifrontal.hpp"

#include <cblas.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <thread>
#include <utility>

// LAPACK's, which OpenBLAS carries: Cholesky factor of a dense matrix in place.
extern "C" {
void dpotrf_(const char* triangle, const int* n, double* a, const int* stride, int* info);
void spotrf_(const char* triangle, const int* n, float* a, const int* stride, int* info);
}

namespace palpate {
namespace {

// The dense kernels, on column-major lower triangles.

bool factor_in_place(int n, double* a, int stride) {
  int info = 0;
  dpotrf_("L", &n, a, &stride, &info);
  return info == 0;
}
bool factor_in_place(int n, float* a, int stride) {
  int info = 0;
  spotrf_("L", &n, a, &stride, &info);
  return info == 0;
}

// B := B L^-T
void solve_right(int rows, int n, const double* l, double* b, int stride) {
  cblas_dtrsm(CblasColMajor, CblasRight, CblasLower, CblasTrans, CblasNonUnit, rows, n, 1.0, l, stride, b,
              stride);
}
void solve_right(int rows, int n, const float* l, float* b, int stride) {
  cblas_strsm(CblasColMajor, CblasRight, CblasLower, CblasTrans, CblasNonUnit, rows, n, 1.0F, l, stride, b,
              stride);
}

// C := beta C - A A^T over the first `columns` columns of the lower triangle of C, which has as many rows as
// A.
void subtract_square(int rows, int columns, int inner, const double* a, int stride, double beta, double* c,
                     int c_stride) {
  cblas_dsyrk(CblasColMajor, CblasLower, CblasNoTrans, columns, inner, -1.0, a, stride, beta, c, c_stride);
  if (rows > columns)
    cblas_dgemm(CblasColMajor, CblasNoTrans, CblasTrans, rows - columns, columns, inner, -1.0, a + columns,
                stride, a, stride, beta, c + columns, c_stride);
}
void subtract_square(int rows, int columns, int inner, const float* a, int stride, float beta, float* c,
                     int c_stride) {
  cblas_ssyrk(CblasColMajor, CblasLower, CblasNoTrans, columns, inner, -1.0F, a, stride, beta, c, c_stride);
  if (rows > columns)
    cblas_sgemm(CblasColMajor, CblasNoTrans, CblasTrans, rows - columns, columns, inner, -1.0F, a + columns,
                stride, a, stride, beta, c + columns, c_stride);
}

// X := L^-1 X, or L^-T X
void solve_left(CBLAS_TRANSPOSE transpose, int n, int columns, const double* l, int stride, double* x,
                int x_stride) {
  if (columns == 1) {
    cblas_dtrsv(CblasColMajor, CblasLower, transpose, CblasNonUnit, n, l, stride, x, 1);
  } else {
    cblas_dtrsm(CblasColMajor, CblasLeft, CblasLower, transpose, CblasNonUnit, n, columns, 1.0, l, stride, x,
                x_stride);
  }
}
void solve_left(CBLAS_TRANSPOSE transpose, int n, int columns, const float* l, int stride, float* x,
                int x_stride) {
  if (columns == 1) {
    cblas_strsv(CblasColMajor, CblasLower, transpose, CblasNonUnit, n, l, stride, x, 1);
  } else {
    cblas_strsm(CblasColMajor, CblasLeft, CblasLower, transpose, CblasNonUnit, n, columns, 1.0F, l, stride, x,
                x_stride);
  }
}

// Y := Y - A X, or Y - A^T X, with A of (rows, inner); X and Y share their stride.
void subtract_product(CBLAS_TRANSPOSE transpose, int rows, int inner, int columns, const double* a,
                      int a_stride, const double* x, double* y, int stride) {
  if (columns == 1) {
    cblas_dgemv(CblasColMajor, transpose, rows, inner, -1.0, a, a_stride, x, 1, 1.0, y, 1);
  } else {
    const bool plain = transpose == CblasNoTrans;
    cblas_dgemm(CblasColMajor, transpose, CblasNoTrans, plain ? rows : inner, columns, plain ? inner : rows,
                -1.0, a, a_stride, x, stride, 1.0, y, stride);
  }
}
void subtract_product(CBLAS_TRANSPOSE transpose, int rows, int inner, int columns, const float* a,
                      int a_stride, const float* x, float* y, int stride) {
  if (columns == 1) {
    cblas_sgemv(CblasColMajor, transpose, rows, inner, -1.0F, a, a_stride, x, 1, 1.0F, y, 1);
  } else {
    const bool plain = transpose == CblasNoTrans;
    cblas_sgemm(CblasColMajor, transpose, CblasNoTrans, plain ? rows : inner, columns, plain ? inner : rows,
                -1.0F, a, a_stride, x, stride, 1.0F, y, stride);
  }
}

// Calls work(0) ... work(count - 1), each once, on so many threads.
template <typename Work>
void parallel_for(int threads, int count, Work&& work) {
  std::atomic<int> next = 0;
  const auto run = [&] {
    for (int index = next++; index < count; index = next++) work(index);
  };
  std::vector<std::jthread> others;
  for (int thread = 1; thread < std::min(threads, count); ++thread) others.emplace_back(run);
  run();
}

// A front of more operations is cut into blocks of so many rows or columns, which the trunk's fronts share
// out.
constexpr double kWideOperations = 2e8;
constexpr int kBlock = 256;

bool is_wide(const Front& front) {
  return front.operations > kWideOperations;
}

// Eliminates the columns of a front: L11 and L21 in place of F11 and F21, and `update` = - L21 L21^T. The
// cuts follow from its size alone, and so do its bits. False where a pivot is not positive.
template <typename Real>
bool eliminate_columns(const Front& front, Real* panel, Real* update, int threads) {
  const int rows = front.num_rows;
  const int columns = front.num_columns;
  const bool wide = is_wide(front);
  const auto at = [rows](Real* entries, int row, int column) {
    return entries + row + static_cast<ptrdiff_t>(column) * rows;
  };
  const auto for_each_block = [&](int begin, int end, auto&& work) {
    const int block = wide ? kBlock : std::max(1, end - begin);
    parallel_for(wide ? threads : 1, (end - begin + block - 1) / block, [&](int index) {
      const int first = begin + index * block;
      work(first, std::min(block, end - first));
    });
  };
  const int width = wide ? kBlock : columns;
  for (int first = 0; first < columns; first += width) {
    const int next = std::min(first + width, columns);
    if (!factor_in_place(next - first, at(panel, first, first), rows)) return false;
    for_each_block(next, rows, [&](int row, int count) {
      solve_right(count, next - first, at(panel, first, first), at(panel, row, first), rows);
    });
    for_each_block(next, columns, [&](int column, int count) {
      subtract_square(rows - column, count, next - first, at(panel, column, first), rows, Real(1),
                      at(panel, column, column), rows);
    });
  }
  const int updated = front.num_updated();
  for_each_block(0, updated, [&](int column, int count) {
    subtract_square(updated - column, count, columns, at(panel, columns + column, 0), rows, Real(0),
                    update + column + static_cast<ptrdiff_t>(column) * updated, updated);
  });
  return true;
}

// A pivot below this part of the diagonal entry that it was is what rounding left of a zero.
template <typename Real>
constexpr Real kSmallestPivot = 64 * std::numeric_limits<Real>::epsilon();

// A power of two near 1 / magnitude, which changes no digit.
double inverse_power_of_two(double magnitude) {
  if (!(magnitude > 0) || !std::isfinite(magnitude)) return 1;
  return std::ldexp(1.0, -std::clamp(std::ilogb(magnitude), -1000, 1000));
}

}  // namespace

template <typename Real>
Multifrontal<Real>::Multifrontal(const FrontTree& tree, int threads) : tree_(&tree), threads_(threads) {
  divide(threads);
  std::vector<int> fronts;
  for (Branch& branch : branches_) {
    fronts.clear();
    for (int front = tree[branch.root].first_within; front <= branch.root; ++front) fronts.push_back(front);
    reserve(branch.stacks, fronts);
  }
  reserve(trunk_stacks_, trunk_);
  panels_ = std::make_unique_for_overwrite<Real[]>(tree.panel_entries());
  updates_.resize(static_cast<size_t>(tree.size()));
}

// Splits the costliest branch into its children while that makes the whole sooner done.
template <typename Real>
void Multifrontal<Real>::divide(int threads) {
  const FrontTree& tree = *tree_;
  std::vector<double> cost(static_cast<size_t>(tree.size()));  // of the subtree
  std::vector<std::pair<double, int>> roots;
  for (int front = 0; front < tree.size(); ++front) {
    double& mine = cost[static_cast<size_t>(front)];
    mine += tree[front].operations;
    if (tree[front].parent >= 0) {
      cost[static_cast<size_t>(tree[front].parent)] += mine;
    } else {
      roots.emplace_back(mine, front);
    }
  }
  const auto time_of = [&](const std::vector<std::pair<double, int>>& sorted, double trunk) {
    std::vector<double> busy(static_cast<size_t>(threads), 0.0);
    for (const auto& [branch_cost, root] : sorted) *std::min_element(busy.begin(), busy.end()) += branch_cost;
    return trunk + *std::max_element(busy.begin(), busy.end());
  };
  const auto costliest_first = [](const auto& a, const auto& b) {
    return a.first != b.first ? a.first > b.first : a.second < b.second;
  };
  std::sort(roots.begin(), roots.end(), costliest_first);
  std::vector<std::pair<double, int>> best = roots;
  double trunk = 0;
  double best_time = time_of(roots, trunk);
  const int splits = threads == 1 ? 0 : 16 * threads;
  for (int split = 0; split < splits && !roots.empty(); ++split) {
    const int root = roots.front().second;
    if (tree.children(root).empty()) break;
    trunk += is_wide(tree[root]) ? tree[root].operations / threads : tree[root].operations;
    roots.erase(roots.begin());
    for (const int child : tree.children(root)) roots.emplace_back(cost[static_cast<size_t>(child)], child);
    std::sort(roots.begin(), roots.end(), costliest_first);
    const double time = time_of(roots, trunk);
    if (time < best_time) {
      best_time = time;
      best = roots;
    }
  }
  std::vector<char> in_branch(static_cast<size_t>(tree.size()), 0);
  for (const auto& [branch_cost, root] : best) {
    branches_.push_back({root, {}});
    std::fill(in_branch.begin() + tree[root].first_within, in_branch.begin() + root + 1, 1);
  }
  for (int front = 0; front < tree.size(); ++front) {
    if (!in_branch[static_cast<size_t>(front)]) trunk_.push_back(front);
  }
}

// Room for the most that waits at any time, found by going through the elimination without doing it.
template <typename Real>
void Multifrontal<Real>::reserve(Stacks& stacks, const std::vector<int>& fronts) const {
  size_t most[2] = {0, 0};
  size_t top[2] = {0, 0};
  std::vector<char> mine(static_cast<size_t>(tree_->size()), 0);
  for (const int front : fronts) {
    const int parity = (*tree_)[front].depth & 1;
    top[parity] += (*tree_)[front].update_entries();
    most[parity] = std::max(most[parity], top[parity]);
    for (const int child : tree_->children(front)) {
      if (mine[static_cast<size_t>(child)]) top[1 - parity] -= (*tree_)[child].update_entries();
    }
    mine[static_cast<size_t>(front)] = 1;
  }
  for (int parity = 0; parity < 2; ++parity)
    stacks.entries[parity] = std::make_unique_for_overwrite<Real[]>(most[parity]);
}

template <typename Real>
template <typename Work>
void Multifrontal<Real>::for_each_branch(Work&& work) {
  parallel_for(threads_, static_cast<int>(branches_.size()),
               [&](int branch) { work(branches_[static_cast<size_t>(branch)]); });
}

template <typename Real>
bool Multifrontal<Real>::factorize(const double* values) {
  double largest = 0;
  for (int entry = 0; entry < tree_->num_entries(); ++entry) {
    if (!std::isfinite(values[entry])) return false;  // LAPACK may let it pass
    largest = std::max(largest, std::abs(values[entry]));
  }
  scale_ = inverse_power_of_two(largest);
  values_ = values;
  std::atomic<bool> definite = true;
  for_each_branch([&](Branch& branch) {
    branch.stacks.top[0] = branch.stacks.top[1] = 0;
    for (int front = (*tree_)[branch.root].first_within; front <= branch.root && definite; ++front) {
      if (!eliminate(front, branch.stacks)) definite = false;
    }
  });
  trunk_stacks_.top[0] = trunk_stacks_.top[1] = 0;
  for (const int front : trunk_) {
    if (definite && !eliminate(front, trunk_stacks_)) definite = false;
  }
  return definite;
}

template <typename Real>
bool Multifrontal<Real>::eliminate(int index, Stacks& stacks) {
  const Front& front = (*tree_)[index];
  const int rows = front.num_rows;
  const int columns = front.num_columns;
  const int parity = front.depth & 1;
  Real* panel = panels_.get() + front.panel;
  std::fill_n(panel, static_cast<size_t>(rows) * static_cast<size_t>(columns), Real(0));
  for (const FrontTree::Entry& entry : tree_->entries(index))
    panel[entry.target] = static_cast<Real>(scale_ * values_[entry.source]);
  std::vector<Real> diagonal(static_cast<size_t>(columns));
  for (int column = 0; column < columns; ++column)
    diagonal[static_cast<size_t>(column)] = panel[static_cast<ptrdiff_t>(column) * (rows + 1)];
  add_children(index, panel, nullptr, false);
  Real* update = stacks.entries[parity].get() + stacks.top[parity];
  if (!eliminate_columns(front, panel, update, &stacks == &trunk_stacks_ ? threads_ : 1)) return false;
  for (int column = 0; column < columns; ++column) {
    const Real root = panel[static_cast<ptrdiff_t>(column) * (rows + 1)];
    if (!(root * root > kSmallestPivot<Real> * diagonal[static_cast<size_t>(column)])) return false;
  }
  add_children(index, nullptr, update, true);
  updates_[static_cast<size_t>(index)] = update;
  stacks.top[parity] += front.update_entries();
  // Drops the children's, which end at the top of the other stack, where they are on it at all.
  for (const int child : tree_->children(index)) {
    Real* begin = stacks.entries[1 - parity].get();
    Real* waiting = updates_[static_cast<size_t>(child)];
    if (waiting >= begin && waiting < begin + stacks.top[1 - parity]) {
      stacks.top[1 - parity] = static_cast<size_t>(waiting - begin);
      break;
    }
  }
  return true;
}

// Adds the children's updates to the front: what falls in its columns to `panel`, or what lies above to
// `update`.
template <typename Real>
void Multifrontal<Real>::add_children(int index, Real* panel, Real* update, bool above) const {
  const Front& front = (*tree_)[index];
  for (const int c : tree_->children(index)) {
    const Front& child = (*tree_)[c];
    const int n = child.num_updated();
    const int* place = tree_->rows_in_parent(c);
    const int in_columns = static_cast<int>(std::lower_bound(place, place + n, front.num_columns) - place);
    const Real* from = updates_[static_cast<size_t>(c)];
    for (int j = above ? in_columns : 0; j < (above ? n : in_columns); ++j) {
      const Real* column = from + static_cast<size_t>(j) * static_cast<size_t>(n);
      Real* to = above ? update +
                             static_cast<size_t>(place[j] - front.num_columns) *
                                 static_cast<size_t>(front.num_updated()) -
                             front.num_columns
                       : panel + static_cast<size_t>(place[j]) * static_cast<size_t>(front.num_rows);
      for (int i = j; i < n; ++i) to[place[i]] += column[i];
    }
  }
}

// With w a front's rows: forward, w1 = L11^-1 (b + what the children carry), w2 = what they carry - L21 w1
// goes to the parent; back, w2 = the parent's x, w1 = L11^-T (w1 - L21^T w2) = x.
template <typename Real>
void Multifrontal<Real>::solve(double* right_hand_sides, int columns) {
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
  const auto carried = [&](const Front& front) {
    return carried_.data() + front.rows * static_cast<size_t>(columns);
  };
  const auto forward = [&](int index) {
    const Front& front = tree[index];
    const int rows = front.num_rows;
    Real* w = carried(front);
    for (int column = 0; column < columns; ++column) {
      const double* b = right_hand_sides + static_cast<size_t>(column) * n;
      Real* to = w + static_cast<size_t>(column) * static_cast<size_t>(rows);
      for (int row = 0; row < front.num_columns; ++row)
        to[row] = static_cast<Real>(b[tree.permutation()[static_cast<size_t>(front.first_column + row)]] *
                                    scales[static_cast<size_t>(column)]);
      std::fill_n(to + front.num_columns, front.num_updated(), Real(0));
      for (const int c : tree.children(index)) {
        const Front& child = tree[c];
        const int* place = tree.rows_in_parent(c);
        const Real* from = carried(child) +
                           static_cast<size_t>(column) * static_cast<size_t>(child.num_rows) +
                           child.num_columns;
        for (int row = 0; row < child.num_updated(); ++row) to[place[row]] += from[row];
      }
    }
    const Real* panel = panels_.get() + front.panel;
    solve_left(CblasNoTrans, front.num_columns, columns, panel, rows, w, rows);
    if (front.num_updated() > 0)
      subtract_product(CblasNoTrans, front.num_updated(), front.num_columns, columns,
                       panel + front.num_columns, rows, w, w + front.num_columns, rows);
  };
  const auto backward = [&](int index) {
    const Front& front = tree[index];
    const int rows = front.num_rows;
    Real* w = carried(front);
    const Real* panel = panels_.get() + front.panel;
    if (front.num_updated() > 0) {
      const Front& parent = tree[front.parent];
      const int* place = tree.rows_in_parent(index);
      for (int column = 0; column < columns; ++column) {
        const Real* from =
            carried(parent) + static_cast<size_t>(column) * static_cast<size_t>(parent.num_rows);
        Real* to = w + static_cast<size_t>(column) * static_cast<size_t>(rows) + front.num_columns;
        for (int row = 0; row < front.num_updated(); ++row) to[row] = from[place[row]];
      }
      subtract_product(CblasTrans, front.num_updated(), front.num_columns, columns, panel + front.num_columns,
                       rows, w + front.num_columns, w, rows);
    }
    solve_left(CblasTrans, front.num_columns, columns, panel, rows, w, rows);
    for (int column = 0; column < columns; ++column) {
      double* x = right_hand_sides + static_cast<size_t>(column) * n;
      const double back = scale_ / scales[static_cast<size_t>(column)];
      for (int row = 0; row < front.num_columns; ++row)
        x[tree.permutation()[static_cast<size_t>(front.first_column + row)]] =
            back * static_cast<double>(
                       w[static_cast<size_t>(column) * static_cast<size_t>(rows) + static_cast<size_t>(row)]);
    }
  };
  for_each_branch([&](Branch& branch) {
    for (int front = tree[branch.root].first_within; front <= branch.root; ++front) forward(front);
  });
  for (const int front : trunk_) forward(front);
  for (auto front = trunk_.rbegin(); front != trunk_.rend(); ++front) backward(*front);
  for_each_branch([&](Branch& branch) {
    for (int front = branch.root; front >= tree[branch.root].first_within; --front) backward(front);
  });
}

template class Multifrontal<double>;
template class Multifrontal<float>;

}  // namespace palpate
