// Distributes the sites of a build over the ranks of an mpirun, or over the threads of a single process.
//
//   rank 0     threads ---- next() ----+
//              serve() <--- which? ----+---- ranks 1 .. : threads, next()
//
// Ranks exchange site numbers only. Each rank keeps its solves in the shared folder of samples, which rank 0
// reads at the end. Rank 0 solves a missing site itself: the pack does not depend on the ranks.
#pragma once

#include <atomic>
#include <mutex>
#include <thread>

namespace palpate {

// Throws std::runtime_error where mpirun started this program without MPI. At most one instance exists.
class Ranks {
 public:
  Ranks();
  ~Ranks();
  Ranks(const Ranks&) = delete;
  Ranks& operator=(const Ranks&) = delete;

  int count() const { return count_; }
  bool is_first() const { return rank_ == 0; }
  int on_this_machine() const { return on_this_machine_; }
  // Waits until all ranks arrive.
  void wait_for_all();
  // Ends all ranks after an error. Rank 0 reports first: most errors occur on every rank.
  [[noreturn]] void fail(const char* reason);
  // Returns the sum over all ranks on rank 0, and `number` on other ranks.
  long sum(long number);

 private:
  int rank_ = 0;
  int count_ = 1;
  int on_this_machine_ = 1;
};

// Hands out 0, 1 .. count - 1, each to one thread of one rank. All ranks construct the queue together.
class RankQueue {
 public:
  RankQueue(const Ranks& ranks, size_t count);
  ~RankQueue();  // rank 0 waits until all ranks know that the queue is empty, except during an exception
  RankQueue(const RankQueue&) = delete;
  RankQueue& operator=(const RankQueue&) = delete;

  // Returns `count` where the queue is empty. Thread-safe.
  size_t next();
  // Returns, on rank 0, the count of numbers handed out to all ranks.
  size_t handed_out() const { return next_ < count_ ? next_.load() : count_; }

 private:
  // Rank 0: answers the `others` until each knows that the queue is empty.
  void serve(const std::stop_token& stop, int others);
  // Other ranks: requests a number from rank 0.
  size_t ask();
  bool is_first_;
  size_t count_;
  std::atomic<size_t> next_ = 0;
  std::mutex asking_;
  bool is_empty_ = false;  // rank 0 has said that the queue is empty
  std::jthread server_;
};

}  // namespace palpate
