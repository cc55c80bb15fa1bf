// Threads of the process that share its loops.
//
//   caller                         gate                       other threads
//   sets the job, opens it  -->  open | how many inside  -->  enter while it is open, run the job, leave
//   runs the job, closes it, waits until nobody is inside
//
// A thread that finds the gate closed waits again: a finished loop does not wait for late threads.
#include "offline/fem/parallel_for.hpp"

#include <chrono>
#include <cstdint>
#include <exception>
#include <thread>
#include <vector>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace palpate {
namespace {

// Spin time before a thread sleeps. Loops of one Newton iteration follow one another faster than the system
// wakes a thread.
constexpr std::chrono::microseconds kPatience{200};

void pause() {
#if defined(__x86_64__)
  _mm_pause();
#endif
}

class Team {
 public:
  Team() = default;
  Team(const Team&) = delete;
  Team& operator=(const Team&) = delete;
  ~Team() {
    stopping_ = true;
    wake_threads();
  }

  void run(int threads, void (*job)(void*, int), void* context) {
    if (threads <= 1 || in_use_.test_and_set(std::memory_order_acquire)) {
      job(context, 0);
      return;
    }
    grow(threads);
    job_ = job;
    context_ = context;
    job_threads_ = threads;
    gate_.store(kOpen, std::memory_order_release);
    wake_threads();
    job(context, 0);
    gate_.fetch_and(~kOpen, std::memory_order_acq_rel);
    for (int spins = 0; gate_.load(std::memory_order_acquire) != 0; ++spins) {
      constexpr int kSpins = 10000;  // after these spins a thread inside may need this processor
      if (spins < kSpins) {
        pause();
      } else {
        std::this_thread::yield();
      }
    }
    in_use_.clear(std::memory_order_release);
  }

 private:
  static constexpr unsigned kOpen = 1;
  static constexpr unsigned kOneInside = 2;

  void grow(int threads) {
    try {
      for (int worker = static_cast<int>(others_.size()) + 1; worker < threads; ++worker)
        others_.emplace_back([this, worker, seen = round_.load()] { serve(worker, seen); });
    } catch (const std::exception&) {
      // The system gives no more threads or memory: the existing threads run the loop.
    }
  }

  void wake_threads() {
    round_.fetch_add(1, std::memory_order_release);
    round_.notify_all();
  }

  void serve(int worker, std::uint32_t seen) {
    while (true) {
      seen = next_round(seen);
      if (stopping_) return;
      unsigned gate = gate_.load(std::memory_order_relaxed);
      while ((gate & kOpen) != 0 &&
             !gate_.compare_exchange_weak(gate, gate + kOneInside, std::memory_order_acquire)) {
      }
      if ((gate & kOpen) == 0) continue;
      if (worker < job_threads_) job_(context_, worker);
      gate_.fetch_sub(kOneInside, std::memory_order_release);
    }
  }

  std::uint32_t next_round(std::uint32_t seen) const {
    const auto until = std::chrono::steady_clock::now() + kPatience;
    while (true) {
      const std::uint32_t round = round_.load(std::memory_order_acquire);
      if (round != seen) return round;
      if (std::chrono::steady_clock::now() < until) {
        pause();
      } else {
        round_.wait(seen, std::memory_order_acquire);
      }
    }
  }

  std::atomic_flag in_use_;
  void (*job_)(void*, int) = nullptr;
  void* context_ = nullptr;
  int job_threads_ = 0;
  alignas(64) std::atomic<unsigned> gate_ = 0;
  alignas(64) std::atomic<std::uint32_t> round_ = 0;
  std::atomic<bool> stopping_ = false;
  std::vector<std::jthread> others_;  // last member: the threads end before their data
};

}  // namespace

void run_on_threads(int threads, void (*run)(void* context, int worker), void* context) {
  static Team team;
  team.run(threads, run, context);
}

}  // namespace palpate
