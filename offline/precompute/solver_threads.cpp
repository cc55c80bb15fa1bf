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

void for_each_on_threads(size_t count, int jobs, const std::function<void(size_t, size_t)>& work,
                         const std::function<void(int, int)>& progress, const std::function<size_t()>& next) {
  std::atomic<size_t> counter = 0;
  std::atomic<bool> has_failed = false;
  const auto take = [&] { return has_failed ? count : next ? next() : counter++; };
  std::mutex report;
  int done = 0;
  std::exception_ptr failure;
  size_t failed_index = count;
  const auto run = [&](size_t worker) {
    for (size_t i = take(); i < count; i = take()) {
      try {
        work(worker, i);
        const std::lock_guard lock(report);
        ++done;
        if (progress) progress(done, static_cast<int>(count));
      } catch (...) {
        const std::lock_guard lock(report);
        if (i < failed_index) {
          failed_index = i;
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
      for (int i = 1; i < std::min(jobs, static_cast<int>(count)); ++i)
        threads.emplace_back(run, static_cast<size_t>(i));
    } catch (const std::system_error&) {
      // The system refuses more threads: the existing threads do all work.
    }
    run(0);
  }
  if (failure) std::rethrow_exception(failure);
}

void for_each_on_threads(const Assembly& assembly, size_t count, int jobs,
                         const std::function<void(StaticSolver&, size_t)>& work,
                         const std::function<void(int, int)>& progress, const std::function<size_t()>& next) {
  std::vector<std::optional<StaticSolver>> solvers(static_cast<size_t>(std::max(jobs, 1)));
  const auto solve = [&](size_t worker, size_t i) {
    if (!solvers[worker]) solvers[worker].emplace(assembly);
    work(*solvers[worker], i);
  };
  for_each_on_threads(count, jobs, solve, progress, next);
}

}  // namespace palpate
