// Which code OpenBLAS takes, as it says itself: in its last line where the program begins again.
#include <gtest/gtest.h>

#include "tests/support/shell_command.hpp"

namespace palpate::test {
namespace {

std::string kernels_taken(const std::string& environment) {
  const std::string said =
      run_command("OPENBLAS_VERBOSE=2 " + environment + " " + shell_word(PALPATE_PROGRAM) + " --version")
          .output;
  const size_t at = said.rfind("Core: ");
  return at == std::string::npos ? said : said.substr(at + 6, said.find('\n', at) - at - 6);
}

TEST(BlasKernels, AreNotThoseOfSse3WhereTheProcessorHasAvx2) {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2")) {
    EXPECT_NE(kernels_taken("env -u OPENBLAS_CORETYPE"), "Prescott");
    return;
  }
#endif
  GTEST_SKIP() << "of a processor with AVX2";
}

TEST(BlasKernels, AreThoseThatTheUserNames) {
  EXPECT_EQ(kernels_taken("OPENBLAS_CORETYPE=Prescott"), "Prescott");
}

}  // namespace
}  // namespace palpate::test
