// ForEachPiece: the pieces of a render, in parallel. Between pieces the render can pause or be cancelled.
#pragma once

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <atomic>
#include <cstdint>

#include "worker/renderers/render_control.h"

namespace slabstream {

// Calls render(number) for each number of `count` pieces, on all threads of the task arena, about in order. While the render pauses, they
// are free for others. Returns early if the render is cancelled.
template <class Render>
void ForEachPiece(std::int32_t count, const RenderControl& control, Render&& render) {
  std::atomic<std::int32_t> next = 0;
  while (true) {
    tbb::parallel_for(
        0, tbb::this_task_arena::max_concurrency(),
        [&](int /*thread*/) {
          while (control.going()) {
            const std::int32_t number = next++;
            if (number >= count) return;
            render(number);
          }
        },
        tbb::simple_partitioner());
    if (next >= count || control.cancelled()) return;
    control.WaitWhilePaused();
  }
}

}  // namespace slabstream
