// The code of BLAS for the processor at hand.
#pragma once

namespace palpate {

// OpenBLAS before 0.3.25 takes its SSE3 code on Intel processors that it does not know: a factorisation then takes
// twice as long (https://github.com/OpenMathLib/OpenBLAS/pull/4268). This function lets OpenBLAS choose again, unless
// the user has set OPENBLAS_CORETYPE. Each program calls it first in main().
void choose_blas_kernels();

}  // namespace palpate
