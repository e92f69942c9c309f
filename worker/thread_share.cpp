#include "worker/thread_share.h"

#include <tbb/global_control.h>
#include <tbb/info.h>

#include <algorithm>
#include <cstddef>
#include <mutex>
#include <optional>

namespace slabstream {
namespace {

class Pool {
 public:
  void Change(int workers, int threads) {
    const std::lock_guard lock(mutex_);
    workers_ += workers;
    threads_ += threads;
    limit_.reset();  // oneTBB applies the smallest of several limits
    if (needed() > tbb::info::default_concurrency()) limit_.emplace(tbb::global_control::max_allowed_parallelism, std::size_t(needed()));
  }

  int threads() {
    const std::lock_guard lock(mutex_);
    return std::min(threads_, std::max(needed(), tbb::info::default_concurrency()));
  }

 private:
  int needed() const { return threads_ - workers_ + 1; }  // by one arena: each worker has one thread of its own

  std::mutex mutex_;
  int workers_ = 0, threads_ = 0;  // of this process
  std::optional<tbb::global_control> limit_;
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
