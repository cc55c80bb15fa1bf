// The inner loops of held_inverse: a symmetric matrix of 3 x 3 blocks, times three columns, and plus three
// products of columns.
#pragma once

#include <stddef.h>
#include <stdint.h>

namespace palpate {

// Rows and columns are `stride` doubles apart, a multiple of 8, and aligned to 64 bytes. Of a row, the
// numbers up to the next multiple of 8 behind the last are read and written too, and mean nothing.
inline constexpr size_t kInverseLanes = 8;

struct InverseKernel {
  const char* name;
  // y[r] = M x[r], r < 3, M of num_nodes blocks. 9 num_nodes^2 x 3 multiply-adds.
  void (*multiply)(const double* matrix, size_t stride, uint32_t num_nodes, const double* x, double* y);
  // M[i][j] += sum over r < 3 of p[r][i] q[r][j]. As many.
  void (*add_products)(double* matrix, size_t stride, uint32_t num_nodes, const double* p, const double* q);
  // out[i] = sum over j < count of weights[j] rows[j stride + i], i < length.
  void (*combine)(const double* rows, size_t stride, uint32_t count, const double* weights, size_t length,
                  double* out);
};

// Those that this processor runs, the fastest last, and their number, as list_field_kernels. avx2 and avx512
// give the same bits.
inline constexpr uint32_t kMostInverseKernels = 3;
uint32_t list_inverse_kernels(InverseKernel kernels[kMostInverseKernels]);

// The fastest.
InverseKernel choose_inverse_kernel();

}  // namespace palpate
