#include "offline/fem/blas_kernels.hpp"

#include <cblas.h>
#include <stdlib.h>
#include <unistd.h>

#include <string_view>

namespace palpate {

void begin_again_with_fast_blas(char** argv) {
#if defined(__x86_64__)
  using std::string_view_literals::operator""sv;
  if (openblas_get_corename() != "Prescott"sv || !__builtin_cpu_supports("avx2")) return;
  const bool has_avx512 = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
                          __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512vl");
  constexpr int kNotOverTheUsers = 0;
  if (getenv("OPENBLAS_CORETYPE") != nullptr ||
      setenv("OPENBLAS_CORETYPE", has_avx512 ? "SkylakeX" : "Haswell", kNotOverTheUsers) != 0)
    return;
  execv("/proc/self/exe", argv);
  // It could not: slow code is right, too.
#else
  static_cast<void>(argv);
#endif
}

}  // namespace palpate
