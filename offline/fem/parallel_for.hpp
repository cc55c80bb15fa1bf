// Shares a loop between threads that persist. A Newton iteration has many short loops; starting threads would
// cost as much as a loop.
#pragma once

#include <algorithm>
#include <atomic>
#include <type_traits>

namespace palpate {

// Calls run(context, worker) on the caller's thread as worker 0, and on up to `threads` - 1 other threads.
// Returns when all calls have returned. Runs on the caller's thread alone where:
//   1. another loop has the threads, as in a nested loop, or
//   2. the system gives no threads.
// `run` must not throw.
void run_on_threads(int threads, void (*run)(void* context, int worker), void* context);

// Calls work(index, worker) once for each index below `count`, on at most `threads` threads. `worker` is
// below `threads` and `count`; concurrent calls have different workers.
template <typename Work>
void parallel_for(int threads, int count, Work&& work) {
  struct Loop {
    std::remove_reference_t<Work>& work;
    int count;
    std::atomic<int> next = 0;
    void run(int worker) {
      for (int index = next++; index < count; index = next++) work(index, worker);
    }
  } loop = {work, count};
  run_on_threads(
      std::min(threads, count), [](void* context, int worker) { static_cast<Loop*>(context)->run(worker); },
      &loop);
}

}  // namespace palpate
