#include "worker/service/thread_share.h"

#include <algorithm>
#include <mutex>
#include <optional>

#include "common/parallel/task_arena.h"

namespace slabstream {
namespace {

class Pool {
 public:
  void Change(int workers, int threads) {
    const std::lock_guard lock(mutex_);
    workers_ += workers;
    threads_ += threads;
    limit_.reset();  // of several limits the least one counts
    if (needed() > DefaultThreads()) limit_.emplace(needed());
  }

  int threads() {
    const std::lock_guard lock(mutex_);
    return std::min(threads_, std::max(needed(), DefaultThreads()));
  }

 private:
  int needed() const { return threads_ - workers_ + 1; }  // by one arena: each worker has one thread of its own

  std::mutex mutex_;
  int workers_ = 0, threads_ = 0;  // of this process
  std::optional<ThreadLimit> limit_;
};

Pool& ProcessPool() {
  static Pool pool;
  return pool;
}

}  // namespace

ThreadShare::ThreadShare(int threads) : threads_(threads) { ProcessPool().Change(1, threads_); }
ThreadShare::~ThreadShare() { ProcessPool().Change(-1, -threads_); }

int ThreadShare::OfProcess() { return ProcessPool().threads(); }

}  // namespace slabstream
