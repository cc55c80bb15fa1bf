// Runs many tasks of one kind on several threads, with or without a solver for each thread.
#pragma once

#include <functional>

#include "offline/fem/static_solver.hpp"

namespace palpate {

// Calls work(worker, i) on `jobs` threads for all i < count, or for the numbers i < count that next()
// returns. Concurrent calls have different `worker` < max(jobs, 1). `progress` gets finished calls and
// `count`. Rethrows the exception of the lowest i.
void for_each_on_threads(size_t count, int jobs, const std::function<void(size_t, size_t)>& work,
                         const std::function<void(int, int)>& progress,
                         const std::function<size_t()>& next = {});

// Calls work(solver, i) in the same way, with a solver for each thread. Each call runs on a single thread.
void for_each_on_threads(const Assembly& assembly, size_t count, int jobs,
                         const std::function<void(StaticSolver&, size_t)>& work,
                         const std::function<void(int, int)>& progress,
                         const std::function<size_t()>& next = {});

}  // namespace palpate
