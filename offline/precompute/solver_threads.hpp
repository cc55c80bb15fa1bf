// Many solves of one organ on several threads.
#pragma once

#include <functional>

#include "offline/fem/static_solver.hpp"

namespace palpate {

// Calls work(solver, i) for i < count on `jobs` threads, each with a solver of its own, or for those alone that `next`
// hands out; `progress` gets calls done and their number. Throws what the first of them by number threw. A call is made
// by one thread from start to end, so that the schedule cannot change a digit.
void for_each_on_threads(const Assembly& assembly, size_t count, int jobs,
                         const std::function<void(StaticSolver&, size_t)>& work,
                         const std::function<void(int, int)>& progress,
                         const std::function<size_t()>& next = {});

}  // namespace palpate
