#include "offline/fem/front_elimination.hpp"

#include <algorithm>
#include <cmath>

#include "offline/fem/dense_kernels.hpp"
#include "offline/fem/parallel_for.hpp"

namespace palpate {
namespace {

// Fronts with more operations are cut into blocks of kBlock rows or columns. The threads share the blocks of
// a front in the trunk (multifrontal.hpp).
constexpr double kWideOperations = 2e8;
constexpr int kBlock = 256;
// Plain loops factor this number of pivots of either sign before BLAS updates the remaining columns.
constexpr int kSignedBlock = 32;

// Factors a dense lower triangle A = L S L^T in place, column by column; negative[j] tells whether S_j = -1.
// Returns false at a pivot that is 0 or not finite.
template <typename Real>
bool factor_with_signs(int n, Real* a, int stride, char* negative) {
  for (int j = 0; j < n; ++j) {
    Real* column = a + static_cast<ptrdiff_t>(j) * stride;
    for (int k = 0; k < j; ++k) {
      const Real* l = a + static_cast<ptrdiff_t>(k) * stride;
      const Real factor = negative[k] ? l[j] : -l[j];
      for (int i = j; i < n; ++i) column[i] += factor * l[i];
    }
    const Real pivot = column[j];
    if (!std::isfinite(pivot) || pivot == 0) return false;
    negative[j] = pivot < 0;
    column[j] = std::sqrt(std::abs(pivot));
    const Real scale = (negative[j] ? Real(-1) : Real(1)) / column[j];
    for (int i = j + 1; i < n; ++i) column[i] *= scale;
  }
  return true;
}

}  // namespace

bool is_wide(const Front& front) {
  return front.operations > kWideOperations;
}

template <typename Real>
bool eliminate_columns(const Front& front, Real* panel, Real* update, char* negative, int threads) {
  const int rows = front.num_rows;
  const int columns = front.num_columns;
  const bool wide = is_wide(front);
  const auto at = [rows](Real* entries, int row, int column) {
    return entries + row + static_cast<ptrdiff_t>(column) * rows;
  };
  const auto for_each_block = [&](int begin, int end, auto&& work) {  // work(first, count)
    const int block = wide ? kBlock : std::max(1, end - begin);
    parallel_for(wide ? threads : 1, (end - begin + block - 1) / block, [&](int index, int) {
      const int first = begin + index * block;
      work(first, std::min(block, end - first));
    });
  };
  // C := beta C - A S A^T over pivots `begin` to `end`. C is a lower triangle of `size` rows; A is the panel
  // from `row` on. All pivots are subtracted; the few negative pivots are then added twice.
  const auto subtract = [&](int begin, int end, int row, int size, int count, Real beta, Real* c,
                            int stride) {
    add_square(size, count, end - begin, Real(-1), at(panel, row, begin), rows, beta, c, stride);
    for (int pivot = begin; negative != nullptr && pivot < end; ++pivot) {
      if (negative[pivot])
        add_square(size, count, 1, Real(2), at(panel, row, pivot), rows, Real(1), c, stride);
    }
  };
  const int width = negative != nullptr ? kSignedBlock : wide ? kBlock : columns;
  for (int first = 0; first < columns; first += width) {
    const int next = std::min(first + width, columns);
    Real* corner = at(panel, first, first);
    if (negative == nullptr ? !factor_in_place(next - first, corner, rows)
                            : !factor_with_signs(next - first, corner, rows, negative + first))
      return false;
    for_each_block(next, rows, [&](int row, int count) {
      solve_right(count, next - first, corner, at(panel, row, first), rows);
      for (int pivot = first; negative != nullptr && pivot < next; ++pivot) {
        if (!negative[pivot]) continue;
        Real* below = at(panel, row, pivot);
        for (int i = 0; i < count; ++i) below[i] = -below[i];
      }
    });
    for_each_block(next, columns, [&](int column, int count) {
      subtract(first, next, column, rows - column, count, Real(1), at(panel, column, column), rows);
    });
  }
  const int updated = front.num_below();
  for_each_block(0, updated, [&](int column, int count) {
    subtract(0, columns, columns + column, updated - column, count, Real(0),
             update + column + static_cast<ptrdiff_t>(column) * updated, updated);
  });
  return true;
}

template bool eliminate_columns(const Front&, double*, double*, char*, int);
template bool eliminate_columns(const Front&, float*, float*, char*, int);

}  // namespace palpate
