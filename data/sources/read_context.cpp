#include "data/sources/read_context.h"

#include <algorithm>
#include <deque>
#include <mutex>
#include <thread>
#include <utility>

#include "common/base/background_tasks.h"

namespace slabstream {

struct ReadContext::State {
  explicit State(const Limits& l)
      : limits(l), decoders(l.decode_threads > 0 ? l.decode_threads : std::max<std::size_t>(1, std::thread::hardware_concurrency())) {}

  struct Waiting {
    std::uint64_t bytes = 0;
    std::function<void()> task;
  };

  const Limits limits;
  BackgroundTasks decoders;
  std::mutex mutex;  // guards what follows
  std::uint64_t under_way = 0;
  std::deque<Waiting> waiting;
};

ReadContext::ReadContext(const Limits& limits) : state_(std::make_shared<State>(limits)) {}
ReadContext::~ReadContext() = default;

void ReadContext::PostDecode(std::function<void()> task) {
  const std::lock_guard lock(state_->mutex);
  state_->decoders.Post(std::move(task));
}

void ReadContext::Admit(std::uint64_t bytes, std::function<void()> task) {
  {
    const std::lock_guard lock(state_->mutex);
    const bool fits = state_->under_way == 0 || state_->under_way + bytes <= state_->limits.under_way_bytes;
    if (!state_->waiting.empty() || !fits) {
      state_->waiting.push_back({bytes, std::move(task)});
      return;
    }
    state_->under_way += bytes;
  }
  task();
}

void ReadContext::Release(std::uint64_t bytes) {
  std::deque<State::Waiting> begun;
  {
    const std::lock_guard lock(state_->mutex);
    state_->under_way -= bytes;
    while (!state_->waiting.empty()) {
      const State::Waiting& next = state_->waiting.front();
      if (state_->under_way != 0 && state_->under_way + next.bytes > state_->limits.under_way_bytes) break;
      state_->under_way += next.bytes;
      begun.push_back(std::move(state_->waiting.front()));
      state_->waiting.pop_front();
    }
  }
  for (State::Waiting& each : begun) each.task();
}

}  // namespace slabstream
