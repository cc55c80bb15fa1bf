// Code of BLAS for the processor at hand.
#pragma once

namespace palpate {

// OpenBLAS before 0.3.25 takes code for SSE3 on processors of Intel's that came after it, which makes a factorisation
// take twice as long (https://github.com/OpenMathLib/OpenBLAS/pull/4268). It looks at OPENBLAS_CORETYPE only while it is
// loaded: where it has done so, and the user has not said which code to take, the program begins again with that set.
// Call it first in main; returns where there is nothing to mend.
void begin_again_with_fast_blas(char** argv);

}  // namespace palpate
