// A loop shared out between threads.
#pragma once

#include <algorithm>
#include <atomic>
#include <system_error>
#include <thread>
#include <vector>

namespace palpate {

// Calls work(index, worker) once for each index below `count`, on as many threads as asked for, or as the
// system gives. `worker` counts the threads from 0, the caller's. `work` must not throw: there is nobody to
// catch it.
template <typename Work>
void parallel_for(int threads, int count, Work&& work) {
  std::atomic<int> next = 0;
  const auto run = [&](int worker) {
    for (int index = next++; index < count; index = next++) work(index, worker);
  };
  std::vector<std::jthread> others;
  try {
    for (int worker = 1; worker < std::min(threads, count); ++worker) others.emplace_back(run, worker);
  } catch (const std::system_error&) {
    // No more threads: those at hand do it all.
  }
  run(0);
}

}  // namespace palpate
