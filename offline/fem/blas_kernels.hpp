// Code of BLAS for the processor at hand.
#pragma once

namespace palpate {

// OpenBLAS before 0.3.25 takes code for SSE3 on Intel processors that it does not know, and a factorisation then takes
// twice as long (https://github.com/OpenMathLib/OpenBLAS/pull/4268). It looks at OPENBLAS_CORETYPE only while it is
// loaded: where it took that code, the processor has AVX2 and the user has not set the variable, the program is begun
// again with it set, for itself and its children. Does not return then: call it before anything is printed, opened or
// begun (threads, MPI).
void begin_again_with_fast_blas(char** argv);

}  // namespace palpate
