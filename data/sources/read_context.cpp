#include "data/sources/read_context.h"

#include <algorithm>
#include <deque>
#include <mutex>
#include <thread>
#include <utility>

#include "common/threads/background_tasks.h"

namespace slabstream {

struct ReadContext::State {
  explicit State(const Limits& l)
      : limits(l),
        decode_threads(l.decode_threads > 0 ? l.decode_threads : std::max<std::size_t>(1, std::thread::hardware_concurrency())),
        decoders(decode_threads),
        cache(l.cache_bytes) {}

  struct Waiting {
    std::uint64_t bytes = 0;
    std::function<void()> task;
  };

  bool Fits(std::uint64_t bytes) const { return tasks == 0 || (tasks < most_tasks && under_way + bytes <= limits.under_way_bytes); }
  void Begin(std::uint64_t bytes) {
    ++tasks;
    under_way += bytes;
  }

  const Limits limits;
  const std::size_t decode_threads;
  const std::size_t most_tasks = kMostAsked + 2 * decode_threads;
  std::mutex post_mutex;  // BackgroundTasks::Post wants one caller at a time
  BackgroundTasks decoders;
  ChunkCache cache;
  std::mutex mutex;       // guards what follows
  std::size_t tasks = 0;  // that were begun and not released
  std::uint64_t under_way = 0;
  std::deque<Waiting> waiting;
  bool beginning = false;  // a thread runs tasks that have waited
};

ReadContext::ReadContext(const Limits& limits) : state_(std::make_shared<State>(limits)) {}
ReadContext::~ReadContext() = default;

ChunkCache& ReadContext::cache() { return state_->cache; }
std::uint64_t ReadContext::small_bytes() const { return state_->limits.small_bytes; }

void ReadContext::PostDecode(std::function<void()> task) {
  const std::lock_guard lock(state_->post_mutex);
  state_->decoders.Post(std::move(task));
}

void ReadContext::Admit(std::uint64_t bytes, std::function<void()> task) {
  {
    const std::lock_guard lock(state_->mutex);
    if (!state_->waiting.empty() || !state_->Fits(bytes)) {
      state_->waiting.push_back({bytes, std::move(task)});
      return;
    }
    state_->Begin(bytes);
  }
  task();
}

void ReadContext::Release(std::uint64_t bytes) {
  const std::shared_ptr<State> state = state_;  // a task may let go of the context
  std::unique_lock lock(state->mutex);
  --state->tasks;
  state->under_way -= bytes;
  // A task that ends at once calls this again. The loop that is under way then begins the next one, so calls do not nest deeper and deeper.
  if (std::exchange(state->beginning, true)) return;
  while (!state->waiting.empty() && state->Fits(state->waiting.front().bytes)) {
    State::Waiting next = std::move(state->waiting.front());
    state->waiting.pop_front();
    state->Begin(next.bytes);
    lock.unlock();
    next.task();
    next.task = nullptr;  // may destroy a source
    lock.lock();
  }
  state->beginning = false;
}

}  // namespace slabstream
