// ForEachPiece: the pieces of a render, in parallel. Between pieces the render can pause or be cancelled.
#pragma once

#include <atomic>
#include <cstdint>

#include "common/parallel/parallel.h"
#include "worker/renderers/render_control.h"

namespace slabstream {

// Calls render(number) for each number of `count` pieces, on all threads of the task arena, about in order. While the render pauses, they
// are free for others. Returns early if the render is cancelled.
template <class Render>
void ForEachPiece(std::int32_t count, const RenderControl& control, Render&& render) {
  std::atomic<std::int32_t> next = 0;
  while (true) {
    OnEveryThread([&] {
      while (control.going()) {
        const std::int32_t number = next++;
        if (number >= count) return;
        render(number);
      }
    });
    if (next >= count || control.cancelled()) return;
    control.WaitWhilePaused();
  }
}

}  // namespace slabstream
