// ForEachPiece: the pieces of a render, in parallel. Between pieces the render can pause or be cancelled.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <vector>

#include "common/parallel/parallel.h"
#include "worker/renderers/render_control.h"

namespace slabstream {

// Calls render(number) for each number of `count` pieces, on all threads of the task arena, each about in order. With several `run_count`,
// each thread follows a run of neighbours, which need much the same voxels, then helps the others with theirs: for many pieces that take
// about as long. While the render pauses, threads are free for others. Returns early if the render is cancelled.
template <class Render>
void ForEachPiece(std::int32_t count, const RenderControl& control, Render&& render, int run_count = 1) {
  struct alignas(64) Run {
    std::atomic<std::int32_t> next = 0;
    std::int32_t end = 0;
  };
  std::vector<Run> runs(std::size_t(std::clamp(run_count, 1, std::max(count, 1))));
  for (std::size_t i = 0; i < runs.size(); ++i) {
    runs[i].next = std::int32_t(std::int64_t(i) * count / std::int64_t(runs.size()));
    runs[i].end = std::int32_t(std::int64_t(i + 1) * count / std::int64_t(runs.size()));
  }
  while (true) {
    std::atomic<std::size_t> threads = 0;
    OnEveryThread([&] {
      const std::size_t first = threads++;
      for (std::size_t i = 0; i < runs.size(); ++i) {
        Run& run = runs[(first + i) % runs.size()];
        while (control.going()) {
          const std::int32_t number = run.next++;
          if (number >= run.end) break;
          render(number);
        }
      }
    });
    if (std::ranges::all_of(runs, [](const Run& run) { return run.next >= run.end; }) || control.cancelled()) return;
    control.WaitWhilePaused();
  }
}

}  // namespace slabstream
