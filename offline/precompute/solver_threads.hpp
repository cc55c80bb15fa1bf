// Runs many tasks of one kind on several threads, with or without a solver for each thread.
#pragma once

#include <functional>

#include "offline/fem/static_solver.hpp"

namespace palpate {

// Calls work(worker, i) for i < count, or for the numbers of `next`, on `jobs` threads. Concurrent calls have different
// `worker` < max(jobs, 1). `progress` gets finished calls and their number. Rethrows the exception of the lowest i.
void for_each_on_threads(size_t count, int jobs, const std::function<void(size_t, size_t)>& work,
                         const std::function<void(int, int)>& progress,
                         const std::function<size_t()>& next = {});

// Calls work(solver, i) in the same way, with a solver for each thread. One thread makes a whole call, so the
// schedule changes no digit.
void for_each_on_threads(const Assembly& assembly, size_t count, int jobs,
                         const std::function<void(StaticSolver&, size_t)>& work,
                         const std::function<void(int, int)>& progress,
                         const std::function<size_t()>& next = {});

}  // namespace palpate
