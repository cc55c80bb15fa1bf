#include "offline/fem/blas_kernels.hpp"

#include <cblas.h>
#include <stdlib.h>

#include <string_view>

// OpenBLAS calls both functions at load and unload. Another BLAS leaves the pointers null.
extern "C" {
[[gnu::weak]] void gotoblas_dynamic_quit();
[[gnu::weak]] void gotoblas_dynamic_init();
}

namespace palpate {

void choose_blas_kernels() {
#if defined(__x86_64__)
  const bool has_avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  const bool has_avx512 = has_avx2 && __builtin_cpu_supports("avx512f") &&
                          __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") &&
                          __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512vl");
  if (!has_avx2 || gotoblas_dynamic_quit == nullptr || gotoblas_dynamic_init == nullptr ||
      openblas_get_corename() != std::string_view("Prescott") || getenv("OPENBLAS_CORETYPE") != nullptr ||
      setenv("OPENBLAS_CORETYPE", has_avx512 ? "SkylakeX" : "Haswell", 1) != 0)
    return;
  gotoblas_dynamic_quit();
  gotoblas_dynamic_init();
#endif
}

}  // namespace palpate
