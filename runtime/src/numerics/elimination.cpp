#include "runtime/src/numerics/elimination.hpp"

#include "runtime/src/numerics/elimination_block.hpp"

namespace palpate {
namespace {

constexpr uint32_t kColumns = kEliminationColumns;
template <typename Number>
constexpr uint32_t kRows = sizeof(Number) == sizeof(double) ? kEliminationRows : kFloatEliminationRows;

// Updates a block of columns from its diagonal down, by tiles of kRows<Number> rows: subtracts the products of all
// earlier columns. A solve with the block's own triangle follows.
template <typename Number>
struct ScalarTile {
  static constexpr uint32_t kTile = kRows<Number>;
  Number entries[kColumns][kTile];

  void subtract(const Number* matrix, uint32_t stride, uint32_t row, uint32_t first, uint32_t columns) {
    const Number* target = matrix + size_t{first} * stride + row;
    for (uint32_t c = 0; c < kColumns; ++c) {
      for (uint32_t r = 0; r < kTile; ++r) entries[c][r] = target[c * stride + r];
    }
    for (uint32_t k = 0; k < columns; ++k) {
      const Number* column = matrix + size_t{k} * stride;
      for (uint32_t c = 0; c < kColumns; ++c) {
        for (uint32_t r = 0; r < kTile; ++r) entries[c][r] -= column[row + r] * column[first + c];
      }
    }
  }
  void solve(const DiagonalBlock<Number>& block) {
    for (uint32_t c = 0; c < kColumns; ++c) {
      for (uint32_t r = 0; r < kTile; ++r) {
        for (uint32_t k = 0; k < c; ++k) entries[c][r] -= entries[k][r] * block.below[c][k];
        entries[c][r] *= block.inverse[c];
      }
    }
  }
  void store(Number* target, uint32_t stride) const {
    for (uint32_t c = 0; c < kColumns; ++c) {
      for (uint32_t r = 0; r < kTile; ++r) target[c * stride + r] = entries[c][r];
    }
  }
};

template <typename Number>
bool eliminate_columns_scalar(Number* matrix, uint32_t stride, uint32_t size, uint32_t eliminated,
                              uint32_t first) {
  const bool inside = first < eliminated;
  const uint32_t columns = inside ? first : eliminated;
  constexpr uint32_t kTile = kRows<Number>;
  DiagonalBlock<Number> block = {};
  ScalarTile<Number> tile;
  for (uint32_t row = first / kTile * kTile; row < size; row += kTile) {
    Number* target = matrix + size_t{first} * stride + row;
    tile.subtract(matrix, stride, row, first, columns);
    if (inside && row <= first) {
      tile.store(target, stride);
      if (!factor_block(matrix + size_t{first} * stride + first, stride, block)) return false;
    }
    if (inside) tile.solve(block);
    tile.store(target, stride);
  }
  return true;
}

template <typename Number>
void back_substitute_scalar(const Number* matrix, uint32_t stride, uint32_t size, double* vector) {
  for (uint32_t j = size; j-- > 0;) {
    const Number* column = matrix + size_t{j} * stride;
    const double inverse = 1.0 / static_cast<double>(column[j]);
    double sum = vector[j];
    for (uint32_t i = j + 1; i < size; ++i) sum -= static_cast<double>(column[i]) * vector[i];
    vector[j] = sum * inverse;
  }
}

void back_substitute_rows(const double* matrix, uint32_t stride, uint32_t size, double* rows,
                          size_t row_stride, uint32_t count) {
  for (uint32_t t = 0; t < count; ++t) back_substitute_scalar(matrix, stride, size, rows + t * row_stride);
}

template <typename Number>
void forward_substitute_scalar(const Number* matrix, uint32_t stride, uint32_t size, double* vector) {
  for (uint32_t first = 0; first < size; first += kColumns) {
    const Number* columns = matrix + size_t{first} * stride;
    solve_triangle(columns + first, stride, vector + first);
    for (uint32_t c = 0; c < kColumns; ++c) {
      for (uint32_t i = first + kColumns; i < size; ++i)
        vector[i] -= static_cast<double>(columns[c * stride + i]) * vector[first + c];
    }
  }
}

template <typename Number>
void add_product_scalar(const Number* matrix, uint32_t stride, uint32_t rows, uint32_t columns,
                        const double* x, double* y) {
  for (uint32_t j = 0; j < columns; ++j) {
    const Number* column = matrix + size_t{j} * stride;
    for (uint32_t i = 0; i < rows; ++i) y[i] += static_cast<double>(column[i]) * x[j];
  }
}

void add_transposed_product_scalar(const float* matrix, uint32_t stride, uint32_t rows, uint32_t columns,
                                   const double* x, double* y) {
  for (uint32_t j = 0; j < columns; ++j) {
    const float* column = matrix + size_t{j} * stride;
    double sum = 0;
    for (uint32_t i = 0; i < rows; ++i) sum += static_cast<double>(column[i]) * x[i];
    y[j] += sum;
  }
}

void add_symmetric_product_scalar(const double* matrix, uint32_t size, const double* x, double* y) {
  for (uint32_t j = 0; j < size; ++j) {
    const double* column = matrix + size_t{j} * size;
    double sum = column[j] * x[j];
    for (uint32_t i = j + 1; i < size; ++i) {
      y[i] += column[i] * x[j];
      sum += column[i] * x[i];
    }
    y[j] += sum;
  }
}

}  // namespace

uint32_t list_elimination_kernels(EliminationKernel kernels[kMostEliminationKernels]) {
  uint32_t count = 0;
  kernels[count++] = {"scalar",
                      eliminate_columns_scalar<double>,
                      eliminate_columns_scalar<float>,
                      back_substitute_rows,
                      forward_substitute_scalar<double>,
                      back_substitute_scalar<float>,
                      forward_substitute_scalar<float>,
                      add_product_scalar<double>,
                      add_product_scalar<float>,
                      add_transposed_product_scalar,
                      add_symmetric_product_scalar};
#ifdef PALPATE_X86
  __builtin_cpu_init();
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"))
    kernels[count++] = avx2_elimination_kernel();
#endif
  return count;
}

EliminationKernel choose_elimination_kernel() {
  EliminationKernel kernels[kMostEliminationKernels];
  const uint32_t count = list_elimination_kernels(kernels);
  return kernels[count - 1];
}

template <typename Number>
void drop_unknown(uint32_t unknown, uint32_t size, uint32_t stride, Number* matrix) {
  for (uint32_t column = 0; column < unknown; ++column) matrix[size_t{column} * stride + unknown] = 0;
  for (uint32_t row = unknown; row < size; ++row) matrix[size_t{unknown} * stride + row] = 0;
  matrix[size_t{unknown} * stride + unknown] = 1;
}

template void drop_unknown(uint32_t, uint32_t, uint32_t, double*);
template void drop_unknown(uint32_t, uint32_t, uint32_t, float*);

bool eliminate(const EliminationKernel& kernel, double* matrix, uint32_t stride, uint32_t size,
               uint32_t eliminated) {
  for (uint32_t first = 0; first < size; first += kEliminationColumns) {
    if (!kernel.eliminate_columns(matrix, stride, size, eliminated, first)) return false;
  }
  return true;
}

}  // namespace palpate
