#include "worker/thread_share.h"

#include <tbb/global_control.h>
#include <tbb/info.h>

#include <cstddef>
#include <mutex>
#include <optional>

namespace slabstream {
namespace {

class Pool {
 public:
  void Change(int threads) {
    const std::lock_guard lock(mutex_);
    threads_ += threads;
    limit_.reset();  // of several limits oneTBB takes the smallest
    const int parallelism = threads_ + 1;
    if (parallelism > tbb::info::default_concurrency()) {
      limit_.emplace(tbb::global_control::max_allowed_parallelism, std::size_t(parallelism));
    }
  }

 private:
  std::mutex mutex_;
  int threads_ = 0;  // that the workers of this process want beside their own
  std::optional<tbb::global_control> limit_;
};

Pool& ProcessPool() {
  static Pool pool;
  return pool;
}

}  // namespace

ThreadShare::ThreadShare(int threads) : threads_(threads) { ProcessPool().Change(threads_ - 1); }
ThreadShare::~ThreadShare() { ProcessPool().Change(1 - threads_); }

}  // namespace slabstream
