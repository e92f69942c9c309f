// RenderControl: how others tell a render to pause, to go on, or to end. A render looks at it between two of its pieces (ForEachPiece). A
// piece is a tile or band of the image and takes milliseconds. While the render pauses, it keeps what it has made, and it holds no thread
// but the one that renders.
#pragma once

#include <atomic>

#include "common/base/time.h"

namespace slabstream {

class RenderControl {
 public:
  // ---- any thread. At first the render is going. Once it is cancelled, it never goes on.
  void Pause() {
    State going = State::kGoing;
    state_.compare_exchange_strong(going, State::kPaused);
  }
  void Resume() {
    State paused = State::kPaused;
    if (state_.compare_exchange_strong(paused, State::kGoing)) state_.notify_all();
  }
  void Cancel() {
    state_ = State::kCancelled;
    state_.notify_all();
  }

  // ---- any thread of the render
  bool going() const { return state_.load(std::memory_order_relaxed) == State::kGoing; }  // false: no other piece may begin
  bool cancelled() const { return state_.load(std::memory_order_relaxed) == State::kCancelled; }

  // ---- the thread that renders, while no piece is being made
  void WaitWhilePaused() const {
    const Time begin = MonotonicNow();
    state_.wait(State::kPaused);
    paused_ += MonotonicNow() - begin;
  }
  Duration paused() const { return paused_; }  // how long the render has paused altogether

 private:
  enum class State { kGoing, kPaused, kCancelled };
  std::atomic<State> state_ = State::kGoing;
  mutable Duration paused_{};  // only the thread that renders uses it
};

}  // namespace slabstream
