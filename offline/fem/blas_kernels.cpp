#include "offline/fem/blas_kernels.hpp"

#include <cblas.h>
#include <limits.h>
#include <stdlib.h>
#include <unistd.h>

#include <string_view>

namespace palpate {

void begin_again_with_fast_blas(char** argv) {
#if defined(__x86_64__)
  using std::string_view_literals::operator""sv;
  const bool has_avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  const bool has_avx512 = has_avx2 && __builtin_cpu_supports("avx512f") &&
                          __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") &&
                          __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512vl");
  if (openblas_get_corename() != "Prescott"sv || !has_avx2 || getenv("OPENBLAS_CORETYPE") != nullptr ||
      setenv("OPENBLAS_CORETYPE", has_avx512 ? "SkylakeX" : "Haswell", 1) != 0)
    return;
  // By its path, which names the process; by the link where the file has been replaced since.
  constexpr const char* kSelf = "/proc/self/exe";
  char path[PATH_MAX];
  if (const ssize_t length = readlink(kSelf, path, sizeof path - 1); length > 0) {
    path[length] = 0;
    execv(path, argv);
  }
  execv(kSelf, argv);
#else
  static_cast<void>(argv);
#endif
}

}  // namespace palpate
