// Much work of one kind on several threads: solves of one organ, and other.
#pragma once

#include <functional>

#include "offline/fem/static_solver.hpp"

namespace palpate {

// Calls work(worker, i) for i < count, or for those alone that `next` hands out, on `jobs` threads, no two at a time
// with the same `worker` < max(jobs, 1); `progress` gets calls done and their number. Throws what the first of them
// by number threw.
void for_each_on_threads(size_t count, int jobs, const std::function<void(size_t, size_t)>& work,
                         const std::function<void(int, int)>& progress,
                         const std::function<size_t()>& next = {});

// Calls work(solver, i) in the same way, each thread with a solver of its own. A call is made by one thread from
// start to end, so that the schedule cannot change a digit.
void for_each_on_threads(const Assembly& assembly, size_t count, int jobs,
                         const std::function<void(StaticSolver&, size_t)>& work,
                         const std::function<void(int, int)>& progress,
                         const std::function<size_t()>& next = {});

}  // namespace palpate
