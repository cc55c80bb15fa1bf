#include "offline/pipeline/ranks.hpp"

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <stdexcept>
#include <string>

#if PALPATE_MPI
#include <mpi.h>
#endif

namespace palpate {
namespace {

// Whether mpirun started this process: reads environment variables of Open MPI, MPICH and Slurm's launcher.
bool is_started_by_mpirun() {
  for (const char* variable : {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE"}) {
    if (const char* size = std::getenv(variable)) return std::string(size) != "1";
  }
  return std::getenv("PMIX_RANK") != nullptr;
}

#if PALPATE_MPI
constexpr int kAsk = 1;
constexpr int kAnswer = 2;
// Pause between polls: MPI itself would poll without a pause.
constexpr auto kPause = std::chrono::milliseconds(1);

// Waits as MPI_Wait does, but leaves the core to the solving threads.
void wait_for(MPI_Request request) {
  for (int done = 0; done == 0;) {
    MPI_Test(&request, &done, MPI_STATUS_IGNORE);
    if (done == 0) std::this_thread::sleep_for(kPause);
  }
}
#endif

}  // namespace

#if PALPATE_MPI

Ranks::Ranks() {
  if (!is_started_by_mpirun()) return;
  int provided = MPI_THREAD_SINGLE;
  MPI_Init_thread(nullptr, nullptr, MPI_THREAD_SERIALIZED, &provided);
  MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
  MPI_Comm_size(MPI_COMM_WORLD, &count_);
  MPI_Comm here = MPI_COMM_NULL;
  MPI_Comm_split_type(MPI_COMM_WORLD, MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, &here);
  MPI_Comm_size(here, &on_this_machine_);
  MPI_Comm_free(&here);
  if (provided < MPI_THREAD_SERIALIZED)
    throw std::runtime_error(
        "mpirun: this MPI supports one thread only; use an MPI with MPI_THREAD_SERIALIZED");
}

Ranks::~Ranks() {
  int started = 0;
  MPI_Initialized(&started);
  if (started != 0 && std::uncaught_exceptions() == 0) MPI_Finalize();
}

void Ranks::fail(const char* reason) {
  if (!is_first()) std::this_thread::sleep_for(std::chrono::seconds(1));
  std::fprintf(stderr, "%s\n", reason);
  std::fflush(stderr);
  MPI_Abort(MPI_COMM_WORLD, 1);
  std::abort();
}

void Ranks::wait_for_all() {
  if (count_ == 1) return;
  MPI_Request request = MPI_REQUEST_NULL;
  MPI_Ibarrier(MPI_COMM_WORLD, &request);
  wait_for(request);
}

long Ranks::sum(long number) {
  if (count_ == 1) return number;
  long total = number;
  MPI_Request request = MPI_REQUEST_NULL;
  MPI_Ireduce(&number, &total, 1, MPI_LONG, MPI_SUM, 0, MPI_COMM_WORLD, &request);
  wait_for(request);
  return total;
}

RankQueue::RankQueue(const Ranks& ranks, size_t count) : is_first_(ranks.is_first()), count_(count) {
  if (is_first_ && ranks.count() > 1)
    server_ = std::jthread(
        [this, others = ranks.count() - 1](const std::stop_token& stop) { serve(stop, others); });
}

void RankQueue::serve(const std::stop_token& stop, int others) {
  while (others > 0 && !stop.stop_requested()) {
    int asked = 0;
    MPI_Status status;
    MPI_Iprobe(MPI_ANY_SOURCE, kAsk, MPI_COMM_WORLD, &asked, &status);
    if (asked == 0) {
      std::this_thread::sleep_for(kPause);
      continue;
    }
    MPI_Recv(nullptr, 0, MPI_BYTE, status.MPI_SOURCE, kAsk, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
    const std::uint64_t index = next();
    MPI_Send(&index, 1, MPI_UINT64_T, status.MPI_SOURCE, kAnswer, MPI_COMM_WORLD);
    if (index >= count_) --others;
  }
}

size_t RankQueue::ask() {
  const std::lock_guard lock(asking_);
  if (is_empty_) return count_;
  std::uint64_t index = 0;
  MPI_Request request = MPI_REQUEST_NULL;
  MPI_Irecv(&index, 1, MPI_UINT64_T, 0, kAnswer, MPI_COMM_WORLD, &request);
  MPI_Send(nullptr, 0, MPI_BYTE, 0, kAsk, MPI_COMM_WORLD);
  wait_for(request);
  is_empty_ = index >= count_;
  return index;
}

#else

Ranks::Ranks() {
  if (is_started_by_mpirun())
    throw std::runtime_error(
        "mpirun: this palpate was built without MPI; install libopenmpi-dev and configure with "
        "-DPALPATE_MPI=ON");
}
Ranks::~Ranks() = default;
void Ranks::wait_for_all() {}
long Ranks::sum(long number) {
  return number;
}
void Ranks::fail(const char* reason) {
  throw std::runtime_error(reason);
}
RankQueue::RankQueue(const Ranks& ranks, size_t count) : is_first_(ranks.is_first()), count_(count) {}
void RankQueue::serve(const std::stop_token&, int) {}
size_t RankQueue::ask() {
  return count_;
}

#endif

RankQueue::~RankQueue() {
  if (!server_.joinable()) return;
  if (std::uncaught_exceptions() > 0) server_.request_stop();
  server_.join();
}

size_t RankQueue::next() {
  return is_first_ ? std::min(next_++, count_) : ask();
}

}  // namespace palpate
