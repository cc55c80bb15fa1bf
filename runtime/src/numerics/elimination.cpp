#include "runtime/src/numerics/elimination.hpp"

#include "runtime/src/numerics/elimination_block.hpp"

namespace palpate {
namespace {

constexpr uint32_t kRows = kEliminationRows;
constexpr uint32_t kColumns = kEliminationColumns;

// Updates a block of columns from its diagonal down, by tiles of kRows rows: subtracts the products of all
// earlier columns. A solve with the block's own triangle follows.
struct ScalarTile {
  double entries[kColumns][kRows];

  void subtract(const double* matrix, uint32_t stride, uint32_t row, uint32_t first, uint32_t columns) {
    const double* target = matrix + size_t{first} * stride + row;
    for (uint32_t c = 0; c < kColumns; ++c) {
      for (uint32_t r = 0; r < kRows; ++r) entries[c][r] = target[c * stride + r];
    }
    for (uint32_t k = 0; k < columns; ++k) {
      const double* column = matrix + size_t{k} * stride;
      for (uint32_t c = 0; c < kColumns; ++c) {
        for (uint32_t r = 0; r < kRows; ++r) entries[c][r] -= column[row + r] * column[first + c];
      }
    }
  }
  void solve(const DiagonalBlock& block) {
    for (uint32_t c = 0; c < kColumns; ++c) {
      for (uint32_t r = 0; r < kRows; ++r) {
        for (uint32_t k = 0; k < c; ++k) entries[c][r] -= entries[k][r] * block.below[c][k];
        entries[c][r] *= block.inverse[c];
      }
    }
  }
  void store(double* target, uint32_t stride) const {
    for (uint32_t c = 0; c < kColumns; ++c) {
      for (uint32_t r = 0; r < kRows; ++r) target[c * stride + r] = entries[c][r];
    }
  }
};

bool eliminate_columns_scalar(double* matrix, uint32_t stride, uint32_t size, uint32_t eliminated,
                              uint32_t first) {
  const bool inside = first < eliminated;
  const uint32_t columns = inside ? first : eliminated;
  DiagonalBlock block;
  ScalarTile tile;
  for (uint32_t row = first / kRows * kRows; row < size; row += kRows) {
    double* target = matrix + size_t{first} * stride + row;
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

void back_substitute_scalar(const double* matrix, uint32_t stride, uint32_t size, double* rows,
                            size_t row_stride, uint32_t count) {
  for (uint32_t j = size; j-- > 0;) {
    const double* column = matrix + size_t{j} * stride;
    const double inverse = 1.0 / column[j];
    for (uint32_t t = 0; t < count; ++t) {
      double* row = rows + t * row_stride;
      double sum = row[j];
      for (uint32_t i = j + 1; i < size; ++i) sum -= column[i] * row[i];
      row[j] = sum * inverse;
    }
  }
}

void forward_substitute_scalar(const double* matrix, uint32_t stride, uint32_t size, double* vector) {
  for (uint32_t first = 0; first < size; first += kColumns) {
    const double* columns = matrix + size_t{first} * stride;
    solve_triangle(columns + first, stride, vector + first);
    for (uint32_t c = 0; c < kColumns; ++c) {
      for (uint32_t i = first + kColumns; i < size; ++i)
        vector[i] -= columns[c * stride + i] * vector[first + c];
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
                      eliminate_columns_scalar,
                      back_substitute_scalar,
                      forward_substitute_scalar,
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

void drop_unknown(uint32_t unknown, uint32_t size, uint32_t stride, double* matrix) {
  for (uint32_t column = 0; column < unknown; ++column) matrix[size_t{column} * stride + unknown] = 0;
  for (uint32_t row = unknown; row < size; ++row) matrix[size_t{unknown} * stride + row] = 0;
  matrix[size_t{unknown} * stride + unknown] = 1;
}

bool eliminate(const EliminationKernel& kernel, double* matrix, uint32_t stride, uint32_t size,
               uint32_t eliminated) {
  for (uint32_t first = 0; first < size; first += kEliminationColumns) {
    if (!kernel.eliminate_columns(matrix, stride, size, eliminated, first)) return false;
  }
  return true;
}

}  // namespace palpate
