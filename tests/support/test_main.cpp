// Tests solve with the code of BLAS that programs take.
#include <gtest/gtest.h>

#include "offline/fem/blas_kernels.hpp"

int main(int argc, char** argv) {
  palpate::choose_blas_kernels();
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
