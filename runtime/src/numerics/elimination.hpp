// Partial Cholesky elimination of the first unknowns of a dense symmetric positive definite matrix, in place.
//
//   [ A11  . ]        [ L    .            ]
//   [ A21 A22 ]  ->   [ X   A22 - X X^T   ],   A11 = L L^T,  X = A21 L^-T
//
// A22 - A21 A11^-1 A21^T is the condensed matrix of the remaining rows.
//
// Matrices are float32, vectors and their sums double. Iterations correct the rounding of the matrices
// (nonlinear_zone.hpp, exterior.hpp), and float32 halves the memory to read.
//
// Storage is column-major, and only the lower triangle has meaning; the elimination overwrites entries above
// the triangle.
// - `stride` is a multiple of kEliminationRows, and `eliminated` a multiple of kEliminationColumns.
// - Columns begin on 32 bytes.
// - The capacity is `stride` rows, and `size` columns rounded up to kEliminationColumns.
#pragma once

#include <stddef.h>
#include <stdint.h>

namespace palpate {

inline constexpr uint32_t kEliminationRows = 16;
inline constexpr uint32_t kEliminationColumns = 4;
inline constexpr uint32_t kSymmetricRows = 8;

constexpr uint32_t elimination_stride(uint32_t size) {
  return (size + kEliminationRows - 1) / kEliminationRows * kEliminationRows;
}

constexpr uint32_t symmetric_stride(uint32_t size) {
  return (size + kSymmetricRows - 1) / kSymmetricRows * kSymmetricRows;
}

constexpr uint32_t round_to_columns(uint32_t size) {
  return (size + kEliminationColumns - 1) / kEliminationColumns * kEliminationColumns;
}

struct EliminationKernel {
  const char* name;
  // Eliminates the columns first .. first + kEliminationColumns - 1 after all columns before them. Returns
  // false if A11 is not positive definite. Cost: elimination_operations().
  bool (*eliminate_columns)(float* matrix, uint32_t stride, uint32_t size, uint32_t eliminated,
                            uint32_t first);
  // rows[count][row_stride] := rows L^-1, the first `size` entries of each row, with L from the elimination.
  // `size`, `row_stride`: multiples of kEliminationColumns. Columns begin on 16 bytes, rows on 32 bytes.
  void (*back_substitute)(const float* matrix, uint32_t stride, uint32_t size, double* rows,
                          size_t row_stride, uint32_t count);
  // vector := L^-1 vector; `size` as in back_substitute.
  void (*forward_substitute)(const float* matrix, uint32_t stride, uint32_t size, double* vector);
  // y := y + A x, A full and column-major. Reads and writes `rows` rounded up to four. Columns begin on 16
  // bytes, y on 32 bytes.
  void (*add_product)(const float* matrix, uint32_t stride, uint32_t rows, uint32_t columns, const double* x,
                      double* y);
  // y := y + A^T x. Rows and columns are multiples of four; columns begin on 16 bytes, x and y on 32 bytes.
  void (*add_transposed_product)(const float* matrix, uint32_t stride, uint32_t rows, uint32_t columns,
                                 const double* x, double* y);
  // y := y + A x for a symmetric A of `size` rows, a multiple of kSymmetricRows, which is also the stride.
  // Both triangles are present; the product reads about half. Columns begin on 16 bytes, x and y on 32 bytes.
  void (*add_symmetric_product)(const float* matrix, uint32_t size, const double* x, double* y);
};

// Multiply-adds of eliminate_columns() from a column on.
constexpr uint64_t elimination_operations(uint32_t size, uint32_t eliminated, uint32_t first) {
  const uint32_t columns = first < eliminated ? first : eliminated;
  return uint64_t{kEliminationColumns} * (size - first) * (columns + kEliminationColumns);
}

inline constexpr uint32_t kMostEliminationKernels = 2;

// Lists the kernels that this processor can run, the fastest last. Returns their number.
uint32_t list_elimination_kernels(EliminationKernel kernels[kMostEliminationKernels]);
EliminationKernel choose_elimination_kernel();

// Takes an unknown out of the system: zeros in its row and column, and 1 on the diagonal.
void drop_unknown(uint32_t unknown, uint32_t size, uint32_t stride, float* matrix);

// Eliminates all columns in order.
bool eliminate(const EliminationKernel& kernel, float* matrix, uint32_t stride, uint32_t size,
               uint32_t eliminated);

}  // namespace palpate
