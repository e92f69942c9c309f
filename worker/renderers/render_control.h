// RenderControl: how others tell a render to pause, to go on, or to end. A render looks at it between its pieces (ForEachPiece): tiles or
// bands of the image, which take milliseconds. While it pauses, it keeps what it has made, and takes no thread but the one that renders.
#pragma once

#include <atomic>

#include "common/base/time.h"

namespace slabstream {

class RenderControl {
 public:
  // ---- any thread. The render goes on at first; it never does once it is cancelled.
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
  bool going() const { return state_.load(std::memory_order_relaxed) == State::kGoing; }  // else no other piece may begin
  bool cancelled() const { return state_.load(std::memory_order_relaxed) == State::kCancelled; }

  // ---- the thread that renders, while no piece is being made
  void WaitWhilePaused() const {
    const Time begin = MonotonicNow();
    state_.wait(State::kPaused);
    paused_ += MonotonicNow() - begin;
  }
  Duration paused() const { return paused_; }  // for so long altogether

 private:
  enum class State { kGoing, kPaused, kCancelled };
  std::atomic<State> state_ = State::kGoing;
  mutable Duration paused_{};  // the thread that renders knows it alone
};

}  // namespace slabstream
