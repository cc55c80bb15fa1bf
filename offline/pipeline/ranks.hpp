// The processes that mpirun started to share one build: they hand out its sites among themselves. Without mpirun, or in
// a program configured without MPI, one process that hands them out to its own threads.
//
//   rank 0     threads ---- next() ----+
//              serve() <--- which? ----+---- ranks 1 .. : threads, next()
//
// Nothing else passes between them: what each solves it keeps in the folder of samples, which all must see, and rank 0
// takes it from there when all are done. A site that it does not find there it solves itself, so that the pack is the
// same whatever the ranks did.
#pragma once

#include <atomic>
#include <mutex>
#include <thread>

namespace palpate {

// Throws std::runtime_error where mpirun started this program but MPI cannot be had. One at a time.
class Ranks {
 public:
  Ranks();
  ~Ranks();
  Ranks(const Ranks&) = delete;
  Ranks& operator=(const Ranks&) = delete;

  int count() const { return count_; }
  bool is_first() const { return rank_ == 0; }
  int on_this_machine() const { return on_this_machine_; }
  // Every rank waits until all have come here.
  void wait_for_all();
  // What went wrong here ends all of them; the first rank is let speak first, for most of it goes wrong everywhere.
  [[noreturn]] void fail(const char* reason);
  // The sum over all ranks, on the first; on the others its own share.
  long sum(long number);

 private:
  int rank_ = 0;
  int count_ = 1;
  int on_this_machine_ = 1;
};

// Hands out 0, 1 .. count - 1, each to one thread of one rank. Made by all ranks at once.
class RankQueue {
 public:
  RankQueue(const Ranks& ranks, size_t count);
  ~RankQueue();  // on the first rank waits until all others know that nothing is left, but for an exception
  RankQueue(const RankQueue&) = delete;
  RankQueue& operator=(const RankQueue&) = delete;

  // `count` where nothing is left. From any thread.
  size_t next();
  // On the first rank: handed out so far, to anyone.
  size_t handed_out() const { return next_ < count_ ? next_.load() : count_; }

 private:
  void serve(const std::stop_token& stop, int others);
  size_t ask();
  bool is_first_;
  size_t count_;
  std::atomic<size_t> next_ = 0;
  std::mutex asking_;
  bool is_empty_ = false;  // as the first rank has said
  std::jthread server_;
};

}  // namespace palpate
