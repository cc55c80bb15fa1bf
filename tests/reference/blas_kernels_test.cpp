// The program uses BLAS kernels that suit the processor.
#include <cblas.h>
#include <gtest/gtest.h>

#include "tests/support/shell_command.hpp"

namespace palpate::test {
namespace blas_kernels_test {

#if defined(__x86_64__)

// test_main.cpp has called choose_blas_kernels().
TEST(BlasKernels, AreNotThoseOfSse3WhereTheProcessorHasAvx2) {
  if (!__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("fma"))
    GTEST_SKIP() << "needs a processor with AVX2";
  EXPECT_STRNE(openblas_get_corename(), "Prescott");
}

TEST(BlasKernels, FollowTheUsersChoice) {
  const CommandResult run = run_command("OPENBLAS_VERBOSE=2 OPENBLAS_CORETYPE=Prescott " +
                                        shell_word(PALPATE_PROGRAM) + " --version");
  EXPECT_EQ(run.exit_code, 0);
  EXPECT_NE(run.output.find("Core: Prescott"), std::string::npos) << run.output;
  EXPECT_EQ(run.output.find("Core:"), run.output.rfind("Core:")) << run.output;
}

#endif

}  // namespace blas_kernels_test
}  // namespace palpate::test
