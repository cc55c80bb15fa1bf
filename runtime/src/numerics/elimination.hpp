// Partial Cholesky elimination of the first unknowns of a dense symmetric positive definite matrix, in place.
//
//   [ A11  . ]        [ L    .            ]
//   [ A21 A22 ]  ->   [ X   A22 - X X^T   ],   A11 = L L^T,  X = A21 L^-T
//
// A22 - A21 A11^-1 A21^T is the condensed matrix of the remaining rows. A load b^T may be one more row of A21. The elimination turns this row into (L^-1 b)^T, and its
// entries in A22 into the condensed load.
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

inline constexpr uint32_t kEliminationRows = 8;
inline constexpr uint32_t kFloatEliminationRows = 16;
inline constexpr uint32_t kEliminationColumns = 4;

constexpr uint32_t elimination_stride(uint32_t size) {
  return (size + kEliminationRows - 1) / kEliminationRows * kEliminationRows;
}

constexpr uint32_t float_elimination_stride(uint32_t size) {
  return (size + kFloatEliminationRows - 1) / kFloatEliminationRows * kFloatEliminationRows;
}

constexpr uint32_t round_to_columns(uint32_t size) {
  return (size + kEliminationColumns - 1) / kEliminationColumns * kEliminationColumns;
}

struct EliminationKernel {
  const char* name;
  // Eliminates the columns first .. first + kEliminationColumns - 1 after all columns before them. False if
  // A11 is not positive definite. Cost: elimination_operations().
  bool (*eliminate_columns)(double* matrix, uint32_t stride, uint32_t size, uint32_t eliminated,
                            uint32_t first);
  // The same in float32; `stride` is a multiple of kFloatEliminationRows.
  bool (*eliminate_float_columns)(float* matrix, uint32_t stride, uint32_t size, uint32_t eliminated,
                                  uint32_t first);
  // rows[count][row_stride] := rows L^-1, the first `size` entries of each row, with L from the elimination.
  // `size` and `row_stride` are multiples of kEliminationColumns, and rows begin on 32 bytes.
  void (*back_substitute)(const double* matrix, uint32_t stride, uint32_t size, double* rows,
                          size_t row_stride, uint32_t count);
  // vector := L^-1 vector; `size` as in back_substitute.
  void (*forward_substitute)(const double* matrix, uint32_t stride, uint32_t size, double* vector);
  // The same two for a factor of floats and one vector: columns begin on 16 bytes, the vector on 32 bytes.
  void (*back_substitute_floats)(const float* matrix, uint32_t stride, uint32_t size, double* vector);
  void (*forward_substitute_floats)(const float* matrix, uint32_t stride, uint32_t size, double* vector);
  // y := y + A x, A full and column-major. Reads and writes `rows` rounded up to four.
  void (*add_product)(const double* matrix, uint32_t stride, uint32_t rows, uint32_t columns, const double* x,
                      double* y);
  // y := y + A x for floats: columns begin on 16 bytes, y on 32 bytes.
  void (*add_float_product)(const float* matrix, uint32_t stride, uint32_t rows, uint32_t columns,
                            const double* x, double* y);
  // y := y + A^T x for floats. Rows and columns are multiples of four; columns begin on 16 bytes, x and y on
  // 32 bytes.
  void (*add_transposed_product)(const float* matrix, uint32_t stride, uint32_t rows, uint32_t columns,
                                 const double* x, double* y);
  // y := y + A x for a symmetric A of `size` rows, a multiple of kEliminationRows, which is also the stride.
  // Both triangles are present, and the product reads about half of A. x and y begin on 32 bytes.
  void (*add_symmetric_product)(const double* matrix, uint32_t size, const double* x, double* y);
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

// Removes an unknown with a fixed value from the system.
template <typename Number>
void drop_unknown(uint32_t unknown, uint32_t size, uint32_t stride, Number* matrix);

// Eliminates all columns in order.
bool eliminate(const EliminationKernel& kernel, double* matrix, uint32_t stride, uint32_t size,
               uint32_t eliminated);

}  // namespace palpate
