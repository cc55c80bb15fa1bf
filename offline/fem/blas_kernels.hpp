// Selects the BLAS kernels for the current processor.
#pragma once

namespace palpate {

// OpenBLAS before 0.3.25 uses SSE3 kernels on unknown Intel processors
// (https://github.com/OpenMathLib/OpenBLAS/pull/4268). This function repeats the selection, unless the user
// has set OPENBLAS_CORETYPE. Each program calls this function first in main().
void choose_blas_kernels();

}  // namespace palpate
