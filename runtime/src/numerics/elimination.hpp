// Elimination of the first unknowns of a symmetric positive definite matrix, dense, in place.
//
//   [ A11  . ]        [ L    .            ]
//   [ A21 A22 ]  ->   [ X   A22 - X X^T   ],   A11 = L L^T,  X = A21 L^-T
//
// Of what is left, A22 - A21 A11^-1 A21^T is the matrix condensed onto the rows that stay; a load kept as one more row
// b^T of A21 becomes (L^-1 b)^T, and its entries of A22 become what the eliminated unknowns leave of it.
//
// Column-major; only the lower triangle means anything. `stride` is a multiple of kEliminationRows, columns begin on 32
// bytes, `eliminated` is a multiple of kEliminationColumns, and there is room for as many columns as `size` rounded up
// to that and for as many rows as `stride`. Whatever is above the triangle is overwritten.
#pragma once

#include <stddef.h>
#include <stdint.h>

namespace palpate {

inline constexpr uint32_t kEliminationRows = 8;
inline constexpr uint32_t kEliminationColumns = 4;

constexpr uint32_t elimination_stride(uint32_t size) {
  return (size + kEliminationRows - 1) / kEliminationRows * kEliminationRows;
}

constexpr uint32_t round_to_columns(uint32_t size) {
  return (size + kEliminationColumns - 1) / kEliminationColumns * kEliminationColumns;
}

struct EliminationKernel {
  const char* name;
  // The columns first .. first + kEliminationColumns - 1, all before them done. False where A11 is not positive
  // definite. Cost: elimination_operations().
  bool (*eliminate_columns)(double* matrix, uint32_t stride, uint32_t size, uint32_t eliminated,
                            uint32_t first);
  // rows[count][row_stride] := rows L^-1, the first `size` of each; L as left by the above. `size` and `row_stride` are
  // multiples of kEliminationColumns, rows begin on 32 bytes.
  void (*back_substitute)(const double* matrix, uint32_t stride, uint32_t size, double* rows,
                          size_t row_stride, uint32_t count);
  // vector := L^-1 vector; `size` as there.
  void (*forward_substitute)(const double* matrix, uint32_t stride, uint32_t size, double* vector);
  // y := y + A x, A full and column-major; `rows` rounded up to four are read and written.
  void (*add_product)(const double* matrix, uint32_t stride, uint32_t rows, uint32_t columns, const double* x,
                      double* y);
  // The same of floats: columns on 16 bytes, y on 32.
  void (*add_float_product)(const float* matrix, uint32_t stride, uint32_t rows, uint32_t columns,
                            const double* x, double* y);
  // y := y + A^T x, of floats: rows and columns are multiples of four, columns on 16 bytes, x and y on 32.
  void (*add_transposed_product)(const float* matrix, uint32_t stride, uint32_t rows, uint32_t columns,
                                 const double* x, double* y);
  // And of a symmetric matrix of so many rows and columns, a multiple of kEliminationRows, which is its stride: both its
  // triangles are there, and about half of it is read. x and y on 32 bytes.
  void (*add_symmetric_product)(const double* matrix, uint32_t size, const double* x, double* y);
};

// What eliminate_columns() takes, from a column on: multiply-adds.
constexpr uint64_t elimination_operations(uint32_t size, uint32_t eliminated, uint32_t first) {
  const uint32_t columns = first < eliminated ? first : eliminated;
  return uint64_t{kEliminationColumns} * (size - first) * (columns + kEliminationColumns);
}

inline constexpr uint32_t kMostEliminationKernels = 2;

// Those that this processor can run, the best last; how many.
uint32_t list_elimination_kernels(EliminationKernel kernels[kMostEliminationKernels]);
EliminationKernel choose_elimination_kernel();

// An unknown that is held takes no part.
void drop_unknown(uint32_t unknown, uint32_t size, uint32_t stride, double* matrix);

// All columns after one another.
bool eliminate(const EliminationKernel& kernel, double* matrix, uint32_t stride, uint32_t size,
               uint32_t eliminated);

}  // namespace palpate
