// main() of every test program. `--file=NAME_test.cpp` runs the tests of a source file, as ctest does.
#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>
#include <string>
#include <string_view>

#include "offline/fem/blas_kernels.hpp"

namespace {

// The GoogleTest filter that selects the tests of a source file.
std::string tests_of_file(std::string_view file) {
  std::string filter;
  const testing::UnitTest& all = *testing::UnitTest::GetInstance();
  for (int i = 0; i < all.total_test_suite_count(); ++i) {
    const testing::TestSuite& suite = *all.GetTestSuite(i);
    for (int j = 0; j < suite.total_test_count(); ++j) {
      const testing::TestInfo& test = *suite.GetTestInfo(j);
      if (std::filesystem::path(test.file()).filename() != file) continue;
      filter.append(filter.empty() ? "" : ":").append(suite.name()).append(".").append(test.name());
    }
  }
  return filter;
}

}  // namespace

int main(int argc, char** argv) {
  palpate::choose_blas_kernels();
  testing::InitGoogleTest(&argc, argv);
  constexpr std::string_view kFile = "--file=";
  if (argc == 2 && std::string_view(argv[1]).starts_with(kFile)) {
    const std::string filter = tests_of_file(std::string_view(argv[1]).substr(kFile.size()));
    if (filter.empty()) {
      std::fprintf(stderr, "%s: no test comes from this file\n", argv[1]);
      return 1;
    }
    testing::GTEST_FLAG(filter) = filter;
  } else if (argc > 1) {
    std::fprintf(stderr, "usage: %s [--file=NAME_test.cpp] [--gtest_...]\n", argv[0]);
    return 1;
  }
  return RUN_ALL_TESTS();
}
