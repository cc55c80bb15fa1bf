#include "runtime/src/numerics/elimination.hpp"

#include "runtime/src/numerics/elimination_block.hpp"

namespace palpate {
namespace {

constexpr uint32_t kColumns = kEliminationColumns;
constexpr uint32_t kTile = kEliminationRows;

// A tile of kTile rows in a block of columns: subtract() subtracts the products of all earlier columns, and
// solve() multiplies by L^-T of the diagonal block.
struct ScalarTile {
  float entries[kColumns][kTile];

  void subtract(const float* matrix, uint32_t stride, uint32_t row, uint32_t first, uint32_t columns) {
    const float* target = matrix + size_t{first} * stride + row;
    for (uint32_t c = 0; c < kColumns; ++c) {
      for (uint32_t r = 0; r < kTile; ++r) entries[c][r] = target[c * stride + r];
    }
    for (uint32_t k = 0; k < columns; ++k) {
      const float* column = matrix + size_t{k} * stride;
      for (uint32_t c = 0; c < kColumns; ++c) {
        for (uint32_t r = 0; r < kTile; ++r) entries[c][r] -= column[row + r] * column[first + c];
      }
    }
  }
  void solve(const DiagonalBlock& block) {
    for (uint32_t c = 0; c < kColumns; ++c) {
      for (uint32_t r = 0; r < kTile; ++r) {
        for (uint32_t k = 0; k < c; ++k) entries[c][r] -= entries[k][r] * block.below[c][k];
        entries[c][r] *= block.inverse[c];
      }
    }
  }
  void store(float* target, uint32_t stride) const {
    for (uint32_t c = 0; c < kColumns; ++c) {
      for (uint32_t r = 0; r < kTile; ++r) target[c * stride + r] = entries[c][r];
    }
  }
};

bool eliminate_columns_scalar(float* matrix, uint32_t stride, uint32_t size, uint32_t eliminated,
                              uint32_t first) {
  const bool inside = first < eliminated;
  const uint32_t columns = inside ? first : eliminated;
  DiagonalBlock block = {};
  ScalarTile tile;
  for (uint32_t row = first / kTile * kTile; row < size; row += kTile) {
    float* target = matrix + size_t{first} * stride + row;
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

void back_substitute_scalar(const float* matrix, uint32_t stride, uint32_t size, double* vector) {
  for (uint32_t j = size; j-- > 0;) {
    const float* column = matrix + size_t{j} * stride;
    const double inverse = 1.0 / static_cast<double>(column[j]);
    double sum = vector[j];
    for (uint32_t i = j + 1; i < size; ++i) sum -= static_cast<double>(column[i]) * vector[i];
    vector[j] = sum * inverse;
  }
}

void back_substitute_rows(const float* matrix, uint32_t stride, uint32_t size, double* rows,
                          size_t row_stride, uint32_t count) {
  for (uint32_t t = 0; t < count; ++t) back_substitute_scalar(matrix, stride, size, rows + t * row_stride);
}

void forward_substitute_scalar(const float* matrix, uint32_t stride, uint32_t size, double* vector) {
  for (uint32_t first = 0; first < size; first += kColumns) {
    const float* columns = matrix + size_t{first} * stride;
    solve_triangle(columns + first, stride, vector + first);
    for (uint32_t c = 0; c < kColumns; ++c) {
      for (uint32_t i = first + kColumns; i < size; ++i)
        vector[i] -= static_cast<double>(columns[c * stride + i]) * vector[first + c];
    }
  }
}

void add_product_scalar(const float* matrix, uint32_t stride, uint32_t rows, uint32_t columns,
                        const double* x, double* y) {
  for (uint32_t j = 0; j < columns; ++j) {
    const float* column = matrix + size_t{j} * stride;
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

void add_symmetric_product_scalar(const float* matrix, uint32_t size, const double* x, double* y) {
  for (uint32_t j = 0; j < size; ++j) {
    const float* column = matrix + size_t{j} * size;
    double sum = static_cast<double>(column[j]) * x[j];
    for (uint32_t i = j + 1; i < size; ++i) {
      y[i] += static_cast<double>(column[i]) * x[j];
      sum += static_cast<double>(column[i]) * x[i];
    }
    y[j] += sum;
  }
}

}  // namespace

uint32_t list_elimination_kernels(EliminationKernel kernels[kMostEliminationKernels]) {
  uint32_t count = 0;
  kernels[count++] = {"scalar",
                      eliminate_columns_scalar,
                      back_substitute_rows,
                      forward_substitute_scalar,
                      add_product_scalar,
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

void drop_unknown(uint32_t unknown, uint32_t size, uint32_t stride, float* matrix) {
  for (uint32_t column = 0; column < unknown; ++column) matrix[size_t{column} * stride + unknown] = 0;
  for (uint32_t row = unknown; row < size; ++row) matrix[size_t{unknown} * stride + row] = 0;
  matrix[size_t{unknown} * stride + unknown] = 1;
}

bool eliminate(const EliminationKernel& kernel, float* matrix, uint32_t stride, uint32_t size,
               uint32_t eliminated) {
  for (uint32_t first = 0; first < size; first += kEliminationColumns) {
    if (!kernel.eliminate_columns(matrix, stride, size, eliminated, first)) return false;
  }
  return true;
}

}  // namespace palpate
