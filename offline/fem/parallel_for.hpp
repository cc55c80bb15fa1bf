// A loop shared out between threads that stay for the next one: a Newton iteration has some twenty loops of
// a few tenths of a millisecond, which is what it costs to start a thread.
#pragma once

#include <algorithm>
#include <atomic>
#include <type_traits>

namespace palpate {

// Calls run(context, worker) on the caller's thread, as worker 0, and, once or more, on as many of threads -
// 1 others as come before that call has returned; returns when all have. Alone where another loop has the
// threads at the time, as a loop within a loop does, or where the system gives none. `run` must not throw:
// there is nobody to catch it.
void run_on_threads(int threads, void (*run)(void* context, int worker), void* context);

// Calls work(index, worker) once for each index below `count`, on as many threads as asked for or as there
// are (run_on_threads). `worker` is below both; no two calls at a time have the same one.
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
