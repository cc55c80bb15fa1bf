#include "offline/precompute/solver_threads.hpp"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <optional>
#include <system_error>
#include <thread>
#include <vector>

namespace palpate {

void for_each_on_threads(const Assembly& assembly, size_t count, int jobs,
                         const std::function<void(StaticSolver&, size_t)>& work,
                         const std::function<void(int, int)>& progress, const std::function<size_t()>& next) {
  std::atomic<size_t> own_next = 0;
  std::atomic<bool> has_failed = false;
  const auto take = [&] { return has_failed ? count : next ? next() : own_next++; };
  std::mutex report;
  int done = 0;
  std::exception_ptr failure;
  size_t failed = count;
  const auto run = [&] {
    std::optional<StaticSolver> solver;
    for (size_t i = take(); i < count; i = take()) {
      try {
        if (!solver) solver.emplace(assembly);
        work(*solver, i);
        const std::lock_guard lock(report);
        ++done;
        if (progress) progress(done, static_cast<int>(count));
      } catch (...) {
        const std::lock_guard lock(report);
        if (i < failed) {
          failed = i;
          failure = std::current_exception();
        }
        has_failed = true;
        return;
      }
    }
  };
  {
    std::vector<std::jthread> threads;
    try {
      for (int i = 1; i < std::min(jobs, static_cast<int>(count)); ++i) threads.emplace_back(run);
    } catch (const std::system_error&) {
      // The machine gives no more threads: those there are do all the work.
    }
    run();
  }
  if (failure) std::rethrow_exception(failure);
}

}  // namespace palpate
