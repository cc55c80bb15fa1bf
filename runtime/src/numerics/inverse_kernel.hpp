// The inner loops of contact_stiffness: products and updates of a symmetric matrix of 3 x 3 blocks.
#pragma once

#include <stddef.h>
#include <stdint.h>

namespace palpate {

// Rows and columns are `stride` doubles apart, a multiple of 8, and aligned to 64 bytes. The kernels also
// read and write the padding of a row up to the next multiple of 8.
inline constexpr size_t kInverseLanes = 8;

struct InverseKernel {
  const char* name;
  // y[r] = M x[r], r < 3, M of num_nodes blocks. Cost: 27 num_nodes^2 multiply-adds.
  void (*multiply)(const double* matrix, size_t stride, uint32_t num_nodes, const double* x, double* y);
  // M[i][j] += sum over r < 3 of p[r][i] q[r][j]. Cost: 27 num_nodes^2 multiply-adds.
  void (*add_products)(double* matrix, size_t stride, uint32_t num_nodes, const double* p, const double* q);
  // out[i] = sum over j < count of weights[j] rows[j stride + i], i < length.
  void (*combine)(const double* rows, size_t stride, uint32_t count, const double* weights, size_t length,
                  double* out);
};

// Lists the kernels that this processor can run, the fastest last. Returns their number. The kernels avx2 and
// avx512 give the same bits.
inline constexpr uint32_t kMostInverseKernels = 3;
uint32_t list_inverse_kernels(InverseKernel kernels[kMostInverseKernels]);

InverseKernel choose_inverse_kernel();

}  // namespace palpate
