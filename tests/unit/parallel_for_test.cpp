// parallel_for visits every index once, and runs alone where other loops hold the threads.
#include "offline/fem/parallel_for.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <thread>
#include <vector>

namespace palpate {
namespace parallel_for_test {

constexpr int kThreads = 4;

// Runs a loop and returns the visits of each index. Worker numbers must be in range and never held twice.
std::vector<int> visits(int threads, int count) {
  std::vector<std::atomic<int>> seen(static_cast<size_t>(count));
  std::vector<std::atomic<int>> at_work(static_cast<size_t>(threads));
  parallel_for(threads, count, [&](int index, int worker) {
    ASSERT_GE(worker, 0);
    ASSERT_LT(worker, std::min(threads, count)) << "memory for each is often so large";
    EXPECT_EQ(at_work[static_cast<size_t>(worker)]++, 0);
    ++seen[static_cast<size_t>(index)];
    --at_work[static_cast<size_t>(worker)];
  });
  return {seen.begin(), seen.end()};
}

TEST(ParallelFor, VisitsEveryIndexOnce) {
  for (int repeat = 0; repeat < 2000; ++repeat) {
    const int count = repeat % 40;
    EXPECT_EQ(visits(1 + repeat % kThreads, count), std::vector<int>(static_cast<size_t>(count), 1));
  }
}

TEST(ParallelFor, SharesALongLoop) {
  std::atomic<int> inside = 0;
  std::atomic<bool> met = false;
  parallel_for(2, 2, [&](int, int) {
    ++inside;
    // Waits until both indices run at the same time; ctest's time limit ends the test otherwise.
    while (!met) {
      if (inside == 2) met = true;
      std::this_thread::yield();
    }
  });
  EXPECT_TRUE(met);
}

TEST(ParallelFor, ALoopWithinALoopRunsAlone) {
  std::vector<std::atomic<int>> seen(12);
  parallel_for(kThreads, 3, [&](int outer, int) {
    parallel_for(kThreads, 4, [&](int inner, int worker) {
      EXPECT_EQ(worker, 0);
      ++seen[static_cast<size_t>(4 * outer + inner)];
    });
  });
  EXPECT_TRUE(std::all_of(seen.begin(), seen.end(), [](const auto& times) { return times == 1; }));
}

TEST(ParallelFor, LoopsOfSeveralThreadsDoNotMix) {
  std::vector<std::jthread> callers;
  for (int caller = 0; caller < kThreads; ++caller) {
    callers.emplace_back([caller] {
      for (int repeat = 0; repeat < 300; ++repeat) {
        const int count = 1 + caller + repeat % 20;
        EXPECT_EQ(visits(2, count), std::vector<int>(static_cast<size_t>(count), 1));
      }
    });
  }
}

}  // namespace parallel_for_test
}  // namespace palpate
