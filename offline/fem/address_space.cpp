#include "offline/fem/address_space.hpp"

#include <cblas.h>
#include <fmt/format.h>
#include <sys/resource.h>

namespace palpate {

std::string address_space_shortage() {
  constexpr double kBuffer = 134.3e6;  // bytes for each thread
  constexpr double kProgram = 120e6;   // bytes for libraries, a model, a pack
  rlimit limit = {};
  if (getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return "";
  const int threads = openblas_get_num_threads();
  const double needed = kProgram + kBuffer * threads;
  const auto available = static_cast<double>(limit.rlim_cur);
  if (available >= needed) return "";
  return fmt::format(
      "{:.0f} MB of address space are too little for the {} threads of OpenBLAS; allow {:.0f} MB (ulimit -v "
      "{:.0f}){}",
      1e-6 * available, threads, 1e-6 * needed, needed / 1024 + 1,
      threads > 1 ? ", or set OPENBLAS_NUM_THREADS=1" : "");
}

}  // namespace palpate
