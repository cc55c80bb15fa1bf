// Which code OpenBLAS takes, as it says itself each time that it is loaded.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/support/shell_command.hpp"

namespace palpate::test {
namespace {

#if defined(__x86_64__)

std::vector<std::string> kernels_taken(const std::string& environment) {
  const CommandResult run =
      run_command("OPENBLAS_VERBOSE=2 " + environment + " " + shell_word(PALPATE_PROGRAM) + " --version");
  EXPECT_EQ(run.exit_code, 0);
  const std::string says = "Core: ";
  std::vector<std::string> taken;
  for (size_t at = run.output.find(says); at != std::string::npos; at = run.output.find(says, at)) {
    at += says.size();
    taken.push_back(run.output.substr(at, run.output.find('\n', at) - at));
  }
  return taken;
}

TEST(BlasKernels, AreNotThoseOfSse3WhereTheProcessorHasAvx2) {
  if (!__builtin_cpu_supports("avx2")) GTEST_SKIP() << "of a processor with AVX2";
  const std::vector<std::string> taken = kernels_taken("env -u OPENBLAS_CORETYPE");
  ASSERT_FALSE(taken.empty());
  EXPECT_NE(taken.back(), "Prescott");
  EXPECT_LE(taken.size(), 2U) << "begins again once at most";
}

TEST(BlasKernels, AreThoseThatTheUserNames) {
  EXPECT_EQ(kernels_taken("OPENBLAS_CORETYPE=Prescott"), std::vector<std::string>{"Prescott"});
}

#endif

}  // namespace
}  // namespace palpate::test
