// Tests solve with the code of BLAS that programs take.
#include <gtest/gtest.h>

#include "offline/fem/blas_kernels.hpp"

int main(int argc, char** argv) {
  palpate::begin_again_with_fast_blas(argv);
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
